#include "sim/wire/faults.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "sim/wire/novatel_encode.hpp"
#include "sim/wire/seeded_random.hpp"

namespace hueline::sim {
namespace {

bool concerns(const FaultRule& rule, const WireEvent& event) {
  return event.channel == rule.channel && event.at_ns >= rule.begin_ns && event.at_ns < rule.end_ns &&
         (rule.log_id == 0 || event.log.id == rule.log_id);
}

/// Changes `count` different bytes, each to another value.
void corrupt(WireEvent& event, std::uint32_t count, SeededRandom& random) {
  const std::size_t size = event.payload.size();
  std::vector<std::size_t> places;
  while (places.size() < std::min<std::size_t>(count, size)) {
    const std::size_t place = static_cast<std::size_t>(random.next() % size);
    if (std::find(places.begin(), places.end(), place) != places.end()) continue;
    places.push_back(place);
    event.payload[place] ^= static_cast<std::byte>(random.between(1, 255));
  }
}

}  // namespace

std::size_t apply_rule(std::vector<WireEvent>& events, const FaultRule& rule, SeededRandom& random) {
  std::size_t hits = 0;
  std::uint64_t missed = 0;
  std::vector<WireEvent> out;
  out.reserve(events.size());
  for (WireEvent& event : events) {
    // Only edges and images carry a count of their own. Miss closes the gap in it.
    const bool is_counted = event.channel == WireChannel::Pps || event.channel == WireChannel::Camera;
    if (!concerns(rule, event) || random.uniform() >= rule.probability) {
      if (is_counted && event.channel == rule.channel) event.sequence -= missed;
      out.push_back(std::move(event));
      continue;
    }
    ++hits;
    switch (rule.fault) {
      case WireFault::Drop:
        break;
      case WireFault::Miss:
        ++missed;
        break;
      case WireFault::Duplicate: {
        WireEvent copy = event;
        copy.at_ns += rule.delay_ns;
        out.push_back(std::move(event));
        out.push_back(std::move(copy));
        break;
      }
      case WireFault::Corrupt:
        corrupt(event, rule.corrupt_bytes, random);
        out.push_back(std::move(event));
        break;
      case WireFault::Truncate:
        if (event.payload.size() > 1)
          event.payload.resize(
              static_cast<std::size_t>(random.between(1, static_cast<std::int64_t>(event.payload.size()) - 1)));
        out.push_back(std::move(event));
        break;
      case WireFault::Delay:
        event.at_ns += rule.delay_ns;
        out.push_back(std::move(event));
        break;
    }
  }
  std::stable_sort(out.begin(), out.end(), [](const WireEvent& a, const WireEvent& b) { return a.at_ns < b.at_ns; });
  events = std::move(out);
  return hits;
}

std::string FaultRule::validate() const {
  if (end_ns <= begin_ns) return fmt::format("end_ns: {} is not after begin_ns {}", end_ns, begin_ns);
  if (!(probability >= 0 && probability <= 1)) return fmt::format("probability: {} is not within 0 .. 1", probability);
  if (delay_ns < 0) return fmt::format("delay_ns: {} is negative", delay_ns);
  if (fault == WireFault::Delay && delay_ns == 0) return "delay_ns: a delay of 0 delays nothing";
  const bool has_payload = channel != WireChannel::Pps && channel != WireChannel::Camera;
  if ((fault == WireFault::Corrupt || fault == WireFault::Truncate) && !has_payload) {
    return fmt::format("channel: {} has no payload to damage", name(channel));
  }
  if (fault == WireFault::Corrupt && corrupt_bytes == 0) return "corrupt_bytes: at least 1";
  if (log_id != 0 && channel != WireChannel::Pos) return "log_id: only the channel Pos carries logs";
  return {};
}

Result<std::vector<std::size_t>> apply_faults(Timeline& timeline, const std::vector<FaultRule>& rules,
                                              std::uint64_t seed) {
  for (const FaultRule& rule : rules) {
    if (std::string problem = rule.validate(); !problem.empty()) return Error{ErrorCode::Invalid, std::move(problem)};
  }
  std::vector<std::size_t> hits;
  for (std::size_t i = 0; i < rules.size(); ++i) {
    SeededRandom random(seed, kStreamWireFault + i);
    hits.push_back(apply_rule(timeline.events, rules[i], random));
  }
  return hits;
}

}  // namespace hueline::sim
