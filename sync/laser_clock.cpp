#include "sync/laser_clock.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/portable_math.hpp"
#include "sync/labelled_time.hpp"

namespace hueline::sync {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

nanoseconds sigma_of(double a, double b, double c = 0) {
  return nanoseconds(static_cast<std::int64_t>(std::ceil(portable::hypot(a, b, c))));
}

}  // namespace

std::string LaserClock::Config::validate() const {
  if (std::string e = discipline.validate(); !e.empty()) return e;
  if (early < nanoseconds(0) || early > milliseconds(100)) return "early must be 0 to 100 ms";
  if (latency_max < milliseconds(1) || latency_max > milliseconds(400)) return "latency_max must be 1 to 400 ms";
  if (latency_min < nanoseconds(0) || latency_min > latency_max) return "latency_min must be 0 to latency_max";
  if (latency_min_sigma <= nanoseconds(0)) return "latency_min_sigma must be positive";
  if (confirm < milliseconds(100) || confirm > seconds(10)) return "confirm must be 100 ms to 10 s";
  if (pending_limit < 16 || pending_limit > 1'000'000) return "pending_limit must be 16 to 1000000";
  return arrivals.validate();
}

void LaserClock::add(const LaserStatus& status) {
  if (status.clock == SyncState::Locked && !discipline_.claims_lock())
    untrusted_ = false;  // it synchronised again, so it is judged again
  discipline_.add(status);
}

bool LaserClock::is_disciplined(HostTime at) const { return discipline_.is_locked(at) && !untrusted_; }

/// Returns the stamp as a count that continues over the periods of a counter. Arrivals are compared with it.
std::int64_t LaserClock::unwrap(const LaserTime& time) {
  const auto value_ns = [](const LaserTime& stamp) {
    if (const auto* counter = std::get_if<LaserCounter>(&stamp)) return counter->value.count();
    if (const auto* gps = std::get_if<GpsTime>(&stamp)) return count_ns(*gps);
    return count_ns(std::get<UnixTime>(stamp));
  };
  const auto* counter = std::get_if<LaserCounter>(&time);
  const bool goes_on = last_stamp_ && last_stamp_->index() == time.index() &&
                       (!counter || counter->is_same_clock(std::get<LaserCounter>(*last_stamp_)));
  if (goes_on) {
    const std::int64_t step = value_ns(time) - value_ns(*last_stamp_);
    if (counter && step < -counter->period.count() / 2)
      periods_ns_ += counter->period.count();
    else if (counter && step > counter->period.count() / 2)
      periods_ns_ -= counter->period.count();
    else if (step < -100'000'000)
      line_.reset();  // its reference set it back, or it restarted: the relation is another
  } else {
    line_.reset();
    periods_ns_ = 0;
  }
  last_stamp_ = time;
  return periods_ns_ + value_ns(time);
}

void LaserClock::process(LaserBatch batch, const HostClockModel& host, std::vector<StampedLaserBatch>& out) {
  const auto arrival = host.stamp(batch.received);
  if (!arrival) {  // the caller checks can_stamp() first
    counts_.returns_without_clock += batch.returns.size();
    return;
  }
  ++counts_.batches;
  const std::int64_t unwrapped = unwrap(batch.time);
  // A locked counter of its own origin is right below the second. judge() finds the seconds.
  const GpsTime nominal =
      instant_of(batch.time, arrival->time, host.utc_offset(arrival->time)).value_or(gps_time_ns(unwrapped));
  line_.add(unwrapped, count_ns(arrival->time));
  Seen seen{std::move(batch), *arrival, nominal, unwrapped};
  host_doubtful_ = host.is_doubtful();

  if (untrusted_) judge_anew(seen);
  if (!is_disciplined(seen.batch.received)) {
    judge(out);
    emit(std::move(seen), out);
    return;
  }
  if (fits(seen)) {
    // The batches held before were late, or were a passing error; emit() distinguishes the two.
    for (Seen& held : pending_) emit(std::move(held), out);
    pending_.clear();
    pending_returns_ = 0;
    emit(std::move(seen), out);
    return;
  }
  ++counts_.held;
  pending_returns_ += seen.batch.returns.size();
  pending_.push_back(std::move(seen));
  if (pending_.back().batch.received - pending_.front().batch.received >= config_.confirm ||
      pending_.size() >= config_.pending_limit || pending_returns_ >= config_.pending_returns)
    judge(out);
}

