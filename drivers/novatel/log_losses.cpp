#include "drivers/novatel/log_losses.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/portable_math.hpp"

namespace hueline::drivers {
namespace {

constexpr std::size_t kMostDamage = 64;
constexpr std::uint64_t kManyInARow = 8;
constexpr double kByChance = 1e-6;  // a run of losses that is less likely than this had another cause

bool is_of_filter(const NovatelMessageInfo& info) {
  return info.use == NovatelUse::InsPva || info.use == NovatelUse::InsPvaX || info.use == NovatelUse::InsStdev;
}

}  // namespace

void LogLosses::take(const NovatelMessage& message, const NovatelMessageInfo* info, GpsTime time) {
  ++place_;
  if (info && info->stamp == NovatelStamp::Regular) {
    Log& log = logs_[std::uint32_t{message.header.antenna} << 16 | message.header.id];
    log.info = info;
    log.antenna = message.header.antenna;
    log.wire_bytes = message.wire_bytes;
    if (const auto gap = log.cycle.take(time, message.received)) {
      const std::uint64_t broken = came_broken(log, gap->missing);
      log.cycle.excuse(broken);
      if (broken == 0 && was_held_back(log, *gap)) {
        held_back_ = gap;
      } else {
        log.since_loss = 0;
        lost_of_all_ += gap->missing - broken;
      }
    }
    log.since_loss = std::min(log.since_loss + 1, kWhole);
    log.newest = place_;
    log.lost_until = lost_of_all_;
    settle(log);
  }
  seen_[next_seen_++ % seen_.size()] = {place_, time};
}

void LogLosses::skipped(std::uint64_t bytes, std::uint64_t messages) {
  damage_.push_back({place_, bytes, messages});
  if (damage_.size() > kMostDamage) damage_.pop_front();
}

std::uint64_t LogLosses::came_broken(const Log& log, std::uint64_t missing) {
  std::uint64_t broken = 0;
  for (Damage& damage : damage_) {
    if (damage.place < log.newest) continue;
    // A message that was cut short has left fewer bytes, and one whose first bytes were hit shows no beginning. So each
    // missing log uses up both.
    while (broken < missing && (damage.bytes > 0 || damage.messages > 0)) {
      damage.bytes -= std::min<std::uint64_t>(damage.bytes, log.wire_bytes);
      damage.messages -= std::min<std::uint64_t>(damage.messages, 1);
      ++broken;
    }
  }
  return broken;
}

/// Returns whether the receiver did not output the logs of the gap. That is so if many logs are missing in a row while
/// other messages came in both halves of the gap: a line that was good before does not lose so selectively. A line that
/// loses a third of all messages can do so by chance, above all those of a slow log.
bool LogLosses::was_held_back(const Log& log, const LogCycle::Gap& gap) const {
  if (gap.missing < kManyInARow || !is_of_filter(*log.info) || log.since_loss < kWhole) return false;
  const GpsTime middle = gap.before + (gap.after - gap.before) / 2;
  bool early = false, late = false;
  for (const Seen& seen : seen_) {
    if (seen.place <= log.newest || seen.time <= gap.before || seen.time >= gap.after) continue;
    (seen.time < middle ? early : late) = true;
  }
  if (!early || !late) return false;
  const auto others_lost = static_cast<double>(lost_of_all_ - log.lost_until);
  const auto others_came = static_cast<double>(place_ - 1 - log.newest);
  const double lost_share = others_lost / (others_lost + others_came);
  return portable::pow(lost_share, static_cast<double>(gap.missing)) < kByChance;
}

void LogLosses::settle(Log& log) {
  while (const auto gap = log.cycle.settled()) {
    // A slower log of the filter may have shown its gap before the faster one did.
    if (held_back_ && is_of_filter(*log.info) && gap->before < held_back_->after && gap->after > held_back_->before)
      continue;
    std::string name = log.info->name;
    if (log.antenna > 0) name += fmt::format("_{}", log.antenna);
    lost_[name] += gap->missing;
  }
}

void LogLosses::finish() {
  for (auto& [key, log] : logs_) {
    log.cycle.finish();
    settle(log);
  }
}

void LogLosses::forget() {
  finish();
  logs_.clear();
  damage_.clear();
  held_back_.reset();
}

std::optional<Fault> LogLosses::told(SensorId sensor, HostTime now, bool is_end) {
  if (lost_.empty()) return {};
  if (!is_end && told_at_ && now - *told_at_ < std::chrono::seconds(1) && now >= *told_at_) return {};
  told_at_ = now;
  std::uint64_t count = 0;
  std::string names;
  for (const auto& [name, missing] : lost_) {
    count += missing;
    names += fmt::format("{}{} {}", names.empty() ? "" : ", ", missing, name);
  }
  lost_.clear();
  return Fault{sensor, FaultKind::Lost, now, count,
               fmt::format("logs missing, by the period of their times: {}", names)};
}

}  // namespace hueline::drivers
