#include "sync/exposure_matcher.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/portable_math.hpp"

namespace hueline::sync {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr std::uint64_t kReorder = 8;  // frame numbers; a larger fall is a restart
constexpr seconds kUnattributed{30};   // an unused mark without a later image is reported after this

}  // namespace

void ExposureMatcher::Config::visit(Keys& keys) {
  // Receivers of the OEM7 family have four event inputs.
  keys.whole(required("event_input", "", "The POS's event input that the camera's strobe is wired to. 0: none."),
             mark_input, {0, 4});
  keys.duration({"strobe_delay_us", "us", "The time from the strobe's active edge to the start of the exposure."},
                strobe_delay, {-1e6, 1e6});
  keys.duration({"mark_sigma_us", "us",
                 "One standard deviation of the receiver's time stamp and of the strobe's jitter together."},
                mark_sigma, {0.01, 1e4});
  keys.flag({"has_counter", "", "Whether the camera's own time stamp is meaningful. It must be with `event_input: 0`."},
            has_counter);
  keys.duration({"counter_wraps_s", "s", "The period of the camera's time stamp.", "0: never"}, counter_wraps,
                {0, 1e6});
  keys.duration({"counter_offset_s", "s",
                 "GPS time minus the camera's time stamp, for a camera whose clock PPS or PTP disciplines (PTP's TAI: "
                 "-315964819). Only with `event_input: 0`.",
                 "none"},
                counter_offset, {-2e9, 2e9}, true);
  keys.choice(
      {"stamp_event", "",
       "The event that the camera's time stamp names. It is used with `counter_offset_s`, and if the camera reports "
       "exposures that change; otherwise it is learnt."},
      stamp_event,
      {{"exposure_start", StampEvent::ExposureStart},
       {"exposure_mid", StampEvent::ExposureMid},
       {"exposure_end", StampEvent::ExposureEnd}});
  keys.duration(
      {"stamp_delay_us", "us", "The time from that event to the time stamp. It is used with `counter_offset_s` only."},
      stamp_delay, {-1e6, 1e6});
  keys.duration(
      {"stamp_sigma_us", "us",
       "One standard deviation of the camera's time stamp. That of a computer's clock when an image had come, "
       "as in recordings of ROS, is thousands."},
      relation.clock_sigma, {0.01, 1e6});
  keys.duration(
      {"latency_min_ms", "ms", "The smallest time from the start of the exposure to the arrival of the whole image."},
      latency_min, {0, 5000});
  keys.duration({"latency_max_ms", "ms",
                 "The largest time from the start of the exposure to the arrival of the whole image, above "
                 "`latency_min_ms`. Keep it below the time between two exposures."},
                latency_max, {0.1, 5000});
}

