// The decisions of ExposureMatcher: which mark belongs to which image. The bookkeeping is in exposure_matcher.cpp.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/portable_math.hpp"
#include "sync/exposure_matcher.hpp"

namespace hueline::sync {
namespace {

constexpr double kGateSigmas = 6;
constexpr double kGateLimitNs = 2e7;  // limit for an unsure relation, below any exposure interval

constexpr nanoseconds kFitsAgain = std::chrono::microseconds(50);
constexpr std::size_t kLatencies = 32;

constexpr nanoseconds kClockSlack = std::chrono::milliseconds(1);
constexpr nanoseconds kLateDelivery = std::chrono::milliseconds(400);

}  // namespace

void ExposureMatcher::time_without_mark(Pending& pending, std::vector<Exposure>& out) {
  if (!config_.counter_offset) {
    const auto line = line_.at(pending.counter);
    // The fastest delivery took latency_min from the start of the exposure. The true value may be anywhere up to
    // latency_max.
    const GpsTime start = gps_time_ns(pending.counter + line->delay_ns) - config_.latency_min;
    const double sigma = portable::hypot(line->sigma_ns, to_nanoseconds(pending.arrival.sigma),
                                         to_nanoseconds(config_.latency_max - config_.latency_min) / std::sqrt(12.0));
    emit(pending, start - config_.strobe_delay, sigma, ExposureTiming::CameraClock, out);
    return;
  }
  const GpsTime start = gps_time_ns(pending.counter) + *config_.counter_offset - config_.stamp_delay;
  const nanoseconds latency = pending.arrival.time - start, slack = 3 * pending.arrival.sigma + kClockSlack;
  // A clock that is off by a second or more cannot be mistaken for a late delivery.
  if (!is_within(latency, config_.latency_min - slack, config_.latency_max + kLateDelivery)) {
    faults_.add(config_.camera, FaultKind::LabelConflict, "clock", pending.image.received,
                fmt::format("the camera's clock is {:.3f} s off the image's arrival: is counter_offset right?",
                            to_seconds(latency - config_.latency_min)));
    emit_unmatched(pending, "the camera's own clock contradicts the image's arrival", out);
    return;
  }
  emit(pending, start - config_.strobe_delay, to_nanoseconds(config_.relation.clock_sigma), ExposureTiming::CameraClock,
       out);
}

/// `was_right`: the relation fitted for a long time, and then no longer.
void ExposureMatcher::forget(bool was_right) {
  ++counts_.relearnt;
  if (was_right && !trusted_ && !latencies_.empty()) {
    trusted_ = relation_;
    trusted_latency_ = *std::min_element(latencies_.begin(), latencies_.end());
  }
  if (!was_right) trusted_.reset();
  latencies_.clear();
  relation_.reset();
  learner_.reset();
  missed_in_a_row_ = 0;
}

/// Decides, after the relation was learnt again, whether the camera's clock stepped or the marks moved. The latency of
/// images against true marks does not change.
void ExposureMatcher::compare_with_trusted() {
  doubt_ = nanoseconds(0);
  if (!trusted_ || pending_.empty()) return;
  const std::int64_t counter = pending_.back().counter;
  const CameraRelation::Prediction before = trusted_->predict(counter), now = relation_.predict(counter);
  const nanoseconds moved = now.mark - before.mark;
  if (std::abs(to_nanoseconds(moved)) <=
      kGateSigmas * portable::hypot(before.sigma_ns, now.sigma_ns) + to_nanoseconds(kFitsAgain)) {
    trusted_.reset();
    return;
  }
  std::vector<nanoseconds> latencies;
  for (const Pending& p : pending_) latencies.push_back(p.arrival.time - relation_.predict(p.counter).mark);
  std::sort(latencies.begin(), latencies.end());
  const double resolution = 2 * to_nanoseconds(latencies[latencies.size() / 2] - latencies.front()) /
                            std::sqrt(static_cast<double>(latencies.size()));
  const double changed = std::abs(to_nanoseconds(latencies.front() - trusted_latency_));
  const bool can_tell = std::abs(to_nanoseconds(moved)) > 2 * resolution;
  if (can_tell && changed < std::abs(to_nanoseconds(moved)) / 2) {
    trusted_.reset();  // the clock stepped; the marks are unchanged
    return;
  }
  doubt_ = std::chrono::abs(moved);
  faults_.add(
      config_.camera, FaultKind::NoTime, "doubt", received_,
      fmt::format("event marks and the camera's clock differ by {:.6f} s from before; {}: sigma grown",
                  to_seconds(moved), can_tell ? "the marks have moved" : "which of them has moved cannot be told"));
}

/// Returns whether there is a mark that no other image expects, that is nearer to the prediction than half an interval,
/// and that the arrival allows.
bool ExposureMatcher::has_rival(const Pending& pending, GpsTime predicted, nanoseconds gate) const {
  const GpsTime last_mark =
      last_out_ ? *last_out_ - config_.strobe_delay - last_duration_ / 2 : predicted - config_.latency_max;
  const nanoseconds reach = std::max(nanoseconds(0), predicted - last_mark) / 2;
  return std::any_of(marks_.begin(), marks_.end(), [&](const Mark& m) {
    const bool is_near = !m.used && is_within(m.time - predicted, -reach, reach);
    const nanoseconds latency = pending.arrival.time - m.time - config_.strobe_delay;
    if (!is_near || !is_within(latency, config_.latency_min - 3 * pending.arrival.sigma, config_.latency_max))
      return false;
    return std::none_of(pending_.begin(), pending_.end(), [&](const Pending& other) {
      return &other != &pending && is_within(m.time - relation_.predict(other.counter).mark, -gate, gate);
    });
  });
}

bool ExposureMatcher::is_too_early(GpsTime arrival, GpsTime mark, nanoseconds sigma) const {
  return arrival - mark - config_.strobe_delay < config_.latency_min - 3 * sigma;
}

bool ExposureMatcher::match_by_relation(Pending& pending, bool final, std::vector<Exposure>& out) {
  const CameraRelation::Prediction predicted = relation_.predict(pending.counter);
  const nanoseconds gate(static_cast<std::int64_t>(std::min(kGateSigmas * predicted.sigma_ns, kGateLimitNs)));
  std::vector<Mark*> near;
  for (Mark& m : marks_)
    if (!m.used && is_within(m.time - predicted.mark, -gate, gate)) near.push_back(&m);
  if (!near.empty()) {
    const nanoseconds spread = near.back()->time - near.front()->time;
    if (near.size() > 1 && spread > config_.bounce) {
      emit_unmatched(pending, fmt::format("{} event marks fit one image", near.size()), out);
      for (Mark* m : near) m->used = true;
      return true;
    }
    Mark& mark = *near.front();
    if (is_too_early(pending.arrival.time, mark.time, pending.arrival.sigma)) {
      // An image cannot arrive so early, so the relation is off by an interval.
      emit_unmatched(pending, "it came sooner after the mark that fits than an image can: the relation was wrong", out);
      forget(false);
      return true;
    }
    for (Mark* m : near) m->used = true;
    note_bounce(near.size() - 1, pending.image.received);
    relation_.add({pending.counter, mark.time});
    missed_in_a_row_ = 0;
    latencies_.push_back(pending.arrival.time - mark.time);
    if (latencies_.size() > kLatencies) latencies_.pop_front();
    emit(pending, mark.time,
         portable::hypot(to_nanoseconds(config_.mark_sigma), near.size() > 1 ? to_nanoseconds(spread) : 0.0,
                         to_nanoseconds(doubt_)),
         ExposureTiming::EventMark, out);
    return true;
  }
  if (is_too_early(pending.arrival.time, predicted.mark, pending.arrival.sigma)) {
    emit_unmatched(pending, "the camera's clock leads to a time at which the image had already arrived: it has stepped",
                   out);
    if (++missed_in_a_row_ >= config_.relearn_after) {
      faults_.add(config_.camera, FaultKind::ClockStep, "relation", pending.image.received,
                  "event marks no longer fit the camera's clock: learnt anew");
      forget(true);
    }
    return true;
  }
  // Marks come in order, so a mark after the gate proves that this one will not come.
  const bool passed = !marks_.empty() && marks_.back().time > predicted.mark + gate;
  if (!final && !passed && now_ < predicted.mark + gate + config_.mark_latency_max) return false;
  const bool has_rival_mark = has_rival(pending, predicted.mark, gate);
  if (has_rival_mark) {
    emit_unmatched(pending,
                   "an event mark beside, not at, the time that the camera's clock expects: one of them is wrong", out);
  } else {
    ++counts_.lost_marks;
    faults_.add(config_.camera, FaultKind::Lost, "mark", pending.image.received,
                "no event mark where the camera's clock expects one: timed by the camera's clock");
    emit(pending, predicted.mark,
         portable::hypot(predicted.sigma_ns, to_nanoseconds(config_.mark_sigma), to_nanoseconds(doubt_)),
         ExposureTiming::CameraClock, out);
  }
  const bool others = std::any_of(marks_.begin(), marks_.end(), [&](const Mark& m) {
    return !m.used && is_within(m.time - predicted.mark, -config_.latency_max, config_.latency_max);
  });
  missed_in_a_row_ = others ? missed_in_a_row_ + 1 : 0;
  if (missed_in_a_row_ >= config_.relearn_after) {
    faults_.add(config_.camera, FaultKind::ClockStep, "relation", pending.image.received,
                "event marks no longer fit the camera's clock: learnt anew");
    forget(true);
  }
  return true;
}

bool ExposureMatcher::match_by_arrival(Pending& pending, bool final, std::vector<Exposure>& out) {
  const GpsTime latest = pending.arrival.time - config_.strobe_delay - config_.latency_min;
  const bool complete = (!marks_.empty() && marks_.back().time > latest) || now_ >= latest + config_.mark_latency_max;
  if (!complete && !final) return false;
  std::vector<Mark*> possible;
  for (Mark& m : marks_)
    if (is_within(pending.arrival.time - m.time - config_.strobe_delay, config_.latency_min, config_.latency_max))
      possible.push_back(&m);
  const bool bounced = !possible.empty() && possible.back()->time - possible.front()->time <= config_.bounce;
  if (possible.empty() || !bounced || possible.front()->used) {
    emit_unmatched(pending,
                   possible.empty() ? "no event mark within the image's latency"
                                    : "more than one event mark, or one already taken, within the image's latency",
                   out);
    return true;
  }
  for (Mark* m : possible) m->used = true;
  note_bounce(possible.size() - 1, pending.image.received);
  emit(pending, possible.front()->time,
       portable::hypot(to_nanoseconds(config_.mark_sigma),
                       to_nanoseconds(possible.back()->time - possible.front()->time)),
       ExposureTiming::EventMark, out);
  return true;
}

}  // namespace hueline::sync
