#include "sync/synchroniser.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <utility>

#include "core/calendar.hpp"

namespace hueline::sync {
namespace {

using std::chrono::seconds;

HostTime received_of(const auto& m) { return m.received; }
HostTime received_of(const PpsEdge& m) { return m.edge; }
HostTime received_of(const InsUncertainty&) { return HostTime{}; }
HostTime received_of(const Fault& m) { return m.time; }

constexpr seconds kFarBehind{60};  // of files that are read in the order of their times
/// Returns the memory that a held item needs. It counts the returns and not the capacity that their vector happens to
/// have, so a replay decides in the same way.
template <class Item>
std::size_t bytes_of(const Item& item) {
  if (const auto* batch = std::get_if<LaserBatch>(&item))
    return sizeof(Item) + batch->returns.size() * sizeof(LaserReturn);
  return sizeof(Item);
}

bool listed(const std::vector<SensorId>& list, SensorId sensor) {
  return list.empty() || std::find(list.begin(), list.end(), sensor) != list.end();
}

}  // namespace

void Synchroniser::Config::visit(Keys& keys) {
  keys.duration({"hold_s", "s", "How long data wait for the first lock of the clocks."}, hold, {1, 600});
  std::size_t megabytes = hold_bytes / 1'000'000;
  if (keys.whole({"hold_mb", "MB",
                  "The memory for laser returns that wait for the first lock, 32 bytes each. Returns beyond it are "
                  "recorded, but get no time."},
                 megabytes, {1, 1'000'000}))
    hold_bytes = megabytes * 1'000'000;
  keys.whole({"hold_images", "images",
              "How many images wait for the first lock, the newest ones. Older images are recorded, but not fused."},
             hold_images, {1, 1000});
  keys.whole({"agreeing_labels", "messages", "How many messages must agree on the second of a pulse."},
             clock.label.agreeing, {1, 1000});
  int year = to_utc(clock.label.not_before).year;
  if (keys.whole({"not_before_year", "year", "An earlier date is treated as a rollover of the GPS week number."}, year,
                 {1980, 2100}))
    clock.label.not_before = *from_utc({year, 1, 7, 0, 0, 0, 0});
}

KeyError Synchroniser::Config::validate() const {
  if (KeyError wrong = check_keys(*this); !wrong.empty()) return wrong;
  if (KeyError e = clock.validate(); !e.empty()) return e.inside("clock");
  std::vector<SensorId> ids;
  for (const LaserClock::Config& l : lasers) {
    if (std::string e = l.validate(); !e.empty()) return {"", fmt::format("laser {}: {}", l.sensor, e)};
    ids.push_back(l.sensor);
  }
  for (const ExposureMatcher::Config& c : cameras) {
    if (std::string e = c.validate(); !e.empty()) return {"", fmt::format("camera {}: {}", c.camera, e)};
    ids.push_back(c.camera);
  }
  for (const WheelOdometer::Config& w : wheels) {
    if (std::string e = w.validate(); !e.empty()) return {"", fmt::format("wheel {}: {}", w.sensor, e)};
    ids.push_back(w.sensor);
  }
  std::sort(ids.begin(), ids.end());
  if (std::adjacent_find(ids.begin(), ids.end()) != ids.end())
    return {"", "lasers, cameras and wheels must have different sensors"};
  if (hold_items < 100 || hold_items > 10'000'000) return {"hold_items", "must be 100 to 10000000"};
  if (pos_latency_max < std::chrono::milliseconds(10) || pos_latency_max > seconds(60))
    return {"pos_latency_max", "must be 10 ms to 60 s"};
  if (pos_early < nanoseconds(0) || pos_early > seconds(1)) return {"pos_early", "must be 0 to 1 s"};
  return {};
}

Synchroniser::Synchroniser(Config config)
    : config_(std::move(config)), clock_(config_.clock), exposures_(config_.cameras.size()) {
  for (const auto& l : config_.lasers) {
    lasers_.emplace_back(l);
    if (!config_.self_timed) continue;
    SelfTimedLaser::Config own;
    own.sensor = l.sensor;
    own.discipline = l.discipline;
    own.holdover_limit = config_.clock.holdover_limit;
    own.agreeing = config_.clock.label.agreeing;
    own.not_before = config_.clock.label.not_before;
    own.hold = config_.hold;
    self_timed_.emplace_back(own);
    self_timed_states_.push_back(SyncState::Unlocked);
  }
  for (ExposureMatcher::Config c : config_.cameras) {
    // Without marks, an image of a file is timed by what it says itself (take_image_of_file()).
    if (config_.self_timed && c.mark_input == 0 && !c.counter_offset) c.counter_offset = nanoseconds(0);
    cameras_.emplace_back(c);
  }
  told_.resize(cameras_.size());
  for (const auto& w : config_.wheels) wheels_.emplace_back(w);
}

void Synchroniser::process(Measurement measurement, SyncOutput& out) {
  ++counts_.measurements;
  std::visit(
      [&](auto& m) {
        // take() may move the measurement away, but its arrival is needed afterwards.
        const HostTime received = received_of(m);
        take(m, out);
        settle(received, out);
      },
      measurement);
}

void Synchroniser::advance(HostTime received, SyncOutput& out) { settle(received, out); }

void Synchroniser::arrived(SensorId sensor, HostTime received, GpsTime time) {
  if (!config_.self_timed && listed(config_.arrival_sources, sensor)) clock_.add(TimedArrival{sensor, received, time});
}

void Synchroniser::take(PpsEdge& m, SyncOutput&) {
  if (m.sensor != config_.clock.pps)
    report_unknown_sensor(m.sensor, m.edge, "PPS edge");
  else
    clock_.add(m);
}
void Synchroniser::take(TimeLabel& m, SyncOutput& out) {
  if (config_.self_timed) {
    clock_.add_utc_offset(m);  // a POS knows leap seconds that the table cannot contain
    if (SelfTimedLaser* own = self_timed(m.sensor)) own->add(m, clock_, out.laser);
    return;
  }
  if (listed(config_.label_sources, m.sensor)) clock_.add(m);
}
void Synchroniser::take(TimedArrival& m, SyncOutput&) {
  std::size_t i = 0;
  if (config_.self_timed && camera(m.sensor, &i)) told_[i] = m;
  arrived(m.sensor, m.received, m.time);
}
void Synchroniser::take(GnssFix& m, SyncOutput&) { arrived(m.sensor, m.received, m.time); }
void Synchroniser::take(ImuSample& m, SyncOutput&) { arrived(m.sensor, m.received, m.time); }
void Synchroniser::take(Fault&, SyncOutput&) {}  // it is already in the journal

void Synchroniser::take(InsUncertainty& m, SyncOutput&) {
  for (InsUncertainty& known : uncertainties_)
    if (known.sensor == m.sensor) {
      known = m;
      return;
    }
  uncertainties_.push_back(m);
}

void Synchroniser::take(InsSolution& m, SyncOutput& out) {
  if (config_.pos != kSystemSensor && m.sensor != config_.pos)
    return report_unknown_sensor(m.sensor, m.received, "navigation solution");
  arrived(m.sensor, m.received, m.time);
  ++counts_.ins;
  if (!m.sigma)
    for (const InsUncertainty& known : uncertainties_)
      if (known.sensor == m.sensor && m.time - known.time >= seconds(-2) && m.time - known.time <= seconds(5))
        m.sigma = known.sigma;
  // Where the clock is lost again, the POS may be the one that is wrong, so what it says is judged when that is
  // settled, like the returns of that time, which it would place.
  if (stream_time_ && !clock_.can_stamp() && !config_.self_timed) return hold(std::move(m));
  judge(std::move(m), out);
}

/// Returns by how much a message of the POS is off its arrival, if that is more than its way can take.
std::optional<std::string> Synchroniser::off_arrival(HostTime received, GpsTime time) const {
  const auto arrival = clock_.can_stamp() ? clock_.stamp(received) : std::nullopt;
  if (!arrival) return {};
  const nanoseconds late = arrival->time - time;
  if (late <= config_.pos_latency_max && late >= -config_.pos_early - 5 * arrival->sigma) return {};
  return describe_offset(std::llround(to_seconds(-late)));
}

void Synchroniser::judge(InsSolution&& m, SyncOutput& out) {
  if (const auto off = off_arrival(m.received, m.time)) {
    ++counts_.ins_refused;
    m.is_good = false;
    faults_.add(m.sensor, FaultKind::LabelConflict, "ins", m.received,
                fmt::format("navigation solution {} off its arrival: not trusted", *off));
  }
  give(std::move(m), out);
}

void Synchroniser::give(InsSolution&& m, SyncOutput& out) {
  newest_solution_ = newest_solution_ ? std::max(*newest_solution_, m.time) : m.time;
  counts_.ins_missing += solutions_.add(m, faults_);
  for (WheelOdometer& w : wheels_) w.add(m);
  out.ins.push_back(std::move(m));
}

void Synchroniser::take(EventMark& m, SyncOutput&) {
  if (config_.pos != kSystemSensor && m.sensor != config_.pos)
    return report_unknown_sensor(m.sensor, m.received, "event mark");
  if (m.is_valid) arrived(m.sensor, m.received, m.time);
  if (!config_.self_timed) return hold(std::move(m));
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    cameras_[i].add(m, scratch_);
    exposures_.add(i, scratch_);
  }
}
void Synchroniser::take(LaserStatus& m, SyncOutput& out) {
  if (!laser(m.sensor)) return report_unknown_sensor(m.sensor, m.received, "laser status");
  if (SelfTimedLaser* own = self_timed(m.sensor)) return own->add(m, clock_, out.laser);
  hold(std::move(m));
}
void Synchroniser::take(LaserBatch& m, SyncOutput& out) {
  counts_.returns += m.returns.size();
  if (!laser(m.sensor)) {
    counts_.untimed["of a scanner that the rig does not have"] += m.returns.size();
    return report_unknown_sensor(m.sensor, m.received, "laser batch");
  }
  if (SelfTimedLaser* own = self_timed(m.sensor)) return own->process(std::move(m), clock_, out.laser);
  if (held_.empty() && clock_.can_stamp())
    stamp(std::move(m), out);
  else
    hold(std::move(m));
}
void Synchroniser::take(Image& m, SyncOutput&) {
  std::size_t i = 0;
  if (!camera(m.sensor, &i)) return report_unknown_sensor(m.sensor, m.received, "image");
  if (config_.self_timed) return take_image_of_file(m, i);
  hold(std::move(m));
}

