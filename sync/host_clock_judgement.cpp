// What a HostClockModel concludes from its evidence: which second the pulses are, whether they can be trusted, and what
// replaces them.
#include <fmt/format.h>

#include <cstdlib>

#include "sync/host_clock_model.hpp"

namespace hueline::sync {

using std::chrono::seconds;

void HostClockModel::judge_label() {
  if (!filter_.is_started()) return;
  const SecondLabel::Decision decision = label_.decide(now_);
  for (const SecondLabel::Conflict& conflict : decision.conflicts)
    faults_.add(conflict.sensor, FaultKind::LabelConflict, "second", now_, conflict.detail);
  disputed_ = decision.disputed;
  if (!N_) {
    N_ = decision.N;
    return;
  }
  const bool contradicts = decision.N && *decision.N != *N_;
  if (contradicts && !contradicted_) contradicted_since_ = now_;
  if (contradicts)
    faults_.add(config_.pps, FaultKind::LabelConflict, "relabel", now_,
                fmt::format("the sources now say {} other than the label in use", describe_offset(*decision.N - *N_)));
  // Silence neither confirms nor contradicts.
  if (decision.N) contradicted_ = contradicts;
  if (contradicted_ && decision.N && now_ - contradicted_since_ >= config_.relabel_after) {
    ++counts_.relabels;
    faults_.add(
        config_.pps, FaultKind::ClockStep, "relabel", now_,
        fmt::format("all times before this were off by {}; the label is changed", describe_offset(*decision.N - *N_)));
    N_ = decision.N;
    contradicted_ = false;
  }
}

void HostClockModel::judge_state() {
  if (filter_.is_started()) {
    const nanoseconds age = now_ - filter_.last_edge();
    const double sigma = filter_.sigma_ns_at(now_);
    const bool fresh = age <= config_.holdover_after;
    const bool was_locked = state_ == SyncState::Locked || state_ == SyncState::Holdover;
    if (sigma > static_cast<double>(config_.holdover_limit.count()) && !fresh) {
      faults_.add(config_.pps, FaultKind::NoTime, "holdover", now_,
                  fmt::format("no pulse for {:.0f} s: holdover is given up", to_seconds(age)));
      filter_ = ClockFilter(config_.filter);
      finder_.reset();
      label_.reset();
      N_.reset();
      state_ = SyncState::Unlocked;
    } else if (!N_ || contradicted_ || disputed_) {
      state_ = SyncState::Acquiring;
    } else if (!fresh) {
      if (was_locked && state_ != SyncState::Holdover) {
        ++counts_.holdovers;
        faults_.add(config_.pps, FaultKind::Silent, "holdover", now_,
                    "no usable edge: the clock runs on its measured rate");
      }
      state_ = was_locked ? SyncState::Holdover : SyncState::Acquiring;
    } else if (sigma <= static_cast<double>(config_.lock_sigma.count()) && in_a_row_ >= config_.relock_edges) {
      state_ = SyncState::Locked;
    } else {
      // A single lost edge does not end Locked. After Holdover, several edges must fit first.
      if (!was_locked) state_ = SyncState::Acquiring;
      if (state_ == SyncState::Locked && sigma > static_cast<double>(config_.lock_sigma.count()))
        state_ = SyncState::Holdover;
    }
    // Pulses that arrive but have no label are a conflict to be solved. They are no reason to change to a poorer clock,
    // which would have the same label.
    if (fresh || state_ == SyncState::Holdover) usable_ = now_;
    if (state_ == SyncState::Locked || state_ == SyncState::Holdover) {
      fallback_ = false;
      return;
    }
  }
  enter_fallback();
}

void HostClockModel::enter_fallback() {
  const bool no_pulses = config_.pps == kSystemSensor || now_ - usable_ > config_.pps_patience;
  const bool settled = line_source_ && line_.pairs() >= 20 && line_.span() >= seconds(5);
  if (!(no_pulses && settled)) {
    if (!filter_.is_started() && !fallback_) state_ = SyncState::Unlocked;
    return;
  }
  if (!fallback_)
    faults_.add(
        config_.pps, FaultKind::NoTime, "fallback", now_,
        fmt::format(
            "no usable pulse per second: times come from the arrival of sensor {}'s messages, good to milliseconds",
            *line_source_));
  fallback_ = true;
  state_ = SyncState::Acquiring;
}

}  // namespace hueline::sync
