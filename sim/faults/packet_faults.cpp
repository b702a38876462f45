// Faults of packets on their way, and of the clock that stamps their arrival.
#include <algorithm>
#include <cmath>

#include "sim/faults/stages.hpp"
#include "sim/wire/faults.hpp"
#include "sim/wire/utc.hpp"

namespace hueline::sim {
namespace {

constexpr std::int64_t kDuplicateAfterNs = 100'000;
constexpr std::int64_t kBacklogStepNs = 10'000;  // time between packets of a backlog
constexpr std::size_t kLaserCounterAt = 1200, kStatusCounterAt = 198;

WireChannel channel_of(FaultTarget target) {
  switch (target) {
    case FaultTarget::LaserStatus:
      return WireChannel::LaserPosition;
    case FaultTarget::Pos:
      return WireChannel::Pos;
    case FaultTarget::Pps:
      return WireChannel::Pps;
    case FaultTarget::Camera:
      return WireChannel::Camera;
    case FaultTarget::Wheel:
      return WireChannel::Wheel;
    case FaultTarget::Laser:
    case FaultTarget::Host:
      break;
  }
  return WireChannel::LaserData;
}

/// Restores the order of sending on byte streams and on the camera's link, which keep it. Datagrams may overtake each
/// other.
void keep_order(WireChannel channel, std::vector<WireEvent>& events) {
  if (channel != WireChannel::Pos && channel != WireChannel::Camera) return;
  std::int64_t earliest = 0;
  for (WireEvent& event : events)
    if (event.channel == channel) event.at_ns = earliest = std::max(earliest, event.at_ns);
}

std::size_t lose_bursts(const FaultLine& line, WireChannel channel, std::vector<WireEvent>& events) {
  const auto burst = static_cast<std::size_t>(std::llround(line.strength));
  std::int64_t second = -1;
  std::size_t lost = 0, hits = 0;
  std::erase_if(events, [&](const WireEvent& event) {
    if (event.channel != channel || !line.covers(event.at_ns)) return false;
    const std::int64_t now = (event.at_ns - line.begin_ns()) / kNsPerSecond;
    if (now != second) lost = 0;
    second = now;
    if (lost >= burst) return false;
    ++lost;
    ++hits;
    return true;
  });
  return hits;
}

/// Delays each event that the line covers by `delay_ns(event)`.
template <class Delay>
std::size_t delay(const FaultLine& line, WireChannel channel, std::vector<WireEvent>& events, Delay delay_ns) {
  std::size_t hits = 0;
  for (WireEvent& event : events) {
    if (event.channel != channel || !line.covers(event.at_ns)) continue;
    event.at_ns += delay_ns(event);
    ++hits;
  }
  keep_order(channel, events);
  return hits;
}

Bytes random_bytes(std::size_t count, SeededRandom& random) {
  Bytes out(count);
  for (std::byte& b : out) b = static_cast<std::byte>(random.next() & 0xff);
  return out;
}

/// Adds noise of a few bytes at a time between logs, or whole datagrams of another device.
std::size_t add_foreign(const FaultLine& line, WireChannel channel, std::vector<WireEvent>& events,
                        SeededRandom& random) {
  constexpr std::size_t kNoiseBytes = 8, kLeastDatagram = 20, kMostDatagram = 1400;
  const bool is_noise = line.type == FaultType::LineNoise;
  const double rate = is_noise ? line.strength / kNoiseBytes : line.strength;
  const auto count = static_cast<std::size_t>(std::max<long long>(1, std::llround(rate * line.for_s)));
  for (std::size_t i = 0; i < count; ++i) {
    WireEvent event;
    event.channel = channel;
    event.at_ns = random.between(line.begin_ns(), line.end_ns() - 1);
    event.payload = random_bytes(
        is_noise ? kNoiseBytes : static_cast<std::size_t>(random.between(kLeastDatagram, kMostDatagram)), random);
    event.number = kNoUnit;
    events.push_back(std::move(event));
  }
  return is_noise ? count * kNoiseBytes : count;
}

std::size_t count_beyond_hour(const FaultLine& line, std::vector<WireEvent>& events) {
  constexpr std::uint32_t kHourUs = 3'600'000'000;
  std::size_t hits = 0;
  for (WireEvent& event : events) {
    const bool is_data = event.channel == WireChannel::LaserData;
    if ((!is_data && event.channel != WireChannel::LaserPosition) || !line.covers(event.at_ns)) continue;
    // Datagrams of a profile scanner are skipped: they have no counter that wraps with the hour.
    if (event.payload.size() != (is_data ? kLaserDataBytes : kLaserPositionBytes)) continue;
    const std::size_t at = is_data ? kLaserCounterAt : kStatusCounterAt;
    std::uint32_t counter = 0;
    for (std::size_t i = 0; i < 4; ++i) counter |= std::to_integer<std::uint32_t>(event.payload[at + i]) << (8 * i);
    if (counter >= std::llround(line.strength * 1e3)) continue;
    counter += kHourUs;
    for (std::size_t i = 0; i < 4; ++i) event.payload[at + i] = static_cast<std::byte>(counter >> (8 * i));
    ++hits;
  }
  return hits;
}

}  // namespace

std::size_t spoil_packets(const FaultLine& line, std::vector<WireEvent>& events, SeededRandom random) {
  const WireChannel channel = channel_of(line.target);
  FaultRule rule;
  rule.channel = channel;
  rule.begin_ns = line.begin_ns();
  rule.end_ns = line.end_ns();
  rule.probability = line.strength;
  std::size_t hits = 0;
  switch (line.type) {
    case FaultType::PacketLoss:
      rule.fault = WireFault::Drop;
      return apply_rule(events, rule, random);
    case FaultType::Outage:
      rule.fault = WireFault::Drop;
      rule.probability = 1;
      return apply_rule(events, rule, random);
    case FaultType::Duplicates:
      rule.fault = WireFault::Duplicate;
      rule.delay_ns = kDuplicateAfterNs;
      return apply_rule(events, rule, random);
    case FaultType::Corruption:
      rule.fault = WireFault::Corrupt;
      return apply_rule(events, rule, random);
    case FaultType::Truncation:
      rule.fault = WireFault::Truncate;
      return apply_rule(events, rule, random);
    case FaultType::BurstLoss:
      return lose_bursts(line, channel, events);
    case FaultType::Stall: {
      std::int64_t next = line.end_ns();
      hits =
          delay(line, channel, events, [&](const WireEvent& event) { return (next += kBacklogStepNs) - event.at_ns; });
      break;
    }
    case FaultType::Reorder:
      hits = delay(line, channel, events,
                   [&](const WireEvent&) { return random.between(0, std::llround(line.strength * 1e6)); });
      break;
    case FaultType::LateDelivery:
      hits = delay(line, channel, events, [&](const WireEvent&) { return std::llround(line.strength * 1e6); });
      break;
    case FaultType::LabelLate:
      for (WireEvent& event : events) {
        if (event.channel != WireChannel::Pos || event.log.id != static_cast<std::uint16_t>(NovatelId::Time) ||
            !line.covers(event.at_ns))
          continue;
        event.at_ns += std::llround(line.strength * 1e9);
        ++hits;
      }
      break;
    case FaultType::Fragments:
      for (WireEvent& event : events) {
        if (event.channel != channel || !line.covers(event.at_ns)) continue;
        event.piece_bytes = static_cast<std::uint32_t>(std::llround(line.strength));
        ++hits;
      }
      return hits;
    case FaultType::LineNoise:
    case FaultType::ForeignPackets:
      hits = add_foreign(line, channel, events, random);
      break;
    case FaultType::HourWrapLate:
      return count_beyond_hour(line, events);
    default:
      return 0;
  }
  sort_by_time(events);
  return hits;
}

std::int64_t host_clock_error_ns(const FaultLine& line, std::int64_t t) {
  if (t < line.begin_ns()) return 0;
  if (line.type == FaultType::HostClockStep) return std::llround(line.strength * 1e9);
  if (line.type != FaultType::HostClockDrift) return 0;
  const double span_ns = line.for_s * 1e9;
  const double since = static_cast<double>(t - line.begin_ns()), ramp = std::min(since, span_ns);
  return std::llround(line.strength * 1e-6 * (ramp * ramp / (2 * span_ns) + std::max(0.0, since - span_ns)));
}

std::size_t spoil_host_clock(const FaultLine& line, std::vector<WireEvent>& events) {
  if (line.type != FaultType::HostClockStep && line.type != FaultType::HostClockDrift) return 0;
  for (WireEvent& event : events) {
    event.at_ns += host_clock_error_ns(line, event.at_ns);
    if (event.channel == WireChannel::Pps) event.edge_ns += host_clock_error_ns(line, event.edge_ns);
  }
  return 1;
}

}  // namespace hueline::sim