void Synchroniser::take_image_of_file(Image& m, std::size_t index) {
  const ExposureMatcher::Config& given = config_.cameras[index];
  std::optional<GpsTime> told;
  if (given.counter_offset) {
    told = gps_time_ns(count_ns(m.time)) + *given.counter_offset;
  } else if (told_[index] && told_[index]->received == m.received) {
    told = told_[index]->time;
    m.time = DeviceTime<CameraCounter>(told->time_since_epoch());
  }
  if (!told) {
    ++counts_.never_stamped;
    return faults_.add(m.sensor, FaultKind::NoTime, "file", m.received,
                       "read from a file, and its stamp is on no time scale that is known: recorded, without a time "
                       "(counter_offset_s says which it is)");
  }
  // It came within the latencies that the matcher expects: a file has no arrivals that could contradict.
  const GpsStamp arrival{*told + (given.latency_min + given.latency_max) / 2, nanoseconds(0), SyncState::Locked};
  cameras_[index].add(std::move(m), arrival, scratch_);
  exposures_.add(index, scratch_);
}

void Synchroniser::take(WheelSpeed& m, SyncOutput&) {
  if (!wheel(m.sensor)) return report_unknown_sensor(m.sensor, m.received, "wheel speed");
  if (config_.self_timed) {
    ++counts_.never_stamped;
    return faults_.add(
        m.sensor, FaultKind::NoTime, "file", m.received,
        "read from a file: the bus has no time in common with the other files; recorded, without a time");
  }
  hold(std::move(m));
}

