#include "runtime/late_pulses.hpp"

#include <algorithm>
#include <limits>

namespace hueline::runtime {
namespace {

constexpr std::int64_t kOneSecond_ns = 1'000'000'000, kMostDelay_ns = kOneSecond_ns * 3 / 4;

}  // namespace

void LatePulses::on_arrival(const TimedArrival& arrival, const sync::HostClockModel& clock) {
  if (clock.state() == SyncState::Locked) {
    const auto stamp = clock.stamp(arrival.received);
    if (stamp && clock.has_fresh_pulse()) by_clock_.add((stamp->time - arrival.time + 3 * stamp->sigma).count());
  } else if (last_edge_) {
    const std::int64_t since = (arrival.received - *last_edge_).count() - count_ns(arrival.time) % kOneSecond_ns;
    const std::int64_t delay = (since % kOneSecond_ns + kOneSecond_ns) % kOneSecond_ns;
    by_pulse_.add(delay > kMostDelay_ns ? delay - kOneSecond_ns : delay);
  }
}

void LatePulses::roll() {
  by_clock_.roll();
  by_pulse_.roll();
}

std::optional<LatePulses::Found> LatePulses::judge(bool was_locked) const {
  // An inverted PPS is always late by the same, but a computer that is too busy gets its messages late by this and by
  // that.
  constexpr std::int64_t kSteady_ns = 100'000'000, kEarly_ns = 500'000, kEarlyByPulse_ns = 2'000'000;
  if (by_clock_.are_known()) {
    const auto [shortest, longest] = std::ranges::minmax_element(by_clock_.least);
    if (*shortest < -kEarly_ns) return Found{nanoseconds(-*shortest)};
    if (*shortest > kMostDelay_ns && *longest - *shortest < kSteady_ns)
      return Found{nanoseconds(kOneSecond_ns - *shortest)};
  } else if (!was_locked && by_pulse_.are_known()) {
    // The most in each half second, so that a single wrong edge does not count.
    const std::int64_t least = *std::ranges::max_element(by_pulse_.least);
    if (least < -kEarlyByPulse_ns) return Found{nanoseconds(-least), false};
  }
  return {};
}

void LatePulses::Delays::add(std::int64_t delay_ns) {
  least[0] = std::min(least[0], delay_ns);
  ++counts[0];
}

void LatePulses::Delays::roll() {
  std::rotate(least.begin(), least.end() - 1, least.end());
  std::rotate(counts.begin(), counts.end() - 1, counts.end());
  least[0] = std::numeric_limits<std::int64_t>::max();
  counts[0] = 0;
}

bool LatePulses::Delays::are_known() const {
  return std::ranges::all_of(counts, [](int count) { return count > 0; });
}

}  // namespace hueline::runtime