KeyError ExposureMatcher::Config::validate() const {
  if (KeyError wrong = check_keys(*this); !wrong.empty()) return wrong;
  if (!is_within(exposure, nanoseconds(0), seconds(1))) return {"exposure", "must be 0 to 1 s"};
  if (latency_max <= latency_min)
    return not_allowed("latency_max_ms", number_text(to_seconds(latency_max) * 1e3), "more than latency_min_ms");
  if (!is_within(mark_latency_max, milliseconds(1), seconds(5))) return {"mark_latency_max", "must be 1 ms to 5 s"};
  if (!is_within(bounce, nanoseconds(0), milliseconds(100))) return {"bounce", "must be 0 to 100 ms"};
  if (learn_images < 2 || learn_images > 64) return {"learn_images", "must be 2 to 64"};
  if (!is_within(learn_tolerance, std::chrono::microseconds(1), milliseconds(50)))
    return {"learn_tolerance", "must be 1 us to 50 ms"};
  if (relearn_after < 2 || relearn_after > 100) return {"relearn_after", "must be 2 to 100"};
  if (pending_limit < 1 || pending_limit > 1000) return {"pending_limit", "must be 1 to 1000"};
  if (mark_limit < 16 || mark_limit > 100'000) return {"mark_limit", "must be 16 to 100000"};
  if (!is_within(patience, milliseconds(100), seconds(60))) return {"patience", "must be 100 ms to 60 s"};
  if (std::string e = relation.validate(); !e.empty()) return {"", "relation: " + e};
  if (mark_input == 0 && !has_counter)
    return {"has_counter", "is false; allowed: true where event_input is 0, for nothing else tells the time"};
  if (counter_offset && (mark_input != 0 || counter_wraps != nanoseconds(0)))
    return {
        "counter_offset_s",
        "is for a camera whose own clock tells GPS time; allowed: only where event_input and counter_wraps_s are 0"};
  return {};
}

ExposureMatcher::ExposureMatcher(Config config)
    : config_(config),
      relation_(config.relation),
      learner_({config.latency_min + config.strobe_delay, config.latency_max + config.strobe_delay,
                config.learn_tolerance, config.learn_images}),
      line_(ArrivalLine::Config{}) {}

bool ExposureMatcher::accept(const Image& image, std::int64_t& counter) {
  const std::int64_t raw = count_ns(image.time), wraps = config_.counter_wraps.count();
  std::int64_t step = raw - last_raw_;
  if (wraps > 0 && last_frame_) {
    step %= wraps;
    if (step < -wraps / 2) step += wraps;
    if (step > wraps / 2) step -= wraps;
  }
  counter = last_frame_ ? last_counter_ + step : raw;
  return !(last_frame_ && image.frame_id == *last_frame_ && (step == 0 || !config_.has_counter));
}

/// Returns how long an image was exposed: as the camera reports of its parts, else as the rig says.
ExposureMatcher::Length ExposureMatcher::length_of(const Image& image) const {
  Length length;
  nanoseconds sum{0};
  std::int64_t told = 0;
  for (const ReportedExposure& part : image.reported) {
    if (part.duration <= nanoseconds(0)) continue;
    sum += part.duration;
    ++told;
    length.longest = std::max(length.longest, part.duration);
  }
  if (told == 0) return {config_.exposure, config_.exposure, false};
  length.mean = sum / told;
  length.is_reported = true;
  return length;
}

/// Returns how long after the start of an exposure the event is that the camera's stamp names.
nanoseconds ExposureMatcher::into_exposure(const Length& length) const {
  if (config_.stamp_event == StampEvent::ExposureStart) return nanoseconds(0);
  if (config_.stamp_event == StampEvent::ExposureMid) return length.mean / 2;
  return length.longest;  // parts that begin together end with the longest
}

void ExposureMatcher::restart(const Image& image, const char* why, std::vector<Exposure>& out) {
  ++counts_.restarts;
  faults_.add(config_.camera, FaultKind::ClockStep, "restart", image.received,
              fmt::format("{}: the camera restarted; its clock is learnt anew", why));
  work(true, out);  // pending images belong to the old relation
  relation_.reset();
  line_.reset();
  learner_.reset();
  latencies_.clear();
  trusted_.reset();
  doubt_ = nanoseconds(0);
  unexplained_frames_ = 0;
  missed_in_a_row_ = 0;
}

void ExposureMatcher::add(Image image, const GpsStamp& arrival, std::vector<Exposure>& out) {
  ++counts_.images;
  received_ = std::max(received_, image.received);
  std::int64_t counter = 0;
  if (!accept(image, counter)) {
    ++counts_.repeated_images;
    faults_.add(config_.camera, FaultKind::Spurious, "repeat", image.received, "the same image was delivered again");
    return;
  }
  bool older = false;
  if (last_frame_) {
    const std::int64_t step = counter - last_counter_;
    const bool back = image.frame_id < *last_frame_;
    if (back && *last_frame_ - image.frame_id <= kReorder &&
        (!config_.has_counter || (step < 0 && step > -5'000'000'000)))
      older = true;
    else if (back || (config_.has_counter && step < 0)) {
      restart(image, back ? "frame number fell" : "counter fell", out);
      counter = count_ns(image.time);
    } else if (image.frame_id > *last_frame_ + 1) {
      const std::uint64_t gap = image.frame_id - *last_frame_ - 1;
      counts_.lost_images += gap;  // the decoder reports them
      unexplained_frames_ += gap;
    }
  }
  const Length length = length_of(image);
  const std::int64_t at_start = counter - into_exposure(length).count();
  Pending pending{std::move(image), arrival, at_start, length};
  if (older) {
    // The image was delivered out of order. It still gets its place if no later image has been given its time.
    if (unexplained_frames_ > 0) --unexplained_frames_;
    auto place = std::find_if(pending_.begin(), pending_.end(),
                              [&](const Pending& p) { return p.image.frame_id > pending.image.frame_id; });
    if (place == pending_.begin()) {
      ++counts_.late_images;
      faults_.add(config_.camera, FaultKind::Late, "image", pending.image.received,
                  "image came after a later one had been given its time: not used");
      return;
    }
    pending_.insert(place, std::move(pending));
  } else {
    last_frame_ = pending.image.frame_id;
    last_raw_ = count_ns(pending.image.time);
    last_counter_ = counter;
    learner_.add(at_start, arrival.time);
    if (config_.mark_input == 0) line_.add(at_start, count_ns(arrival.time));
    pending_.push_back(std::move(pending));
  }
  now_ = std::max(now_, arrival.time);
  work(false, out);
}

void ExposureMatcher::add(const EventMark& mark, std::vector<Exposure>& out) {
  if (mark.input != config_.mark_input || config_.mark_input == 0) return;
  ++counts_.marks;
  received_ = std::max(received_, mark.received);
  if (!mark.is_valid) {
    faults_.add(mark.sensor, FaultKind::NoTime, "mark", mark.received,
                "event mark without a valid receiver time: not used");
    return;
  }
  auto place = marks_.end();
  while (place != marks_.begin() && std::prev(place)->time > mark.time) --place;
  if (place != marks_.begin() && std::prev(place)->time == mark.time) {
    ++counts_.bounced_marks;
    faults_.add(mark.sensor, FaultKind::Spurious, "repeat", mark.received, "the same event mark came again");
    return;
  }
  marks_.insert(place, {mark.time, mark.received, false});
  work(false, out);
}

void ExposureMatcher::advance(GpsTime now, HostTime received, std::vector<Exposure>& out) {
  now_ = std::max(now_, now);
  received_ = std::max(received_, received);
  if (!pending_.empty() || !marks_.empty()) work(false, out);
}

void ExposureMatcher::flush(std::vector<Exposure>& out) {
  work(true, out);
  now_ += config_.latency_max + config_.mark_latency_max + config_.patience + kUnattributed + seconds(2);
  expire_marks();
  faults_.flush();
}

GpsTime ExposureMatcher::guess(const Pending& pending) const {
  return pending.arrival.time - (config_.latency_min + config_.latency_max) / 2;
}

GpsTime ExposureMatcher::watermark(GpsTime now) const {
  GpsTime earliest = now - config_.latency_max;
  for (const Pending& p : pending_) earliest = std::min(earliest, p.arrival.time - config_.latency_max);
  if (!pending_.empty() && relation_.is_known())
    earliest = std::min(earliest, relation_.predict(pending_.front().counter).mark);
  earliest += std::min(nanoseconds(0), config_.strobe_delay);
  return last_out_ ? std::max(earliest, *last_out_) : earliest;
}

void ExposureMatcher::learn(bool final) {
  if (config_.mark_input == 0 || !config_.has_counter || relation_.is_known() || pending_.empty()) return;
  std::vector<GpsTime> marks;
  for (const Mark& m : marks_) marks.push_back(m.time);
  // With a slow camera or a short drive, a few images must be enough; otherwise the first images would be given up.
  const auto pairs = learner_.learn(marks, final || now_ - pending_.front().arrival.time > config_.patience);
  if (pairs.empty()) return;
  relation_.start(pairs);
  compare_with_trusted();
}

void ExposureMatcher::work(bool final, std::vector<Exposure>& out) {
  learn(final);
  while (!pending_.empty()) {
    Pending& front = pending_.front();
    const bool full = pending_.size() > config_.pending_limit;
    bool done = false;
    if (config_.mark_input == 0) {
      time_without_mark(front, out);
      done = true;
    } else if (relation_.is_known()) {
      done = match_by_relation(front, final || full, out);
    } else if (!config_.has_counter) {
      done = match_by_arrival(front, final || full, out);
    } else if (final || full || now_ - front.arrival.time > config_.patience) {
      emit_unmatched(front,
                     "no relation between the camera's counter and the event marks could be learnt; check the strobe "
                     "wire, mark_input and the image latency",
                     out);
      done = true;
    }
    if (!done) break;
    pending_.pop_front();
  }
  expire_marks();
}

void ExposureMatcher::note_bounce(std::size_t extra, HostTime at) {
  if (extra == 0) return;
  counts_.bounced_marks += extra;
  faults_.add(config_.camera, FaultKind::Spurious, "bounce", at,
              "the strobe gave more than one event mark for one image: the first was taken", extra);
}

void ExposureMatcher::emit(Pending& pending, GpsTime mark, double sigma_ns, ExposureTiming timing,
                           std::vector<Exposure>& out) {
  if (config_.must_report && !pending.length.is_reported) {
    emit_unmatched(pending, "the camera chooses its exposures and does not report this one", out);
    return;
  }
  const GpsTime mid = mark + config_.strobe_delay + pending.length.mean / 2;
  if (last_out_ && mid <= *last_out_) {
    emit_unmatched(pending, "its time is not after the image before it", out);
    return;
  }
  ++(timing == ExposureTiming::EventMark ? counts_.by_mark : counts_.by_camera_clock);
  last_out_ = mid;
  last_duration_ = pending.length.mean;
  SyncState state = doubt_ > nanoseconds(0) ? SyncState::Acquiring : SyncState::Locked;
  if (timing == ExposureTiming::CameraClock)
    state = config_.mark_input != 0  ? SyncState::Holdover
            : config_.counter_offset ? SyncState::Locked
                                     : SyncState::Acquiring;
  out.push_back({pending.image.sensor, 0, mid, nanoseconds(static_cast<std::int64_t>(std::ceil(sigma_ns))), state,
                 timing, std::move(pending.image), pending.length.mean});
}

void ExposureMatcher::emit_unmatched(Pending& pending, const std::string& why, std::vector<Exposure>& out) {
  ++counts_.unmatched;
  faults_.add(config_.camera, FaultKind::NoTime, "unmatched", pending.image.received,
              why + ": recorded, not used for colour");
  // The time only gives the exposure a place in the order; its sigma says how good it is.
  GpsTime mid = guess(pending);
  if (last_out_) mid = std::max(mid, *last_out_ + nanoseconds(1));
  last_out_ = mid;
  last_duration_ = pending.length.mean;
  const double sigma = portable::hypot(to_nanoseconds(config_.latency_max - config_.latency_min),
                                       std::abs(to_nanoseconds(mid - guess(pending))));
  out.push_back({pending.image.sensor, 0, mid, nanoseconds(static_cast<std::int64_t>(std::ceil(sigma))),
                 SyncState::Unlocked, ExposureTiming::Unmatched, std::move(pending.image), pending.length.mean});
}

void ExposureMatcher::expire_marks() {
  // A mark may be needed by an image that is delivered at latency_max, or that waits for the relation.
  GpsTime keep = now_ - config_.latency_max - config_.mark_latency_max - seconds(1);
  if (!relation_.is_known()) keep -= config_.patience;
  for (const Pending& p : pending_) keep = std::min(keep, guess(p) - config_.latency_max);
  // Whether a mark belongs to a lost image is known only when the next image has arrived.
  if (last_out_)
    keep = std::min(keep, std::max(*last_out_ - config_.strobe_delay - last_duration_, now_ - kUnattributed));
  while (!marks_.empty() && (marks_.front().time < keep || marks_.size() > config_.mark_limit)) {
    const Mark& mark = marks_.front();
    if (!mark.used && (relation_.is_known() || !config_.has_counter || counts_.images > 0)) {
      if (unexplained_frames_ > 0) {
        --unexplained_frames_;
        ++counts_.marks_of_lost_images;
      } else {
        ++counts_.spurious_marks;
        faults_.add(config_.camera, FaultKind::Spurious, "mark", mark.received, "event mark to which no image belongs");
      }
    }
    marks_.pop_front();
  }
}

}  // namespace hueline::sync