LaserClock* Synchroniser::laser(SensorId sensor) {
  for (std::size_t i = 0; i < lasers_.size(); ++i)
    if (config_.lasers[i].sensor == sensor) return &lasers_[i];
  return nullptr;
}
SelfTimedLaser* Synchroniser::self_timed(SensorId sensor) {
  for (SelfTimedLaser& own : self_timed_)
    if (own.sensor() == sensor) return &own;
  return nullptr;
}
ExposureMatcher* Synchroniser::camera(SensorId sensor, std::size_t* index) {
  for (std::size_t i = 0; i < cameras_.size(); ++i)
    if (config_.cameras[i].camera == sensor) {
      if (index) *index = i;
      return &cameras_[i];
    }
  return nullptr;
}
WheelOdometer* Synchroniser::wheel(SensorId sensor) {
  for (WheelOdometer& w : wheels_)
    if (w.sensor() == sensor) return &w;
  return nullptr;
}
void Synchroniser::report_unknown_sensor(SensorId sensor, HostTime received, const char* what) {
  ++counts_.unknown_sensor;
  faults_.add(sensor, FaultKind::NoTime, what, received,
              fmt::format("{} of a sensor that has no role in the rig's sync: not stamped", what));
}

void Synchroniser::hold(Held item) {
  // All items go through the queue, so that those held earlier are stamped earlier. settle() empties it at once if it
  // can.
  if (std::holds_alternative<Image>(item)) held_images_.push_back(released_items_ + held_.size());
  held_bytes_ += bytes_of(item);
  if (auto* batch = std::get_if<LaserBatch>(&item)) batch->returns.shrink_to_fit();
  held_.push_back(std::move(item));
}