bool LaserClock::fits(const Seen& seen) const { return seconds_behind(seen) == seconds(0); }

/// Returns the whole seconds that are missing from a stamp; nothing if its error is not of whole seconds.
std::optional<seconds> LaserClock::seconds_behind(const Seen& seen) const {
  const nanoseconds slack = config_.early + 3 * seen.arrival.sigma;
  const seconds whole = std::chrono::floor<seconds>(residual(seen) + slack);
  if (residual(seen) - whole > config_.latency_max) return {};
  return whole;
}

/// A scanner whose phase was wrong is trusted again after it has claimed lock and agreed with the host long enough, if
/// need be but for whole seconds: a reference that is set during the drive may count from another instant then.
void LaserClock::judge_anew(const Seen& seen) {
  const std::optional<seconds> behind = seconds_behind(seen);
  if (!discipline_.claims_lock() || !behind) {
    agrees_since_.reset();
    return;
  }
  if (!agrees_since_ || agrees_since_->behind != *behind) agrees_since_ = Agreement{seen.batch.received, *behind};
  if (seen.batch.received - agrees_since_->received < 2 * config_.confirm) return;
  agrees_since_.reset();
  untrusted_ = false;
  correction_ += *behind;
  faults_.add(config_.sensor, FaultKind::LabelConflict, "phase", seen.batch.received,
              *behind == seconds(0) ? std::string("the scanner agrees with the host clock again: stamped by its PPS")
                                    : fmt::format("the scanner agrees with the host clock again but for whole seconds: "
                                                  "they are {} behind the host's; corrected",
                                                  describe_offset(correction_.count())));
}

void LaserClock::judge(std::vector<StampedLaserBatch>& out) {
  if (pending_.empty()) return;
  nanoseconds smallest = residual(pending_.front()), sigma = pending_.front().arrival.sigma;
  for (const Seen& seen : pending_) {
    smallest = std::min(smallest, residual(seen));
    sigma = std::max(sigma, seen.arrival.sigma);
  }
  const nanoseconds slack = config_.early + 3 * sigma;
  const std::int64_t whole = std::chrono::floor<seconds>(smallest + slack).count();
  const nanoseconds rest = smallest - seconds(whole);
  const Seen& last = pending_.back();
  const bool long_enough = last.batch.received - pending_.front().batch.received >= config_.confirm;
  if (rest <= config_.latency_max && long_enough && whole != 0) {
    correction_ += seconds(whole);
    faults_.add(config_.sensor, FaultKind::LabelConflict, "second", last.batch.received,
                correction_ == seconds(0)
                    ? std::string("the scanner's seconds are right again")
                    : fmt::format("the scanner's seconds are {} behind the host's; corrected. Check its NMEA input",
                                  describe_offset(correction_.count())));
  } else if (rest > config_.latency_max && long_enough) {
    untrusted_ = true;
    faults_.add(
        config_.sensor, FaultKind::LabelConflict, "phase", last.batch.received,
        fmt::format("the scanner claims PPS lock but is {:.3f} s from the host clock: stamped by arrival instead",
                    to_seconds(smallest)));
  }
  for (Seen& held : pending_) emit(std::move(held), out);
  pending_.clear();
  pending_returns_ = 0;
}

