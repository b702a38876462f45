#include "runtime/clock_survey.hpp"

#include <cstdlib>
#include <utility>
#include <variant>

namespace hueline::runtime {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::size_t kMostWaiting = 600;          // pulses that wait for the name of their second
constexpr std::int64_t kFarFromPulse = 5'000'000;  // ns; an edge that far from its second is none of them

bool tells_of_clock(const Measurement& one) {
  return !std::holds_alternative<Fault>(one) && !std::holds_alternative<LaserBatch>(one) &&
         !std::holds_alternative<LaserStatus>(one) && !std::holds_alternative<Image>(one) &&
         !std::holds_alternative<EventMark>(one) && !std::holds_alternative<WheelSpeed>(one);
}

}  // namespace

ClockSurvey::ClockSurvey(const config::Rig& rig)
    : pps_(rig.sync.clock.pps),
      edge_delay_(rig.sync.clock.edge_delay),
      decoders_(rig.sensors.size() + 1),
      synchroniser_(rig.sync) {
  const auto is_source = [&](SensorId id) {
    for (const auto* list : {&rig.sync.label_sources, &rig.sync.arrival_sources})
      for (const SensorId one : *list)
        if (one == id) return true;
    return rig.sync.label_sources.empty() || rig.sync.arrival_sources.empty() || id == rig.sync.clock.pps;
  };
  for (const auto& sensor : rig.sensors)
    if (sensor.type->role != drivers::Role::Camera && is_source(sensor.id))
      decoders_[sensor.id] = sensor.device->make_decoder();
}

void ClockSurvey::take(const Packet& packet) {
  if (packet.shed) return;
  measured_.clear();
  Decoder* const decoder = packet.sensor < decoders_.size() ? decoders_[packet.sensor].get() : nullptr;
  if (decoder && packet.kind == PacketKind::Wire) decoder->decode(packet, measured_);
  if (decoder && packet.kind == PacketKind::Fault)
    if (const auto fault = decode_fault(packet.sensor, packet.received, packet.bytes.bytes());
        fault.ok() && fault->kind == FaultKind::Disconnected)
      decoder->reset();
  for (Measurement& one : measured_) {
    if (!tells_of_clock(one)) continue;
    if (const auto* edge = std::get_if<PpsEdge>(&one); edge && edge->sensor == pps_) {
      waiting_.push_back(edge->edge - edge_delay_);
      if (waiting_.size() > kMostWaiting) waiting_.pop_front();
    }
    synchroniser_.process(std::move(one), synchronised_);
  }
  synchroniser_.advance(packet.received, synchronised_);
  synchronised_.clear();
  const sync::HostClockModel& clock = synchroniser_.clock();
  if (clock.counts().restarts != std::exchange(restarts_, clock.counts().restarts)) since_restart_ = seconds_.size();
  if (!clock.can_stamp()) return;
  if (clock.is_from_arrivals()) return take_arrivals(packet.received);
  if (clock.counts().relabels != std::exchange(relabels_, clock.counts().relabels)) relabel();
  if (!waiting_.empty() && clock.state() == SyncState::Locked) take_edges();
}

/// Returns the whole second next to a time of this computer.
std::int64_t ClockSurvey::second_of(HostTime at) const {
  return (count_ns(synchroniser_.clock().stamp(at)->time) + kSecond / 2) / kSecond;
}

void ClockSurvey::take_edges() {
  for (const HostTime edge : std::exchange(waiting_, {})) {
    const auto stamp = synchroniser_.clock().stamp(edge);
    if (!stamp) continue;
    const std::int64_t second = second_of(edge);
    if (std::abs(count_ns(stamp->time) - second * kSecond) > kFarFromPulse) continue;
    const std::size_t before = seconds_.size();
    add(second, edge, stamp->sigma);
    by_pulses_ += seconds_.size() - before;
  }
}

/// Without pulses: the first packet of each second says what the second was.
void ClockSurvey::take_arrivals(HostTime now) {
  waiting_.clear();
  const auto stamp = synchroniser_.clock().stamp(now);
  if (!stamp) return;
  const std::int64_t second = count_ns(stamp->time) / kSecond;
  add(second, now - (stamp->time - gps_time_ns(second * kSecond)), stamp->sigma);
}

/// The model has found that it had named the pulses wrongly by whole seconds.
void ClockSurvey::relabel() {
  if (since_restart_ >= seconds_.size()) return;
  const std::int64_t moved = second_of(seconds_.back().at) - seconds_.back().second;
  for (std::size_t i = since_restart_; i < seconds_.size(); ++i) seconds_[i].second += moved;
}

void ClockSurvey::add(std::int64_t second, HostTime at, nanoseconds sigma) {
  if (seconds_.empty() || second > seconds_.back().second) seconds_.push_back({second, at, sigma});
}

}  // namespace hueline::runtime
