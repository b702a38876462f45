// Which mark is an image's: the decisions of ExposureMatcher, apart from its bookkeeping.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "sync/exposure_matcher.hpp"

namespace hueline::sync {
namespace {

constexpr double kGateSigmas = 6;
constexpr double kGateLimitNs = 2e7;  // however unsure the relation is: below any exposure interval

constexpr nanoseconds kClockSlack = std::chrono::milliseconds(1);
constexpr nanoseconds kLateDelivery = std::chrono::milliseconds(400);

double ns(nanoseconds d) { return static_cast<double>(d.count()); }
bool within(nanoseconds v, nanoseconds low, nanoseconds high) { return v >= low && v <= high; }

}  // namespace

void ExposureMatcher::time_without_mark(Pending& pending, std::vector<Exposure>& out) {
  if (!config_.counter_offset) {
    const auto line = line_.at(pending.counter);
    // The fastest delivery took latency_min from exposure start; the true value may be anywhere up to latency_max.
    const GpsTime start = gps_time_ns(pending.counter + line->delay_ns) - config_.latency_min;
    const double sigma = std::hypot(line->sigma_ns, ns(pending.arrival.sigma),
                                    ns(config_.latency_max - config_.latency_min) / std::sqrt(12.0));
    emit(pending, start - config_.strobe_delay, sigma, ExposureTiming::CameraClock, out);
    return;
  }
  const nanoseconds into_exposure = config_.stamp_event == StampEvent::ExposureStart ? nanoseconds(0)
                                    : config_.stamp_event == StampEvent::ExposureMid ? config_.exposure / 2
                                                                                     : config_.exposure;
  const GpsTime start = gps_time_ns(pending.counter) + *config_.counter_offset - config_.stamp_delay - into_exposure;
  const nanoseconds latency = pending.arrival.time - start, slack = 3 * pending.arrival.sigma + kClockSlack;
  // A clock off by a second or more cannot pass for a late delivery.
  if (!within(latency, config_.latency_min - slack, config_.latency_max + kLateDelivery)) {
    faults_.add(config_.camera, FaultKind::LabelConflict, "clock", pending.image.received,
                fmt::format("the camera's clock is {:.3f} s off the image's arrival: is counter_offset right?",
                            to_seconds(latency - config_.latency_min)));
    emit_unmatched(pending, "the camera's own clock contradicts the image's arrival", out);
    return;
  }
  emit(pending, start - config_.strobe_delay, ns(config_.relation.clock_sigma), ExposureTiming::CameraClock, out);
}

void ExposureMatcher::forget() {
  ++counts_.relearnt;
  relation_.reset();
  learner_.reset();
  missed_in_a_row_ = 0;
}

bool ExposureMatcher::is_too_early(GpsTime arrival, GpsTime mark, nanoseconds sigma) const {
  return arrival - mark - config_.strobe_delay < config_.latency_min - 3 * sigma;
}

bool ExposureMatcher::match_by_relation(Pending& pending, bool final, std::vector<Exposure>& out) {
  const CameraRelation::Prediction predicted = relation_.predict(pending.counter);
  const nanoseconds gate(static_cast<std::int64_t>(std::min(kGateSigmas * predicted.sigma_ns, kGateLimitNs)));
  std::vector<Mark*> near;
  for (Mark& m : marks_)
    if (!m.used && within(m.time - predicted.mark, -gate, gate)) near.push_back(&m);
  if (!near.empty()) {
    const nanoseconds spread = near.back()->time - near.front()->time;
    if (near.size() > 1 && spread > config_.bounce) {
      emit_unmatched(pending, fmt::format("{} event marks fit one image", near.size()), out);
      for (Mark* m : near) m->used = true;
      return true;
    }
    Mark& mark = *near.front();
    if (is_too_early(pending.arrival.time, mark.time, pending.arrival.sigma)) {
      // No image comes before it can: the relation is off by an interval.
      emit_unmatched(pending, "it came sooner after the mark that fits than an image can: the relation was wrong", out);
      forget();
      return true;
    }
    for (Mark* m : near) m->used = true;
    note_bounce(near.size() - 1, pending.image.received);
    relation_.add({pending.counter, mark.time});
    missed_in_a_row_ = 0;
    emit(pending, mark.time, std::hypot(ns(config_.mark_sigma), near.size() > 1 ? ns(spread) : 0.0),
         ExposureTiming::EventMark, out);
    return true;
  }
  // Marks come in order: one after the gate proves that this one will not come.
  const bool passed = !marks_.empty() && marks_.back().time > predicted.mark + gate;
  if (!final && !passed && now_ < predicted.mark + gate + config_.mark_latency_max) return false;
  ++counts_.lost_marks;
  faults_.add(config_.camera, FaultKind::Lost, "mark", pending.image.received,
              "no event mark where the camera's clock expects one: timed by the camera's clock");
  emit(pending, predicted.mark, std::hypot(predicted.sigma_ns, ns(config_.mark_sigma)), ExposureTiming::CameraClock,
       out);
  const bool others = std::any_of(marks_.begin(), marks_.end(), [&](const Mark& m) {
    return !m.used && within(m.time - predicted.mark, -config_.latency_max, config_.latency_max);
  });
  missed_in_a_row_ = others ? missed_in_a_row_ + 1 : 0;
  if (missed_in_a_row_ >= config_.relearn_after) {
    faults_.add(config_.camera, FaultKind::ClockStep, "relation", pending.image.received,
                "event marks no longer fit the camera's clock: learnt anew");
    forget();
  }
  return true;
}

bool ExposureMatcher::match_by_arrival(Pending& pending, bool final, std::vector<Exposure>& out) {
  const GpsTime latest = pending.arrival.time - config_.strobe_delay - config_.latency_min;
  const bool complete = (!marks_.empty() && marks_.back().time > latest) || now_ >= latest + config_.mark_latency_max;
  if (!complete && !final) return false;
  std::vector<Mark*> possible;
  for (Mark& m : marks_)
    if (within(pending.arrival.time - m.time - config_.strobe_delay, config_.latency_min, config_.latency_max))
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
       std::hypot(ns(config_.mark_sigma), ns(possible.back()->time - possible.front()->time)),
       ExposureTiming::EventMark, out);
  return true;
}

}  // namespace hueline::sync
