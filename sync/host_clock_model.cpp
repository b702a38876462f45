#include "sync/host_clock_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/calendar.hpp"
#include "core/portable_math.hpp"

namespace hueline::sync {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

// A step of the host's clock, as messages show it. It is larger than usual changes of latency, and equals the step of
// the pulses within some milliseconds.
constexpr std::size_t kRecentDelays = 20;
constexpr double kLeastStep_s = 0.05, kStepFits_s = 0.02;

}  // namespace

void HostClockModel::Config::visit(Keys& keys) {
  keys.duration({"edge_delay_us", "us", "The mean time from the pulse's edge to its time stamp. It is subtracted."},
                edge_delay, {-1000, 10'000});
}

KeyError HostClockModel::Config::validate() const {
  if (KeyError wrong = check_keys(*this); !wrong.empty()) return wrong;
  if (std::string e = filter.validate(); !e.empty()) return {"", "filter: " + e};
  if (std::string e = label.validate(); !e.empty()) return {"", "label: " + e};
  if (std::string e = arrivals.validate(); !e.empty()) return {"", "arrivals: " + e};
  if (acquire_edges < 3 || acquire_edges > 16) return {"acquire_edges", "must be 3 to 16"};
  if (relock_edges < 1 || relock_edges > 60) return {"relock_edges", "must be 1 to 60"};
  if (reacquire_edges < 4 || reacquire_edges > 16) return {"reacquire_edges", "must be 4 to 16"};
  if (lock_sigma <= nanoseconds(0)) return {"lock_sigma", "must be positive"};
  if (holdover_after < milliseconds(1100) || holdover_after > seconds(60))
    return {"holdover_after", "must be 1.1 s to 60 s"};
  if (holdover_limit <= lock_sigma || holdover_limit > milliseconds(50))
    return {"holdover_limit", "must be above lock_sigma and at most 50 ms"};
  if (relabel_after < seconds(1) || relabel_after > seconds(600)) return {"relabel_after", "must be 1 s to 600 s"};
  if (pps_patience < seconds(1) || pps_patience > seconds(3600)) return {"pps_patience", "must be 1 s to 3600 s"};
  if (arrival_latency < nanoseconds(0) || arrival_latency > seconds(1)) return {"arrival_latency", "must be 0 to 1 s"};
  if (arrival_latency_sigma <= nanoseconds(0) || arrival_latency_sigma > seconds(1))
    return {"arrival_latency_sigma", "must be above 0 and at most 1 s"};
  return {};
}

HostClockModel::HostClockModel(Config config)
    : config_(config),
      filter_(config.filter),
      finder_(config.acquire_edges, config.filter.rate_limit_ppm * 1e-6),
      label_(config.label),
      line_(config.arrivals) {}

void HostClockModel::advance(HostTime now) {
  if (!began_) {
    began_ = true;
    begin_ = usable_ = now_ = now;
  }
  now_ = std::max(now_, now);
  // Judging takes some time. Ten times a second of stream time is enough, because nothing changes faster.
  if (now_ < next_judgement_) return;
  next_judgement_ = now_ + milliseconds(100);
  judge_label();
  judge_state();
}

void HostClockModel::add(const PpsEdge& pps) {
  if (pps.sensor != config_.pps || config_.pps == kSystemSensor) return;
  ++counts_.edges;
  // The decoder reports edges that the source counted and did not deliver.
  if (last_sequence_ && pps.sequence > *last_sequence_) told_missing_ += pps.sequence - *last_sequence_ - 1;
  last_sequence_ = pps.sequence;
  const HostTime edge = pps.edge - config_.edge_delay;
  if (!filter_.is_started()) {
    if (const auto edges = finder_.add(edge); !edges.empty())
      start(edges);
    else if (finder_.is_ambiguous())
      faults_.add(pps.sensor, FaultKind::Spurious, "phase", pps.edge,
                  "edges come at more than one phase of the second; is the input set to one pulse a second?");
    advance(edge);
    return;
  }
  const ClockFilter::Innovation innovation = filter_.examine(edge);
  if (innovation.fits && innovation.pulse > last_pulse_) {
    if (innovation.pulse > last_pulse_ + 1) {
      const auto gap = static_cast<std::uint64_t>(innovation.pulse - last_pulse_ - 1);
      counts_.missing += gap;
      if (gap > told_missing_)
        faults_.add(pps.sensor, FaultKind::Lost, "pulse", pps.edge, "no usable edge at these seconds",
                    gap - told_missing_);
    }
    in_a_row_ = innovation.pulse == last_pulse_ + 1 ? in_a_row_ + 1 : 1;
    last_pulse_ = innovation.pulse;
    told_missing_ = 0;
    filter_.update(edge, innovation);
    finder_.reset();
    ++counts_.accepted;
    if (recent_delays_s_.size() == kRecentDelays)
      usual_delay_s_ = *std::min_element(recent_delays_s_.begin(), recent_delays_s_.end());
  } else {
    const bool doubled = innovation.fits && innovation.pulse == last_pulse_;
    ++(doubled ? counts_.doubled : counts_.refused);
    filter_.notice(innovation);
    faults_.add(
        pps.sensor, FaultKind::Spurious, doubled ? "doubled" : "edge", pps.edge,
        doubled ? std::string("second edge for one pulse")
                : fmt::format("edge {:.1f} us off its second, expected within {:.1f} us", -innovation.error_ns * 1e-3,
                              config_.filter.gate_sigmas * innovation.sigma_ns * 1e-3));
    const double off_s = -innovation.error_ns * 1e-9;
    // Late deliveries do not delay all messages by exactly the error of the pulses, and a fault of the pulses does not
    // move messages.
    const double moved_s = arrivals_moved_s();
    if (!doubled && std::abs(moved_s) > kLeastStep_s && std::abs(std::remainder(moved_s - off_s, 1.0)) < kStepFits_s) {
      restart(edge,
              fmt::format("pulses and messages moved together by {:.3f} s: the computer's clock stepped", moved_s));
      recent_delays_s_.clear();
      usual_delay_s_.reset();
      line_.reset();
      start(std::vector{edge});
      next_judgement_ = edge;
      return advance(edge);
    }
    if (const auto edges = finder_.add(edge); static_cast<int>(edges.size()) >= config_.reacquire_edges) {
      restart(edge, fmt::format("the pulses come at a new phase, {:.6f} s from the old", -innovation.error_ns * 1e-9));
      start(edges);
    }
  }
  next_judgement_ = edge;
  advance(edge);
}

void HostClockModel::start(const std::vector<HostTime>& edges) {
  in_a_row_ = filter_.start(edges);
  last_pulse_ = filter_.last_pulse();
  counts_.accepted += static_cast<std::uint64_t>(in_a_row_);
  finder_.reset();
  label_.reset();
  N_.reset();
  contradicted_ = false;
}

void HostClockModel::restart(HostTime now, const std::string& why) {
  ++counts_.restarts;
  faults_.add(config_.pps, FaultKind::ClockStep, "restart", now, why + "; times start anew");
  state_ = SyncState::Unlocked;
  N_.reset();
}

void HostClockModel::add(const TimeLabel& label) {
  ++counts_.labels;
  if (!label.is_valid) {
    ++counts_.invalid_labels;
    advance(label.received);
    return;
  }
  add_utc_offset(label);
  compare_with_arrivals(label.sensor, label.second, label.received);
  // A single label changes nothing, but it is reported at once.
  if (state_ == SyncState::Locked && has_fresh_pulse())
    if (const auto now = stamp(label.received)) {
      const nanoseconds late = now->time - label.second;
      if (late < -config_.label.early_tolerance || late > seconds(config_.label.late_seconds + 1))
        faults_.add(label.sensor, FaultKind::LabelConflict, "label", label.received,
                    fmt::format("sensor {} names a second that is {} from the clock in use", label.sensor,
                                describe_offset(std::llround(-to_seconds(late)))));
    }
  if (filter_.is_started())
    label_.add(label.sensor, SecondLabel::Evidence::Label, label.second, label.received,
               filter_.pulse_ns_at(label.received));
  advance(label.received);
}

void HostClockModel::add_utc_offset(const TimeLabel& label) {
  if (!label.utc_offset) return;
  const seconds table = utc_offset_from_table(label.second);
  // The table cannot contain future leap seconds. A receiver whose offset is below the table's has not read the almanac
  // yet.
  if (*label.utc_offset == table || *label.utc_offset == table + seconds(1)) {
    reported_utc_offset_ = label.utc_offset;
    return;
  }
  faults_.add(label.sensor, FaultKind::LabelConflict, "utc", label.received,
              fmt::format("sensor {} says GPS - UTC = {} s; {} s is used", label.sensor, label.utc_offset->count(),
                          table.count()));
}

void HostClockModel::add(const TimedArrival& arrival) {
  ++counts_.arrivals;
  if (filter_.is_started())
    label_.add(arrival.sensor, SecondLabel::Evidence::Arrival, arrival.time, arrival.received,
               filter_.pulse_ns_at(arrival.received));
  const SensorId trusted = config_.label.trusted;
  if (!line_source_ || (trusted != kSystemSensor && arrival.sensor == trusted && *line_source_ != trusted)) {
    line_source_ = arrival.sensor;
    line_.reset();
  }
  if (arrival.sensor == *line_source_) watch_arrival(arrival);
  if (arrival.sensor == *line_source_ && arrival.time >= config_.label.not_before)
    line_.add(count_ns(arrival.time), count_ns(arrival.received));
  compare_with_arrivals(arrival.sensor, arrival.time, arrival.received);
  advance(arrival.received);
}

void HostClockModel::watch_arrival(const TimedArrival& arrival) {
  if (!N_ || !filter_.is_started()) return;
  recent_delays_s_.push_back(
      to_seconds(gps_time_ns(filter_.pulse_ns_at(arrival.received)) + seconds(*N_) - arrival.time));
  if (recent_delays_s_.size() > kRecentDelays) recent_delays_s_.pop_front();
}

/// Returns how much later (earlier if negative) the fastest of the newest messages are than when the last edge fitted.
double HostClockModel::arrivals_moved_s() const {
  if (recent_delays_s_.size() < kRecentDelays || !usual_delay_s_) return 0;
  return *std::min_element(recent_delays_s_.begin(), recent_delays_s_.end()) - *usual_delay_s_;
}

void HostClockModel::compare_with_arrivals(SensorId sensor, GpsTime time, HostTime received) {
  if (!fallback_ || sensor == *line_source_) return;
  const std::int64_t difference = (time - stamp_from_arrivals(received)->time).count();
  // A late message is usual. A message from the future, or later than any message can be, has another clock.
  if (difference <= 500'000'000 && difference >= -1'000'000'000ll * (config_.label.late_seconds + 1)) return;
  disputed_until_ = received + config_.relabel_after;
  faults_.add(sensor, FaultKind::LabelConflict, "arrival", received,
              fmt::format("sensor {} differs from sensor {} by {}", sensor, *line_source_,
                          describe_offset(std::llround(static_cast<double>(difference) * 1e-9))));
}

std::optional<GpsStamp> HostClockModel::stamp_from_arrivals(HostTime t) const {
  const auto event = line_.event_of(count_ns(t));
  if (!event) return {};
  const double sigma =
      portable::hypot(line_.at(*event)->sigma_ns, static_cast<double>(config_.arrival_latency_sigma.count()));
  return GpsStamp{gps_time_ns(*event) + config_.arrival_latency,
                  nanoseconds(static_cast<std::int64_t>(std::ceil(sigma))), SyncState::Acquiring};
}

bool HostClockModel::can_stamp() const {
  return state_ == SyncState::Locked || state_ == SyncState::Holdover ||
         (state_ == SyncState::Acquiring && fallback_ &&
          !(now_ < disputed_until_ && config_.label.trusted == kSystemSensor));
}

const char* HostClockModel::why_not() const {
  if (can_stamp()) return "";
  if (fallback_ || is_disputed()) return "the sources disagree about the second";
  if (config_.pps == kSystemSensor)
    return counts_.arrivals == 0 ? "no message with a good GPS time came, and the rig has no pulse per second"
                                 : "messages with a good GPS time came for too short to learn the clock";
  if (filter_.is_started()) {
    if (N_)
      return has_scattered_pulses() ? "the pulses scatter too much to learn the clock in so short a time"
                                    : "the pulses came for too short to learn the clock";
    return counts_.labels == counts_.invalid_labels && counts_.arrivals == 0
               ? "pulses came, but no message with a good GPS time"
               : "the second of the pulses was not settled";
  }
  if (counts_.edges > 0)
    return counts_.edges < static_cast<std::uint64_t>(config_.acquire_edges)
               ? "too few pulses came to learn the clock"
               : "the pulses that came do not lie whole seconds apart";
  return counts_.arrivals == 0 ? "neither a pulse nor a message with a good GPS time came"
                               : "no pulse came, and messages with a good GPS time for too short to do without";
}

bool HostClockModel::has_scattered_pulses() const {
  return std::sqrt(filter_.instability().jitter_ns2) > static_cast<double>(config_.lock_sigma.count());
}

std::optional<GpsStamp> HostClockModel::stamp(HostTime t) const {
  if (state_ == SyncState::Unlocked) return {};
  if (fallback_) return stamp_from_arrivals(t);
  if (!N_ || !filter_.is_started()) return {};
  return GpsStamp{gps_time_ns(filter_.pulse_ns_at(t)) + seconds(*N_),
                  nanoseconds(static_cast<std::int64_t>(std::ceil(filter_.sigma_ns_at(t)))), state_};
}

seconds HostClockModel::utc_offset(GpsTime t) const {
  const seconds table = utc_offset_from_table(t);
  return reported_utc_offset_ ? std::max(*reported_utc_offset_, table) : table;
}

}  // namespace hueline::sync
