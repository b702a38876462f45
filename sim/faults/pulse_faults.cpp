// Faults of PPS edges and event marks.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "sim/faults/stages.hpp"
#include "sim/wire/novatel_encode.hpp"
#include "sim/wire/utc.hpp"

namespace hueline::sim {
namespace {

constexpr std::int64_t kMarkMessageNs = 20'000'000;  // from an additional mark to its message
constexpr std::int64_t kPulseReportNs = 20'000;      // from an additional edge to its report

std::int64_t ns_of(double value, double ns_per_unit) { return std::llround(value * ns_per_unit); }

/// Returns random times within the line's time, `strength` a second on average.
std::vector<std::int64_t> moments(const FaultLine& line, SeededRandom& random) {
  std::vector<std::int64_t> out(
      static_cast<std::size_t>(std::max<long long>(1, std::llround(line.strength * line.for_s))));
  for (std::int64_t& t : out) t = random.between(line.begin_ns(), line.end_ns() - 1);
  std::sort(out.begin(), out.end());
  return out;
}

WireEvent edge_at(std::int64_t edge_ns) {
  WireEvent event;
  event.channel = WireChannel::Pps;
  event.edge_ns = edge_ns;
  event.at_ns = edge_ns + kPulseReportNs;
  return event;
}

WireEvent mark_at(GpsNs gps_ns, std::int64_t at_ns) {
  WireEvent event;
  event.channel = WireChannel::Pos;
  event.at_ns = at_ns;
  event.payload = encode_mark1_time(novatel_header(gps_ns), mark_time_fields(gps_ns));
  event.log = peek_novatel(event.payload);
  return event;
}

/// Returns the time that an encoded MARK1TIME states.
GpsNs instant_of_mark(const Bytes& log) {
  const auto header = std::to_integer<std::size_t>(log[3]);
  std::uint32_t week = 0;
  double seconds = 0;
  std::memcpy(&week, log.data() + header, sizeof week);
  std::memcpy(&seconds, log.data() + header + 4, sizeof seconds);
  return static_cast<GpsNs>(week) * 604'800 * kNsPerSecond + std::llround(seconds * 1e9);
}

bool is(const WireEvent& event, NovatelId id) {
  return event.channel == WireChannel::Pos && event.log.id == static_cast<std::uint16_t>(id);
}

}  // namespace

std::size_t spoil_pulses(const FaultLine& line, std::vector<WireEvent>& events, SeededRandom random) {
  if (line.type != FaultType::PpsLoss && line.type != FaultType::PpsSpurious && line.type != FaultType::PpsWidth &&
      line.type != FaultType::PpsInverted && line.type != FaultType::PpsJitter && line.type != FaultType::PpsShift)
    return 0;
  std::size_t hits = 0;
  std::vector<WireEvent> extra;
  const auto is_lost = [&](WireEvent& event) {
    if (event.channel != WireChannel::Pps || !line.covers(event.edge_ns)) return false;
    std::int64_t move = 0;
    switch (line.type) {
      case FaultType::PpsLoss:
        if (random.uniform() >= line.strength) return false;
        ++hits;
        return true;
      case FaultType::PpsWidth:
        extra.push_back(edge_at(event.edge_ns + ns_of(line.strength, 1e6)));
        break;
      case FaultType::PpsInverted:
        move = ns_of(line.strength, 1e6);
        break;
      case FaultType::PpsJitter:
        move = random.between(0, ns_of(line.strength, 1e3));
        break;
      case FaultType::PpsShift:
        move = ns_of(line.strength, 1e3);
        break;
      default:
        return false;
    }
    ++hits;
    event.edge_ns += move;
    event.at_ns += move;
    return false;
  };
  std::erase_if(events, is_lost);
  if (line.type == FaultType::PpsSpurious)
    for (const std::int64_t t : moments(line, random)) extra.push_back(edge_at(t));
  if (line.type == FaultType::PpsSpurious) hits += extra.size();
  for (WireEvent& event : extra) events.push_back(std::move(event));
  sort_by_time(events);
  // The computer counts the edges that its input sees.
  std::uint64_t sequence = 0;
  for (WireEvent& event : events)
    if (event.channel == WireChannel::Pps) event.sequence = ++sequence;
  return hits;
}

std::size_t spoil_marks(const FaultLine& line, GpsNs begin_gps_ns, std::vector<WireEvent>& events,
                        SeededRandom random) {
  if (line.type != FaultType::MarkLoss && line.type != FaultType::MarkDouble && line.type != FaultType::MarkSpurious &&
      line.type != FaultType::MarkLate && line.type != FaultType::MarkShift)
    return 0;
  std::size_t hits = 0;
  bool was_lost = false;  // MARK1PVA is lost if the MARK1TIME before it was
  std::vector<WireEvent> extra;
  const auto is_lost = [&](WireEvent& event) {
    const bool is_time = is(event, NovatelId::Mark1Time);
    if ((!is_time && !is(event, NovatelId::Mark1Pva)) || !line.covers(event.at_ns)) return false;
    hits += is_time ? 1 : 0;
    switch (line.type) {
      case FaultType::MarkLoss:
        if (is_time) was_lost = random.uniform() < line.strength;
        hits -= is_time && !was_lost ? 1 : 0;
        return was_lost;
      case FaultType::MarkDouble:
        if (is_time)
          extra.push_back(mark_at(instant_of_mark(event.payload) + ns_of(line.strength, 1e3),
                                  event.at_ns + ns_of(line.strength, 1e3)));
        return false;
      case FaultType::MarkLate:
        event.at_ns += ns_of(line.strength, 1e6);
        return false;
      case FaultType::MarkShift:
        if (is_time) event = mark_at(instant_of_mark(event.payload) + ns_of(line.strength, 1e3), event.at_ns);
        return !is_time;
      default:
        return false;
    }
  };
  std::erase_if(events, is_lost);
  if (line.type == FaultType::MarkSpurious) {
    for (const std::int64_t t : moments(line, random)) extra.push_back(mark_at(begin_gps_ns + t, t + kMarkMessageNs));
    hits = extra.size();
  }
  for (WireEvent& event : extra) events.push_back(std::move(event));
  sort_by_time(events);
  return hits;
}

}  // namespace hueline::sim