Synchroniser::Held Synchroniser::release_oldest() {
  Held item = std::move(held_.front());
  held_.pop_front();
  ++released_items_;
  if (std::holds_alternative<Image>(item)) held_images_.pop_front();
  held_bytes_ -= bytes_of(item);
  return item;
}

void Synchroniser::drop_oldest(const char* why, SyncOutput& out) {
  Held item = release_oldest();
  auto* solution = std::get_if<InsSolution>(&item);
  if (!solution) return count_dropped(item, why);
  if (clock_.is_disputed()) {
    ++counts_.ins_refused;
    solution->is_good = false;
    faults_.add(solution->sensor, FaultKind::LabelConflict, "ins unjudged", solution->received,
                "navigation solution of a time when the sources disagreed about the second: not trusted");
  }
  give(std::move(*solution), out);
}

/// What came before the image stays: a scanner's returns can be placed without it.
void Synchroniser::drop_oldest_image() {
  const Held image = std::exchange(held_[static_cast<std::size_t>(held_images_.front() - released_items_)], Held());
  held_images_.pop_front();
  count_dropped(image,
                "the clock has not locked, and more images came than can be held (hold_images): recorded, but without "
                "a time");
}

void Synchroniser::count_dropped(const Held& item, const char* why) {
  std::visit(
      [&]<class Item>(const Item& one) {
        if constexpr (!std::is_same_v<Item, std::monostate>) {
          faults_.add(one.sensor, FaultKind::NoTime, why, newest_, why);
          ++counts_.never_stamped;
        }
      },
      item);
  if (const auto* batch = std::get_if<LaserBatch>(&item); batch && !batch->returns.empty())
    counts_.untimed[fmt::format("no time: {}", clock_.why_not())] += batch->returns.size();
}

void Synchroniser::stamp(Held&& item, SyncOutput& out) {
  if (std::holds_alternative<std::monostate>(item)) return;
  ++counts_.released;
  if (auto* batch = std::get_if<LaserBatch>(&item)) {
    laser(batch->sensor)->process(std::move(*batch), clock_, out.laser);
  } else if (auto* status = std::get_if<LaserStatus>(&item)) {
    laser(status->sensor)->add(*status);
  } else if (auto* mark = std::get_if<EventMark>(&item)) {
    if (const auto off = mark->is_valid ? off_arrival(mark->received, mark->time) : std::nullopt) {
      ++counts_.marks_refused;
      return faults_.add(mark->sensor, FaultKind::LabelConflict, "mark", mark->received,
                         fmt::format("event mark {} off its arrival: not used", *off));
    }
    for (std::size_t i = 0; i < cameras_.size(); ++i) {
      cameras_[i].add(*mark, scratch_);
      exposures_.add(i, scratch_);
    }
  } else if (auto* solution = std::get_if<InsSolution>(&item)) {
    judge(std::move(*solution), out);
  } else if (auto* speed = std::get_if<WheelSpeed>(&item)) {
    wheel(speed->sensor)->add(std::move(*speed), clock_, out.wheels);
  } else if (auto* image = std::get_if<Image>(&item)) {
    std::size_t i = 0;
    ExposureMatcher* matcher = camera(image->sensor, &i);
    const auto arrival = clock_.stamp(image->received);
    if (arrival) matcher->add(std::move(*image), *arrival, scratch_);
    exposures_.add(i, scratch_);
  }
}

