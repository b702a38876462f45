#include "sync/self_timed_laser.hpp"

#include <algorithm>
#include <utility>

namespace hueline::sync {

void SelfTimedLaser::add(const TimeLabel& label, const HostClockModel& leaps, std::vector<StampedLaserBatch>& out) {
  if (!label.is_valid) return;
  if (label.second < config_.not_before) {
    saw_rollover_ = true;
    faults_.add(
        config_.sensor, FaultKind::LabelConflict, "rollover", label.received,
        "the scanner's receiver names a date before any possible drive: its week number has rolled over; not used");
    return;
  }
  if (labels_.add(label.second, label.received))
    faults_.add(config_.sensor, FaultKind::LabelConflict, "hour", label.received,
                "the scanner's receiver names another hour than before, and stays with it");
  if (labels_.is_settled()) release(leaps, out);
}

void SelfTimedLaser::add(const LaserStatus& status, const HostClockModel& leaps, std::vector<StampedLaserBatch>& out) {
  was_locked_ |= status.clock == SyncState::Locked;
  take(status, leaps, out);
}

void SelfTimedLaser::process(LaserBatch batch, const HostClockModel& leaps, std::vector<StampedLaserBatch>& out) {
  take(std::move(batch), leaps, out);
}

void SelfTimedLaser::take(Held&& item, const HostClockModel& leaps, std::vector<StampedLaserBatch>& out) {
  auto* batch = std::get_if<LaserBatch>(&item);
  if (batch)
    if (const auto* counter = std::get_if<LaserCounter>(&batch->time)) labels_.set_period(counter->period);
  if (labels_.is_settled() || (gave_up_ && !batch)) {
    if (batch)
      stamp(std::move(*batch), leaps, out);
    else
      discipline_.add(std::move(std::get<LaserStatus>(item)));
    return;
  }
  if (gave_up_) return refuse_without_label(*batch);
  if (batch) held_returns_ += batch->returns.size();
  held_.push_back(std::move(item));
  if (held_returns_ > config_.hold_returns) give_up(leaps, out);
}

void SelfTimedLaser::advance(HostTime now, const HostClockModel& leaps, std::vector<StampedLaserBatch>& out) {
  if (!held_.empty() && now - std::visit([](const auto& m) { return m.received; }, held_.front()) > config_.hold)
    give_up(leaps, out);
}

/// Labels come once a second. If too few came in this time, waiting longer would only push out what came before.
void SelfTimedLaser::give_up(const HostClockModel& leaps, std::vector<StampedLaserBatch>& out) {
  gave_up_ = true;
  labels_.settle();
  release(leaps, out);
}

void SelfTimedLaser::release(const HostClockModel& leaps, std::vector<StampedLaserBatch>& out) {
  // Batches before the first status are judged by it; statuses come many times a second.
  if (!discipline_.has_status())
    for (const Held& item : held_)
      if (const auto* status = std::get_if<LaserStatus>(&item)) {
        LaserStatus first = *status;
        first.received = std::visit([](const auto& m) { return m.received; }, held_.front());
        discipline_.add(std::move(first));
        break;
      }
  for (Held& item : held_) {
    if (auto* batch = std::get_if<LaserBatch>(&item)) {
      if (labels_.is_settled())
        stamp(std::move(*batch), leaps, out);
      else
        refuse_without_label(*batch);
    } else {
      discipline_.add(std::move(std::get<LaserStatus>(item)));
    }
  }
  held_.clear();
  held_returns_ = 0;
}

void SelfTimedLaser::refuse(const LaserBatch& batch, std::uint64_t& counter, const char* topic, const char* why) {
  counter += batch.returns.size();
  faults_.add(config_.sensor, FaultKind::NoTime, topic, batch.received, why);
}

void SelfTimedLaser::refuse_without_label(const LaserBatch& batch) {
  if (!was_locked_)
    refuse(batch, counts_.never_locked, "never locked",
           "read from a file, and the scanner never said that its PPS is locked: its packets have no time in common "
           "with the POS");
  else
    refuse(batch, counts_.no_label, "no hour",
           saw_rollover_ ? "the scanner has PPS, but its receiver names an impossible date: its packets have no time"
                         : "the scanner has PPS, but no valid GPRMC (or label) of its receiver named date and hour: "
                           "its packets have no time");
}

void SelfTimedLaser::stamp(LaserBatch&& batch, const HostClockModel& leaps, std::vector<StampedLaserBatch>& out) {
  const GpsTime near = *labels_.near(batch.received);
  const auto instant = instant_of(batch.time, near, leaps.utc_offset(near));
  if (!instant) return refuse_without_label(batch);
  const GpsTime time = *instant;
  if (std::chrono::abs(time - near) > config_.astray)
    return refuse(batch, counts_.astray, "astray", "packets whose counter leaps by seconds: not used");
  // The file has the packets in the order of their sending, so the newest status holds for a while in both directions.
  const auto trust = discipline_.trust(time, discipline_.is_locked(batch.received), config_.holdover_limit);
  state_ = trust ? trust->state : SyncState::Unlocked;
  if (!trust && !discipline_.was_held())
    return refuse(batch, counts_.never_locked, "never locked",
                  "read from a file, and the scanner does not say that its PPS is locked: its packets have no time in "
                  "common with the POS");
  if (!trust)
    return refuse(batch, counts_.lost_lock, "lost pulse",
                  "the scanner lost its PPS for longer than its own crystal is good: its packets have no time");
  if (state_ == SyncState::Holdover)
    faults_.add(config_.sensor, FaultKind::NoTime, "crystal", batch.received,
                "the scanner does not claim PPS: its packets are stamped by its own crystal, sigma grows");
  newest_ = newest_ ? std::max(*newest_, time) : time;
  out.push_back({batch.sensor, batch.packet_sequence, time, trust->sigma, state_, std::move(batch.returns)});
}

void SelfTimedLaser::flush(const HostClockModel& leaps, std::vector<StampedLaserBatch>& out) {
  labels_.settle();
  release(leaps, out);
  faults_.flush();
}

}  // namespace hueline::sync