void LaserClock::emit(Seen&& seen, std::vector<StampedLaserBatch>& out) {
  const bool disciplined = is_disciplined(seen.batch.received);
  const GpsTime time = seen.nominal + correction_;
  const nanoseconds slack = config_.early + 3 * seen.arrival.sigma;
  const nanoseconds age = seen.arrival.time - time;
  // A late packet continues the counter of the packets before it. A packet whose counter fell behind them is a passing
  // error of the scanner.
  const bool continues = last_time_ && time > *last_time_ - config_.latency_max;
  const bool possible = age >= -slack && (age <= config_.latency_max || (continues && age < seconds(30)));
  // The scanner's crystal is the better clock until its drift exceeds the uncertainty of arrivals.
  auto trust = untrusted_ || !possible ? std::nullopt : discipline_.trust(time, disciplined, config_.latency_min_sigma);
  if (!trust) {
    if (disciplined && !possible)
      faults_.add(config_.sensor, FaultKind::LabelConflict, "passing", seen.batch.received,
                  "packets whose counter left the host's time and came back: stamped by arrival");
    emit_by_arrival(std::move(seen), !disciplined || possible, out);
    return;
  }
  if (trust->state == SyncState::Locked) {
    ++counts_.disciplined;
    if (seen.arrival.state == SyncState::Acquiring) trust->state = SyncState::Acquiring;
  } else {
    ++counts_.holdover;
    faults_.add(config_.sensor, FaultKind::NoTime, "crystal", seen.batch.received,
                "the scanner does not claim PPS: its packets are stamped by its own crystal, sigma grows");
  }
  if (correction_ != seconds(0)) ++counts_.corrected;
  last_time_ = time;
  out.push_back(
      {seen.batch.sensor, seen.batch.packet_sequence, time, trust->sigma, trust->state, std::move(seen.batch.returns)});
}

void LaserClock::emit_by_arrival(Seen&& seen, bool by_line, std::vector<StampedLaserBatch>& out) {
  ++counts_.by_arrival;
  faults_.add(
      config_.sensor, FaultKind::NoTime, "arrival", seen.batch.received,
      "the scanner's clock is not held by PPS: its packets are stamped by their arrival, good to a millisecond");
  // If the counter is wrong, there is only the single arrival. If the packet was late after all, the arrival is wrong
  // by its lateness.
  const nanoseconds age = seen.arrival.time - (seen.nominal + correction_);
  // If the host's clock is in doubt too, either of the two may be wrong.
  const nanoseconds disputed = untrusted_ && host_doubtful_ ? std::chrono::abs(age) : nanoseconds(0);
  const nanoseconds doubt =
      age > nanoseconds(0) && age < seconds(30) ? std::max(age, config_.latency_max) : config_.latency_max;
  const auto line = by_line ? line_.at(seen.counter) : std::nullopt;
  const std::int64_t arrival_ns = line ? seen.counter + line->delay_ns : count_ns(seen.arrival.time);
  const GpsTime time = std::min(gps_time_ns(arrival_ns), seen.arrival.time) - config_.latency_min;
  const nanoseconds sigma = sigma_of(
      to_nanoseconds(config_.latency_min_sigma),
      line ? portable::hypot(line->sigma_ns, to_nanoseconds(disputed)) : to_nanoseconds(std::max(doubt, disputed)),
      to_nanoseconds(seen.arrival.sigma));
  out.push_back({seen.batch.sensor, seen.batch.packet_sequence, time, sigma, SyncState::Acquiring,
                 std::move(seen.batch.returns)});
}

void LaserClock::flush(std::vector<StampedLaserBatch>& out) {
  judge(out);
  faults_.flush();
}

std::optional<GpsTime> LaserClock::earliest_held() const {
  if (pending_.empty()) return {};
  GpsTime earliest = pending_.front().arrival.time;
  for (const Seen& seen : pending_) {
    const GpsTime time = seen.nominal + correction_;
    if (seen.arrival.time - time < seconds(30)) earliest = std::min(earliest, time);
  }
  return earliest - config_.latency_max;
}

}  // namespace hueline::sync
