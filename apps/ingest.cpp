#include "apps/ingest.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace hueline::apps {
namespace {

constexpr std::size_t kRoomToTell = 1024;  // of a fault, with its words

}  // namespace

Ingest::Ingest(std::vector<Sensor> sensors, PacketQueue& record, PacketQueue& pipeline, PacketQueue::Limits pipeline_limits)
    : sensors_(std::move(sensors)),
      record_(record),
      pipeline_(pipeline),
      soft_{pipeline_limits.items / 4 * 3, pipeline_limits.weight / 4 * 3},
      counts_(sensors_.size()) {}

bool Ingest::submit(Packet packet) {
  std::lock_guard lock(mutex_);
  newest_ = std::max(newest_, packet.received);
  if (!refused_untold_.empty() && record_.has_room_for(kRoomToTell)) tell_refused(packet.received);
  return place(std::move(packet));
}

bool Ingest::submit(const Fault& fault) {
  Packet packet;
  packet.sensor = fault.sensor;
  packet.kind = PacketKind::Fault;
  packet.received = fault.time;
  packet.bytes = Buffer::copy_of(encode_fault(fault));
  std::lock_guard lock(mutex_);
  return place(std::move(packet));
}

bool Ingest::wait_for_room(std::stop_token stop) {
  // Not under mutex_: the others go on meanwhile.
  return record_.wait_until_below(0.5, stop) && pipeline_.wait_until_below(0.5, stop);
}

bool Ingest::tell_the_rest(std::stop_token stop) {
  while (true) {
    {
      std::lock_guard lock(mutex_);
      if (!refused_untold_.empty() && record_.has_room_for(kRoomToTell)) tell_refused(newest_);
      if (refused_untold_.empty()) return true;
    }
    if (!record_.wait_until_below(0.5, stop)) return false;
  }
}

void Ingest::tell_refused(HostTime now) {
  const auto untold = std::exchange(refused_untold_, {});
  for (const auto& [sensor, count] : untold) {
    Packet packet;
    packet.sensor = sensor;
    packet.kind = PacketKind::Fault;
    packet.received = now;
    packet.bytes = Buffer::copy_of(encode_fault(
        {sensor, FaultKind::Overflow, now, count, "recorder's queue was full: not recorded; the disk is too slow"}));
    if (!place(std::move(packet))) {
      refused_untold_[sensor] += count;  // still no room: told later, with what comes to it
    }
  }
}

bool Ingest::place(Packet packet) {
  const SensorId sensor = packet.sensor < sensors_.size() ? packet.sensor : kSystemSensor;
  Counts& counts = counts_[sensor];
  const std::size_t weight = packet.bytes.size() + 64;
  packet.sequence = next_sequence_++;
  // Only Ingest fills the pipeline's queue, so what fits now still fits below.
  packet.shed = !pipeline_.has_room_for(weight) ||
                (packet.kind == PacketKind::Wire && sensors_[sensor].is_sheddable &&
                 (pipeline_.size() >= soft_.items || pipeline_.weight() + weight > soft_.weight));
  const auto shared = std::make_shared<const Packet>(std::move(packet));
  if (!record_.try_push(shared, weight)) {
    ++counts.refused;
    if (shared->kind == PacketKind::Wire) ++refused_untold_[sensor];
    return false;
  }
  ++counts.packets;
  counts.bytes += shared->bytes.size();
  if (shared->shed) ++counts.shed;
  if (!shared->shed) pipeline_.try_push(shared, weight);
  return true;
}

Ingest::Counts Ingest::counts(SensorId sensor) const {
  std::lock_guard lock(mutex_);
  return counts_.at(sensor);
}

std::uint64_t Ingest::next_sequence() const {
  std::lock_guard lock(mutex_);
  return next_sequence_;
}

}  // namespace hueline::apps
