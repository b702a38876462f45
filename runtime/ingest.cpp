#include "runtime/ingest.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <utility>

namespace hueline::runtime {
namespace {

constexpr const char* kRefused = "recorder's queue was full: not recorded; the disk is too slow";
constexpr std::size_t kRoomToTell = 1024;  // bytes, for a fault with its text

Packet packet_of(const Fault& fault) {
  return {fault.sensor, PacketKind::Fault, false, 0, fault.time, Buffer::copy_of(encode_fault(fault))};
}

/// Returns whether a fault tells the state of a device. Such faults are recorded at once, because decoders begin anew
/// at them. The reader's back-off and its patience keep them rare.
bool is_state(FaultKind kind) {
  return kind == FaultKind::Disconnected || kind == FaultKind::Reconnected || kind == FaultKind::Silent;
}

}  // namespace

Ingest::Ingest(std::vector<Sensor> sensors, PacketQueue& record, PacketQueue& pipeline,
               PacketQueue::Limits pipeline_limits)
    : sensors_(std::move(sensors)),
      record_(record),
      pipeline_(pipeline),
      soft_{pipeline_limits.items / 4 * 3, pipeline_limits.weight / 4 * 3},
      ledger_{std::vector<Ledger::Sensor>(sensors_.size())},
      shed_(sensors_.size()) {}

bool Ingest::submit(Packet packet, HostTime arrived) {
  Lock lock(mutex_);
  newest_ = std::max(newest_, arrived);
  if (packet.received > arrived + kMostAhead || packet.received < arrived - kMostBehind) {
    const double off_s = to_seconds(packet.received.time_since_epoch()) - to_seconds(arrived.time_since_epoch());
    faults_.add({packet.sensor, FaultKind::ClockStep, arrived, 1,
                 fmt::format("stamped {:+.3f} s off its arrival: recorded as received when it arrived; a PPS sender "
                             "must stamp with this computer's "
                             "CLOCK_MONOTONIC_RAW; was CLOCK_REALTIME set?",
                             off_s)},
                newest_);
    packet.received = arrived;
  }
  return take(std::move(packet));
}

bool Ingest::submit(Packet packet) {
  Lock lock(mutex_);
  newest_ = std::max(newest_, packet.received);
  return take(std::move(packet));
}

bool Ingest::submit(const Fault& fault) { return submit(packet_of(fault)); }

bool Ingest::submit_ledger() {
  Lock lock(mutex_);
  return place_ledger();
}

bool Ingest::place_ledger() {
  return place({kSystemSensor, PacketKind::Ledger, false, 0, newest_, Buffer::copy_of(encode_ledger(ledger_))});
}

bool Ingest::take(Packet packet) {
  if (packet.kind == PacketKind::Fault) {
    Result<Fault> fault = decode_fault(packet.sensor, packet.received, packet.bytes.bytes());
    if (fault.ok() && !is_state(fault->kind)) {
      faults_.add(std::move(*fault), newest_);
      tell_faults();
      return true;
    }
  }
  faults_.advance(newest_);
  tell_faults();
  if (!refused_untold_.empty() && record_.has_room_for(kRoomToTell)) tell_refused(packet.received);
  return place(std::move(packet));
}

void Ingest::tell_faults() {
  // Reported later, with the counts that are added until then.
  for (Fault& fault : faults_.take())
    if (!place(packet_of(fault))) faults_.take_back(std::move(fault));
}

bool Ingest::is_refusal(const Fault& fault) { return fault.kind == FaultKind::Overflow && fault.detail == kRefused; }

bool Ingest::wait_for_room(std::stop_token stop) {
  // mutex_ is not held here, so that the other readers can continue.
  return record_.wait_until_below(0.5, stop) && pipeline_.wait_until_below(0.5, stop);
}

bool Ingest::tell_the_rest(std::stop_token stop) {
  while (true) {
    {
      Lock lock(mutex_);
      if (!refused_untold_.empty() && record_.has_room_for(kRoomToTell)) tell_refused(newest_);
      faults_.flush();
      auto untold = faults_.take();
      std::erase_if(untold, [&](const Fault& fault) HUELINE_REQUIRES(mutex_) { return place(packet_of(fault)); });
      if (refused_untold_.empty() && untold.empty() && place_ledger()) return true;
      for (Fault& fault : untold) faults_.take_back(std::move(fault));
    }
    if (!record_.wait_until_below(0.5, stop)) return false;
  }
}

void Ingest::tell_refused(HostTime now) {
  const auto untold = std::exchange(refused_untold_, {});
  for (const auto& [sensor, count] : untold) {
    if (!place(packet_of({sensor, FaultKind::Overflow, now, count, kRefused}))) {
      refused_untold_[sensor] += count;  // still no room: reported later, with the counts that are added until then
    }
  }
}

bool Ingest::place(Packet packet) {
  const SensorId sensor = packet.sensor < sensors_.size() ? packet.sensor : kSystemSensor;
  Ledger::Sensor& counts = ledger_.sensors[sensor];
  const std::size_t weight = packet.bytes.size() + 64;
  const bool is_wire = packet.kind == PacketKind::Wire;
  packet.sequence = next_sequence_++;
  // Only Ingest fills the pipeline's queue, so a packet that fits here still fits below.
  packet.shed = !pipeline_.has_room_for(weight) ||
                (is_wire && sensors_[sensor].is_sheddable &&
                 (pipeline_.size() >= soft_.items || pipeline_.weight() + weight > soft_.weight));
  const auto shared = std::make_shared<const Packet>(std::move(packet));
  if (!record_.try_push(shared, weight)) {
    ++counts.refused;
    if (is_wire) {
      ++counts.refused_wire;
      ++refused_untold_[sensor];
    }
    return false;
  }
  ++counts.packets;
  if (is_wire) ++counts.wire;
  counts.bytes += shared->bytes.size();
  if (!shared->shed) {
    pipeline_.try_push(shared, weight);
    return true;
  }
  ++counts.shed;
  Shed& shed = shed_[sensor];
  ++shed.packets;
  shed.bytes += shared->bytes.size();
  if (is_wire) {
    ++shed.wire;
    shed.wire_bytes += shared->bytes.size();
  }
  return true;
}

Ledger::Sensor Ingest::counts(SensorId sensor) const {
  Lock lock(mutex_);
  return ledger_.sensors.at(sensor);
}

Ingest::Shed Ingest::shed(SensorId sensor) const {
  Lock lock(mutex_);
  return shed_.at(sensor);
}

std::uint64_t Ingest::next_sequence() const {
  Lock lock(mutex_);
  return next_sequence_;
}

}  // namespace hueline::runtime
