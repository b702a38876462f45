#include "runtime/health.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>
#include <variant>

#include "core/geodesy.hpp"
#include "core/portable_math.hpp"
#include "runtime/summary.hpp"

namespace hueline::runtime {
namespace {

constexpr nanoseconds kStep{500'000'000};                // between two judgements
constexpr nanoseconds kLongestGap{1'100'000'000};        // that counts as time; the program ticks once a second
constexpr nanoseconds kAtOnce{std::chrono::seconds(2)};  // for sigmas, which vary
constexpr nanoseconds kFaultLasts{std::chrono::seconds(10)};
constexpr nanoseconds kAllSilent{std::chrono::seconds(8)};  // longer than the silence that ends a drive by itself
constexpr double kReserve = 64e6;                           // bytes of the disk that the products leave

/// Returns what a sensor of this role is there for.
const char* data_of(drivers::Role role) {
  switch (role) {
    case drivers::Role::Laser:
      return "returns";
    case drivers::Role::Camera:
      return "images";
    case drivers::Role::Pos:
      return "navigation solutions";
    case drivers::Role::Pps:
      return "pulses";
    case drivers::Role::Odometer:
      return "speeds";
  }
  return "data";
}

const char* what_to_do_without_data(drivers::Role role) {
  switch (role) {
    case drivers::Role::Laser:
      return "check the data port in the scanner and in the rig (udp.ports), the model, and whether the laser is on";
    case drivers::Role::Camera:
      return "check width, height and pixel_format of the rig";
    case drivers::Role::Pos:
      return "check which messages the receiver logs, and on which port";
    case drivers::Role::Pps:
    case drivers::Role::Odometer:
      return "check the device's settings and its keys in the rig";
  }
  return "";
}

}  // namespace

const char* name(HealthLevel level) {
  switch (level) {
    case HealthLevel::Ok:
      return "ok";
    case HealthLevel::Waiting:
      return "waiting";
    case HealthLevel::Warning:
      return "warning";
    case HealthLevel::Alarm:
      return "alarm";
  }
  return "?";
}

const char* name(Trouble trouble) {
  constexpr std::array<const char*, kTroubles> kNames{
      "missing",  "gone",     "wrong_device", "silent",     "no_data",    "no_marks",   "unmatched",
      "no_clock", "holdover", "late_pulses",  "time_sigma", "no_pose",    "pose_sigma", "weak_gnss",
      "losses",   "fault",    "left_out",     "no_points",  "colourless", "disk"};
  return kNames[static_cast<std::size_t>(trouble)];
}

std::string text(const HealthChange& change) {
  if (!change.trouble) return change.cause;
  if (change.level == HealthLevel::Ok) return "over: " + change.cause;
  return fmt::format("{}: {}{}{}", name(change.level), change.cause, change.action.empty() ? "" : "; ", change.action);
}

std::uint64_t Health::Recent::sum() const { return std::accumulate(slots_.begin(), slots_.end(), std::uint64_t{0}); }

Health::Health(const config::Rig& rig)
    : limits_(rig.health),
      pos_(rig.sync.pos),
      pps_(rig.sync.clock.pps),
      is_self_timed_(rig.sync.self_timed),
      point_bytes_(cloud_bytes_a_point(rig.cloud_format, rig.cloud_split.has_value())) {
  sensors_.resize(rig.sensors.size() + 1);
  sensors_[0].name = "drive";
  for (const auto& sensor : rig.sensors) {
    Sensor& one = sensors_[sensor.id];
    one.name = sensor.name;
    one.role = sensor.type->role;
    one.silent_after = from_seconds(sensor.silent_after_s);
  }
  for (const auto& camera : rig.sync.cameras) sensors_[camera.camera].mark_input = camera.mark_input;
}

void Health::on_packet(const Packet& packet) {
  // What was left out leaves a gap in the order, live and in a replay.
  if (next_sequence_ && packet.sequence > *next_sequence_) gaps_.add(packet.sequence - *next_sequence_);
  next_sequence_ = packet.sequence + 1;
  bytes_ += packet.bytes.size();
  if (packet.kind == PacketKind::Tick) {
    if (const auto free = decode_tick(packet.bytes.bytes())) {
      free_bytes_ = *free;
      outlook_.note(to_seconds(active_), *free);
    }
    return;
  }
  if (packet.kind == PacketKind::Ledger) return;
  all_packets_.add(1);
  if (packet.kind != PacketKind::Wire || packet.sensor == kSystemSensor || packet.sensor >= sensors_.size()) return;
  Sensor& sensor = sensors_[packet.sensor];
  if (!sensor.first) {
    sensor.first = sensor.data = active_;
    tell(packet.sensor, "is there");
  }
  sensor.last = last_any_ = active_;
  if (!first_any_) first_any_ = active_;
  sensor.packets.add(1);
  sensor.gone.reset();
  sensor.is_wrong_device = false;
}

void Health::on_measurement(const Measurement& measurement, const sync::HostClockModel& clock) {
  const auto got = [this](SensorId id) {
    if (id >= sensors_.size()) return;
    sensors_[id].data = active_;
    sensors_[id].has_data = true;
    sensors_[id].units.add(1);
  };
  if (const auto* batch = std::get_if<LaserBatch>(&measurement)) {
    got(batch->sensor);
    if (batch->returns.empty()) return;
    if (!last_return_ || active_ - *last_return_ > std::chrono::seconds(3)) returns_since_ = active_;
    last_return_ = active_;
    returns_.add(batch->returns.size());
  } else if (const auto* image = std::get_if<Image>(&measurement)) {
    got(image->sensor);
    if (image->sensor < sensors_.size()) ++sensors_[image->sensor].images_without_mark;
  } else if (const auto* solution = std::get_if<InsSolution>(&measurement)) {
    got(solution->sensor);
  } else if (const auto* edge = std::get_if<PpsEdge>(&measurement)) {
    got(edge->sensor);
    if (edge->sensor == pps_) late_pulses_.on_edge(edge->edge);
  } else if (const auto* wheel = std::get_if<WheelSpeed>(&measurement)) {
    got(wheel->sensor);
  } else if (const auto* status = std::get_if<LaserStatus>(&measurement)) {
    if (status->sensor < sensors_.size()) sensors_[status->sensor].words = status->words;
  } else if (const auto* mark = std::get_if<EventMark>(&measurement)) {
    if (mark->input < 0 || static_cast<std::size_t>(mark->input) >= marks_.size()) return;
    marks_[static_cast<std::size_t>(mark->input)] = active_;
    for (Sensor& sensor : sensors_)
      if (sensor.mark_input == mark->input) sensor.images_without_mark = 0;
  } else if (const auto* fix = std::get_if<GnssFix>(&measurement)) {
    if (!first_fix_) first_fix_ = fix_ok_ = active_;
    fix_ = fix->type;
    // The kinds are in the order of their accuracy, but for PPP, which is as good as a fixed ambiguity.
    if (fix->type >= limits_.fix) fix_ok_ = active_;
  } else if (const auto* arrival = std::get_if<TimedArrival>(&measurement)) {
    if (arrival->sensor == pos_) late_pulses_.on_arrival(*arrival, clock);
  }
}

void Health::on_solution(const InsSolution& solution) {
  if (!first_solution_) first_solution_ = active_;
  status_ = solution.status;
  if (!solution.is_good) return;
  last_good_ = active_;
  if (solution.sigma) {
    pose_sigma_m_ = portable::hypot((*solution.sigma)[0], (*solution.sigma)[1]);
    last_sigma_ = active_;
    if (pose_sigma_m_ <= limits_.pose_sigma_m || !pose_ok_) pose_ok_ = active_;
  }
  if (place_) {
    const double step = (to_ecef(solution.position).xyz - to_ecef(*place_).xyz).norm();
    if (step < 0.5) return;
    path_m_ += step;
  }
  place_ = solution.position;
}

void Health::on_laser(const StampedLaserBatch& batch) {
  if (batch.sensor >= sensors_.size()) return;
  Sensor& sensor = sensors_[batch.sensor];
  sensor.sigma = batch.sigma;
  if (batch.sigma <= limits_.time_sigma) sensor.sigma_ok = active_;
}

void Health::on_exposure(const Exposure& exposure) {
  if (exposure.camera >= sensors_.size()) return;
  Sensor& sensor = sensors_[exposure.camera];
  if (exposure.timing == ExposureTiming::Unmatched) return sensor.unmatched.add(1);
  sensor.sigma = exposure.sigma;
  if (exposure.sigma <= limits_.time_sigma) sensor.sigma_ok = active_;
}

void Health::on_cloud(const CloudBlock& block) {
  if (block.points.empty()) return;
  last_point_ = active_;
  std::uint64_t coloured = 0;
  for (const ColouredPoint& point : block.points) coloured += point.exposure != kNoExposure ? 1 : 0;
  points_.add(block.points.size());
  coloured_.add(coloured);
  all_points_ += block.points.size();
}

void Health::on_fault(const Fault& fault) {
  if (fault.sensor >= sensors_.size()) return;
  Sensor& sensor = sensors_[fault.sensor];
  switch (fault.kind) {
    case FaultKind::Disconnected:
      if (!sensor.gone) sensor.gone = active_;
      sensor.why_gone = fault.detail;
      return;
    case FaultKind::WrongDevice:
      sensor.is_wrong_device = true;
      sensor.why_gone = fault.detail;
      return;
    case FaultKind::Reconnected:
      sensor.gone.reset();
      return;
    case FaultKind::Silent:    // the packets themselves show it
    case FaultKind::Spurious:  // without an effect by itself
    case FaultKind::Shed:      // the gaps in the order show it
      return;
    case FaultKind::Lost:
    case FaultKind::Overflow:
      // Single pulses do not matter: what the clock makes of those that come is judged.
      if (sensor.role == drivers::Role::Pps && fault.sensor != kSystemSensor) return;
      sensor.lost.add(fault.count);
      sensor.loss = fault.detail;
      return;
    case FaultKind::DiskFull:
      sensor.late_fault = active_;
      sensor.fault = fault.detail;
      return;
    default:
      break;
  }
  // Before the clock has locked, much has no time yet. A byte stream begins in the middle of a message.
  const bool begins = !sensor.first || active_ - *sensor.first < kAtOnce || (pps_ != kSystemSensor && !was_locked_);
  if (begins || is_quiet()) return;
  sensor.late_fault = active_;
  sensor.fault = fault.detail;
}

void Health::advance(HostTime now, std::optional<GpsTime> gps, const sync::HostClockModel& clock) {
  if (gps) gps_ = gps;
  // Files of several recorders have the time of their devices in common, and no other.
  if (is_self_timed_) {
    if (!gps_) return;
    now = HostTime(gps_->time_since_epoch());
  }
  if (now_ && now > *now_) active_ += std::min(now - *now_, kLongestGap);
  now_ = now_ ? std::max(*now_, now) : now;
  if (active_ < next_ || is_over_) return;
  next_ = active_ + kStep;
  judge(clock);
  for (Sensor& sensor : sensors_)
    for (Recent* recent : {&sensor.packets, &sensor.units, &sensor.lost, &sensor.unmatched}) recent->roll();
  for (Recent* recent : {&gaps_, &all_packets_, &points_, &coloured_, &returns_}) recent->roll();
  late_pulses_.roll();
}

void Health::judge(const sync::HostClockModel& clock) {
  judge_disk();
  // When everything is silent at once, the drive is over or the power has gone. No sensor is to blame.
  const bool all_silent = first_any_ && active_ - last_any_ > kAllSilent;
  set(kSystemSensor, Trouble::Silent, all_silent ? HealthLevel::Alarm : HealthLevel::Ok, last_any_,
      "no sensor sends anything any more", "check the power of the sensors and the computer's network");
  if (!first_any_) {
    set(kSystemSensor, Trouble::Missing, active_ > limits_.start ? HealthLevel::Alarm : HealthLevel::Ok, nanoseconds(0),
        "no sensor has sent anything", "check power, cables and addresses: hueline check RIG");
    return;
  }
  set(kSystemSensor, Trouble::Missing, HealthLevel::Ok);
  if (is_quiet()) return;
  for (std::size_t i = 1; i < sensors_.size(); ++i) {
    const auto id = static_cast<SensorId>(i);
    judge_connection(id, sensors_[i]);
    judge_data(id, sensors_[i]);
    if (sensors_[i].role == drivers::Role::Camera) judge_camera(id, sensors_[i]);
    if (id == pos_) judge_pos(id, sensors_[i]);
  }
  judge_clock(clock);
  judge_points(clock);
  if (was_ready_ || !last_point_ || level(kSystemSensor) != HealthLevel::Ok) return;
  was_ready_ = true;
  tell(kSystemSensor, "all is well: every sensor is there, and points are placed");
}

void Health::judge_connection(SensorId id, Sensor& sensor) {
  const HealthLevel alarm = HealthLevel::Alarm, ok = HealthLevel::Ok;
  set(id, Trouble::WrongDevice, sensor.is_wrong_device ? alarm : ok, active_, sensor.why_gone, "correct the rig");
  const nanoseconds missing = sensor.first ? nanoseconds(0) : active_ - *first_any_;
  set(id, Trouble::Missing,
      missing > limits_.start     ? alarm
      : missing > limits_.no_data ? HealthLevel::Waiting
                                  : ok,
      *first_any_,
      sensor.why_gone.empty() ? "has sent nothing since the beginning" : "was never there: " + sensor.why_gone,
      "check power, cable, address and port");
  const bool is_gone = sensor.first && sensor.gone && active_ - *sensor.gone > limits_.gone;
  set(id, Trouble::Gone, is_gone ? alarm : ok, sensor.gone.value_or(active_), "connection lost: " + sensor.why_gone,
      "check cable, power and interface; the program connects again by itself");
  // What is gone is silent of course.
  const bool is_silent = sensor.first && !sensor.gone && active_ - *sensor.last > sensor.silent_after;
  set(id, Trouble::Silent, is_silent ? alarm : ok, sensor.last.value_or(active_),
      fmt::format("connected, but sends nothing ({} s)", to_seconds(sensor.silent_after)),
      sensor.role == drivers::Role::Pps ? "check the cable of the PPS and the antenna" : "is the device set to send?");
}

void Health::judge_data(SensorId id, Sensor& sensor) {
  const HealthLevel ok = HealthLevel::Ok;
  const bool sends = sensor.last && active_ - *sensor.last < std::chrono::milliseconds(1500);
  const bool has_no_data = sends && active_ - *sensor.data > limits_.no_data;
  set(id, Trouble::NoData,
      !has_no_data                                                   ? ok
      : !sensor.has_data && active_ - *sensor.first <= limits_.start ? HealthLevel::Waiting
                                                                     : HealthLevel::Alarm,
      sensor.data.value_or(active_), fmt::format("sends packets, but no {}", data_of(sensor.role)),
      what_to_do_without_data(sensor.role));
  const std::uint64_t lost = sensor.lost.sum(), came = sensor.units.sum();
  const double share = lost + came ? static_cast<double>(lost) / static_cast<double>(lost + came) : 0;
  set(id, Trouble::Losses, share > limits_.lost_share ? HealthLevel::Warning : ok, active_,
      fmt::format("{:.1f} % lost: {}", 100 * share, sensor.loss), "check buffers, cable and MTU (operating: Faults)");
  const bool has_fault = sensor.late_fault && active_ - *sensor.late_fault < kFaultLasts;
  set(id, Trouble::Fault, has_fault ? HealthLevel::Warning : ok, sensor.late_fault.value_or(active_), sensor.fault);
  const bool is_timed = sensor.role == drivers::Role::Laser || sensor.role == drivers::Role::Camera;
  const bool is_uncertain =
      is_timed && sends && sensor.sigma > limits_.time_sigma && active_ - sensor.sigma_ok > kAtOnce;
  set(id, Trouble::TimeSigma, is_uncertain ? HealthLevel::Warning : ok, sensor.sigma_ok,
      fmt::format("its times have a sigma of {:.0f} us{}{}", to_seconds(sensor.sigma) * 1e6,
                  sensor.words.empty() ? "" : "; it says: ", sensor.words),
      sensor.role == drivers::Role::Laser ? "check the PPS and the GPRMC into the scanner"
      : sensor.mark_input > 0             ? "check the wire of the strobe"
                              : "no strobe is wired (event_input: 0): wire it, or narrow latency_min_ms and "
                                "latency_max_ms to what is true");
}

void Health::judge_camera(SensorId id, Sensor& sensor) {
  const bool sends = sensor.last && active_ - *sensor.last < sensor.silent_after;
  std::string others;
  for (std::size_t input = 1; input < marks_.size(); ++input)
    if (marks_[input] && active_ - *marks_[input] < std::chrono::seconds(3) &&
        static_cast<int>(input) != sensor.mark_input && std::ranges::none_of(sensors_, [&](const Sensor& other) {
          return other.mark_input == static_cast<int>(input);
        }))
      others += fmt::format("{}{}", others.empty() ? "" : ", ", input);
  const auto pos_came = pos_ == kSystemSensor ? std::nullopt : sensors_[pos_].first;
  const bool has_no_marks = sensor.mark_input > 0 && sends && pos_came && sensor.images_without_mark >= 3;
  set(id, Trouble::NoMarks, has_no_marks ? HealthLevel::Alarm : HealthLevel::Ok, active_,
      others.empty()
          ? fmt::format("images come, but no event mark at input {}", sensor.mark_input)
          : fmt::format("images come, but their event marks come at input {}, not at {}", others, sensor.mark_input),
      others.empty() ? "check the wire of the strobe and the receiver's settings of its event input"
                     : fmt::format("move the wire to input {}, or set event_input: {}", sensor.mark_input, others));
  const std::uint64_t unmatched = sensor.unmatched.sum(), images = sensor.units.sum();
  const bool is_unmatched = unmatched >= 2 && unmatched * 10 > images;
  set(id, Trouble::Unmatched, is_unmatched ? HealthLevel::Warning : HealthLevel::Ok, active_,
      fmt::format("{} images of the last 10 s fit no event mark", unmatched),
      "check the strobe's wire, and latency_max_ms of the rig");
}

void Health::judge_clock(const sync::HostClockModel& clock) {
  if (pps_ == kSystemSensor || is_self_timed_) return;
  const Sensor& pps = sensors_[pps_];
  const bool is_locked = clock.state() == SyncState::Locked, holds = clock.state() == SyncState::Holdover;
  if (is_locked && !was_locked_) tell(pps_, "the clock is locked");
  if (is_locked) locked_at_ = active_;
  was_locked_ = was_locked_ || is_locked;
  HealthLevel none = HealthLevel::Ok;
  nanoseconds since = locked_at_;
  if (was_locked_) {
    if (!is_locked && !holds && active_ - locked_at_ > std::chrono::seconds(3)) none = HealthLevel::Alarm;
  } else if (pps.first) {
    since = std::max(*pps.first, pos_ == kSystemSensor ? *pps.first : sensors_[pos_].first.value_or(*pps.first));
    if (active_ - since > limits_.no_data) none = HealthLevel::Waiting;
    if (active_ - since > limits_.lock) none = HealthLevel::Alarm;
  }
  const std::string why = clock.why_not();
  set(pps_, Trouble::NoClock, none, since, "the clock is not locked" + (why.empty() ? std::string() : ": " + why),
      "check the pulses (one a second, the right edge) and the receiver's time messages");
  const bool has_stopped = holds && active_ - locked_at_ > limits_.holdover;
  const bool pulses_come = pps.last && active_ - *pps.last < kAtOnce;
  set(pps_, Trouble::Holdover, has_stopped ? HealthLevel::Warning : HealthLevel::Ok, locked_at_,
      pulses_come ? "pulses come, but none at its second: the clock runs on its measured rate"
                  : "no pulses: the clock runs on its measured rate",
      pulses_come ? "is the PPS inverted, or was its receiver or its width changed? check edge: of the rig"
                  : "check the cable of the PPS and the antenna");
  judge_pulses();
}

void Health::judge_pulses() {
  const auto found = late_pulses_.judge(was_locked_);
  const HealthLevel bad = found && found->is_certain ? HealthLevel::Alarm : HealthLevel::Waiting;
  set(pps_, Trouble::LatePulses, found ? bad : HealthLevel::Ok, active_,
      fmt::format(
          "by the pulses, messages of the POS come before their own time: the pulses are {:.0f} ms late or more",
          found ? to_seconds(found->late) * 1e3 : 0),
      "is the PPS inverted? check edge: of the rig and the receiver's settings of its pulse");
}

void Health::judge_pos(SensorId id, Sensor& sensor) {
  const bool sends = sensor.last && active_ - *sensor.last < std::chrono::milliseconds(1500);
  const nanoseconds since = last_good_.value_or(first_solution_.value_or(active_));
  const bool has_none = sends && first_solution_ && active_ - since > limits_.no_pose;
  set(id, Trouble::NoPose,
      !has_none                          ? HealthLevel::Ok
      : last_good_                       ? HealthLevel::Alarm
      : active_ - since <= limits_.start ? HealthLevel::Waiting
                                         : HealthLevel::Warning,
      since, fmt::format("no good solution; the receiver says: {}", ins_status_words(status_)),
      last_good_ ? "check the antenna; wait, or drive where the sky is open"
                 : "wait until it is aligned: drive straight on, then bends");
  const bool is_uncertain = last_sigma_ && active_ - *last_sigma_ < kAtOnce && active_ - *pose_ok_ > kAtOnce;
  set(id, Trouble::PoseSigma,
      !is_uncertain                                ? HealthLevel::Ok
      : pose_sigma_m_ > limits_.pose_sigma_alarm_m ? HealthLevel::Alarm
                                                   : HealthLevel::Warning,
      pose_ok_.value_or(active_), fmt::format("horizontal sigma {:.2f} m", pose_sigma_m_),
      "drive where the sky is open, or stop until it has recovered");
  const bool is_weak = sends && first_fix_ && active_ - *fix_ok_ > limits_.fix_after;
  set(id, Trouble::WeakGnss, is_weak ? HealthLevel::Warning : HealthLevel::Ok, fix_ok_.value_or(active_),
      fmt::format("GNSS position: {}", name(fix_)), "check the antenna and the corrections; or the sky is hidden");
}

void Health::judge_points(const sync::HostClockModel& clock) {
  const std::uint64_t gaps = gaps_.sum(), packets = all_packets_.sum();
  set(kSystemSensor, Trouble::LeftOut,
      gaps == 0                    ? HealthLevel::Ok
      : gaps * 20 > packets + gaps ? HealthLevel::Alarm
                                   : HealthLevel::Warning,
      active_, fmt::format("{} packets of the last 10 s were left out of the colouring, or not recorded", gaps),
      "the computer or its disk is too slow: more --threads, a larger --buffer, nothing else running");
  bool has_none = false;
  nanoseconds since = active_;
  if (last_return_ && active_ - *last_return_ < kAtOnce) {
    since = std::max(*returns_since_, last_point_.value_or(nanoseconds(0)));
    has_none = active_ - since > limits_.no_points;
  }
  const std::string no_time = is_self_timed_ || clock.can_stamp() ? "" : clock.why_not();
  set(kSystemSensor, Trouble::NoPoints, has_none ? HealthLevel::Alarm : HealthLevel::Ok, since,
      fmt::format("returns come, but no point gets its place: {}", !no_time.empty() ? no_time
                                                                   : last_good_ && active_ - *last_good_ < kFaultLasts
                                                                       ? std::string("they have no time or no pose")
                                                                       : std::string("no good solution of the POS")),
      "see the troubles of PPS and POS");
  const bool has_cameras = std::ranges::any_of(
      sensors_, [&](const Sensor& s) { return &s != &sensors_[0] && s.role == drivers::Role::Camera; });
  const std::uint64_t points = points_.sum();
  const double share = points ? static_cast<double>(coloured_.sum()) / static_cast<double>(points) : 1;
  // At the beginning, the first images may be later than the first returns.
  const bool is_judged =
      has_cameras && points > 1000 && returns_since_ && active_ - *returns_since_ > kFaultLasts + kAtOnce + kAtOnce;
  set(kSystemSensor, Trouble::Colourless,
      !is_judged || share >= limits_.coloured_share ? HealthLevel::Ok
      : share >= limits_.coloured_share_alarm       ? HealthLevel::Warning
                                                    : HealthLevel::Alarm,
      active_, fmt::format("only {:.0f} % of the points have a colour", 100 * share),
      "see the troubles of the cameras; is a lens covered, or its region wrong?");
}

void Health::judge_disk() {
  if (!free_bytes_) return;
  // Before the fall of the free space is known, what this drive itself writes is all that is known. It also counts
  // where the disk is so full that the products end.
  const double written = (static_cast<double>(bytes_) + point_bytes_ * static_cast<double>(all_points_)) /
                         std::max(to_seconds(active_), 5.0);
  const double free = static_cast<double>(*free_bytes_);
  const auto fill = outlook_.fill();
  const double rate = !fill                  ? written
                      : free < 10 * kReserve ? std::max(*fill, written)
                                             : *fill,
               left_min = std::max(0.0, free - kReserve) / std::max(rate, 1.0) / 60;
  set(kSystemSensor, Trouble::Disk,
      left_min < limits_.disk_left_alarm_min ? HealthLevel::Alarm
      : left_min < limits_.disk_left_min     ? HealthLevel::Warning
                                             : HealthLevel::Ok,
      active_,
      fmt::format("the disk has {:.1f} GB left: {:.0f} min at {:.1f} MB/s", free * 1e-9, left_min, rate * 1e-6),
      "make room, or end the drive and continue on another disk");
}

void Health::set(SensorId id, Trouble trouble, HealthLevel level, nanoseconds since, const std::string& cause,
                 const std::string& action) {
  State& state = sensors_[id].states[static_cast<std::size_t>(trouble)];
  if (level == state.level) return;
  const HealthLevel before = std::exchange(state.level, level);
  const auto gps_at = [this](nanoseconds at) { return gps_ ? std::optional(*gps_ - (active_ - at)) : std::nullopt; };
  HealthEpisode* episode = state.episode < episodes_.size() ? &episodes_[state.episode] : nullptr;
  if (before == HealthLevel::Ok) {
    state.episode = episodes_.size();
    if (episodes_.size() < kMostEpisodes) {
      since = std::min(since, active_);
      episodes_.push_back({id, trouble, level, cause, action, to_seconds(since), to_seconds(active_), gps_at(since),
                           gps_at(active_), path_m_, path_m_, place_, true});
    } else {
      ++not_kept_;
      state.episode = kMostEpisodes;
    }
    changes_.push_back({id, level, trouble, cause, action, to_seconds(active_), gps_});
    return;
  }
  if (level == HealthLevel::Ok) {
    if (episode) {
      episode->lasts = false;
      episode->end_s = to_seconds(active_);
      episode->end = gps_;
      episode->end_m = path_m_;
    }
    changes_.push_back({id, level, trouble, episode ? episode->cause : name(trouble), {}, to_seconds(active_), gps_});
    return;
  }
  if (episode && level > episode->level) episode->level = level;
  changes_.push_back({id, level, trouble, cause, action, to_seconds(active_), gps_});
}

void Health::tell(SensorId sensor, std::string what) {
  changes_.push_back({sensor, HealthLevel::Ok, {}, std::move(what), {}, to_seconds(active_), gps_});
}

void Health::finish() {
  is_over_ = true;
  for (HealthEpisode& episode : episodes_) {
    if (!episode.lasts) continue;
    episode.end_s = to_seconds(active_);
    episode.end = gps_;
    episode.end_m = path_m_;
  }
}

std::vector<HealthChange> Health::take() { return std::exchange(changes_, {}); }

HealthLevel Health::level(SensorId id) const {
  const auto own = [](const Sensor& sensor) {
    HealthLevel worst = HealthLevel::Ok;
    for (const State& state : sensor.states) worst = std::max(worst, state.level);
    return worst;
  };
  if (id != kSystemSensor) {
    const HealthLevel worst = own(sensors_.at(id));
    return worst == HealthLevel::Ok && !sensors_[id].has_data ? HealthLevel::Waiting : worst;
  }
  HealthLevel worst = own(sensors_[0]);
  for (std::size_t i = 1; i < sensors_.size(); ++i) worst = std::max(worst, level(static_cast<SensorId>(i)));
  return worst;
}

}  // namespace hueline::runtime