void Synchroniser::settle(HostTime received, SyncOutput& out) {
  newest_ = std::max(newest_, received);
  if (config_.self_timed) return settle_self_timed(out);
  clock_.advance(newest_);
  const bool can_stamp = clock_.can_stamp();
  if (clock_.state() != known_state_) {
    const auto now = clock_.stamp(newest_);
    out.state_changes.push_back({config_.clock.pps, newest_, now ? std::optional(now->time) : std::nullopt,
                                 known_state_, clock_.state(), now ? now->sigma : nanoseconds(0)});
    known_state_ = clock_.state();
  }
  if (can_stamp) {
    while (!held_.empty()) {
      stamp(release_oldest(), out);
    }
    if (const auto now = clock_.stamp(newest_)) {
      stream_time_ = stream_time_ ? std::max(*stream_time_, now->time) : now->time;
      for (std::size_t i = 0; i < cameras_.size(); ++i) {
        cameras_[i].advance(*stream_time_, newest_, scratch_);
        exposures_.add(i, scratch_);
      }
      exposures_.merge(cameras_, stream_time_, out.exposures, faults_);
      GpsTime safe = *stream_time_;
      for (std::size_t i = 0; i < lasers_.size(); ++i) {
        safe = std::min(safe, *stream_time_ - config_.lasers[i].latency_max);
        if (const auto earliest = lasers_[i].earliest_held()) safe = std::min(safe, *earliest);
      }
      for (const ExposureMatcher& c : cameras_) safe = std::min(safe, c.watermark(*stream_time_));
      safe = exposures_.earliest(safe);
      watermark_ = watermark_ ? std::max(*watermark_, safe) : safe;
    }
  } else {
    const auto too_old = [&] {
      return std::visit(
          [&]<class Item>(const Item& item) {
            if constexpr (std::is_same_v<Item, std::monostate>)
              return true;
            else
              return newest_ - item.received > config_.hold;
          },
          held_.front());
    };
    while (held_images_.size() > config_.hold_images) drop_oldest_image();
    while (!held_.empty() && too_old())
      drop_oldest("the clock has not locked for as long as measurements can be held: recorded, but without a time",
                  out);
    while (held_.size() > config_.hold_items || held_bytes_ > config_.hold_bytes)
      drop_oldest("the clock has not locked, and more came than can be held (hold_mb): recorded, but without a time",
                  out);
  }
  for (LaserClock& l : lasers_) l.drain(out.faults);
  for (ExposureMatcher& c : cameras_) c.drain(out.faults);
  for (WheelOdometer& w : wheels_) w.drain(out.faults);
  clock_.drain(out.faults);
  faults_.drain(out.faults);
}

/// The watermark is the time of the slowest device, because every other device may still deliver data from then on.
void Synchroniser::settle_self_timed(SyncOutput& out) {
  std::optional<GpsTime> slowest = newest_solution_;
  bool is_waiting = false;
  for (std::size_t i = 0; i < self_timed_.size(); ++i) {
    SelfTimedLaser& own = self_timed_[i];
    own.advance(newest_, clock_, out.laser);
    own.drain(out.faults);
    if (own.state() != self_timed_states_[i]) {
      out.state_changes.push_back(
          {own.sensor(), newest_, own.newest(), self_timed_states_[i], own.state(), nanoseconds(0)});
      self_timed_states_[i] = own.state();
    }
    is_waiting |= own.is_waiting();
    if (!own.newest()) continue;
    const GpsTime safe = *own.newest() - config_.lasers[i].latency_max;
    slowest = slowest ? std::min(*slowest, safe) : safe;
    stream_time_ = stream_time_ ? std::max(*stream_time_, *own.newest()) : *own.newest();
  }
  // The POS brings the marks, and the files are read in the order of their times.
  if (newest_solution_ && !cameras_.empty()) {
    for (std::size_t i = 0; i < cameras_.size(); ++i) {
      cameras_[i].advance(*newest_solution_, newest_, scratch_);
      exposures_.add(i, scratch_);
      slowest = std::min(*slowest, cameras_[i].watermark(*newest_solution_));
    }
    exposures_.merge(cameras_, newest_solution_, out.exposures, faults_);
    slowest = exposures_.earliest(*slowest);
  }
  if (!is_waiting && slowest && stream_time_) watermark_ = watermark_ ? std::max(*watermark_, *slowest) : *slowest;
  // A file that has ended delivers no more. The files are read side by side, so nothing comes from far behind the POS.
  if (watermark_ && newest_solution_) watermark_ = std::max(*watermark_, *newest_solution_ - kFarBehind);
  for (ExposureMatcher& c : cameras_) c.drain(out.faults);
  for (WheelOdometer& w : wheels_) w.drain(out.faults);
  clock_.drain(out.faults);
  faults_.drain(out.faults);
}

void Synchroniser::flush(SyncOutput& out) {
  for (SelfTimedLaser& own : self_timed_) own.flush(clock_, out.laser);
  settle(newest_, out);
  while (!held_.empty())
    drop_oldest("the recording ended before the clock could be locked: recorded, but without a time", out);
  for (LaserClock& l : lasers_) {
    l.flush(out.laser);
    l.drain(out.faults);
  }
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    cameras_[i].flush(scratch_);
    exposures_.add(i, scratch_);
    cameras_[i].drain(out.faults);
  }
  exposures_.merge(cameras_, {}, out.exposures, faults_);
  for (WheelOdometer& w : wheels_) {
    w.flush();
    w.drain(out.faults);
  }
  clock_.flush();
  clock_.drain(out.faults);
  faults_.flush();
  faults_.drain(out.faults);
}

}  // namespace hueline::sync
