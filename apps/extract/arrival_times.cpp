#include "apps/extract/arrival_times.hpp"

#include <utility>

#include "core/calendar.hpp"

namespace hueline::apps {

ArrivalTimes::ArrivalTimes(const config::Rig& rig) : decoders_(rig.sensors.size() + 1), synchroniser_(rig.sync) {
  for (const auto& sensor : rig.sensors)
    if (sensor.type->role != drivers::Role::Camera) decoders_[sensor.id] = sensor.device->make_decoder();
}

Result<ArrivalTimes> ArrivalTimes::open(runtime::Recording& recording) {
  ArrivalTimes ahead(recording.rig);
  const Status read = recording.for_each([&](const Packet& packet) {
    ahead.take(packet);
    return !ahead.first_;
  });
  if (!read.ok() && read.error().code == ErrorCode::Io) return read.error();
  if (Status again = recording.journal->open(); !again.ok()) return again.error();
  ArrivalTimes out(recording.rig);
  out.first_ = ahead.first_;
  return out;
}

void ArrivalTimes::take(const Packet& packet) {
  if (packet.shed) return;
  measured_.clear();
  Decoder* const decoder = packet.sensor < decoders_.size() ? decoders_[packet.sensor].get() : nullptr;
  if (packet.kind == PacketKind::Wire && decoder) decoder->decode(packet, measured_);
  for (Measurement& one : measured_)
    if (!std::holds_alternative<Fault>(one)) synchroniser_.process(std::move(one), synchronised_);
  synchroniser_.advance(packet.received, synchronised_);
  synchronised_ = {};
  if (first_) return;
  const sync::HostClockModel& clock = synchroniser_.clock();
  if (const auto stamp = clock.stamp(packet.received))
    first_ =
        to_unix(stamp->time, clock.utc_offset(stamp->time)).time_since_epoch() - packet.received.time_since_epoch();
}

std::optional<UnixTime> ArrivalTimes::of(HostTime t) const {
  const sync::HostClockModel& clock = synchroniser_.clock();
  if (const auto stamp = clock.stamp(t)) return to_unix(stamp->time, clock.utc_offset(stamp->time));
  if (first_) return UnixTime(t.time_since_epoch() + *first_);
  return {};
}

}  // namespace hueline::apps
