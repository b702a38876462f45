#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "config/rig.hpp"
#include "core/coloured_point.hpp"
#include "core/packet.hpp"
#include "core/stamped.hpp"
#include "runtime/disk_outlook.hpp"
#include "runtime/late_pulses.hpp"
#include "sync/host_clock_model.hpp"

namespace hueline::runtime {

/// The state of a sensor, or of the drive as a whole.
enum class HealthLevel : std::uint8_t {
  Ok,
  Waiting,  ///< not ready yet, and not late
  Warning,  ///< the drive loses quality, or will soon lose something
  Alarm,    ///< what is driven now is lost
};
/// Returns the word of it for people and files: "ok", "waiting", "warning", "alarm".
const char* name(HealthLevel level);

/// What can be wrong with a sensor or with the drive.
enum class Trouble : std::uint8_t {
  Missing,      ///< it has never sent anything
  Gone,         ///< its connection is lost
  WrongDevice,  ///< the rig names another device
  Silent,       ///< connected, but it sends nothing
  NoData,       ///< it sends, but nothing of what it is there for
  NoMarks,      ///< images come, but no event mark at their input
  Unmatched,    ///< images and event marks do not fit
  NoClock,      ///< the pulses give no time
  Holdover,     ///< the pulses have stopped
  LatePulses,   ///< the pulses come after their seconds
  TimeSigma,    ///< the times are too uncertain
  NoPose,       ///< no good solution
  PoseSigma,    ///< the poses are too uncertain
  WeakGnss,     ///< less than the kind of position that the rig wants
  Losses,       ///< a share of its data is lost
  Fault,        ///< another fault of FaultKind
  LeftOut,      ///< packets are missing in the order: left out of the colouring, or not recorded
  NoPoints,     ///< returns come, but no points
  Colourless,   ///< too few points have a colour
  Disk,         ///< the disk will be full soon
};
constexpr std::size_t kTroubles = 20;
/// Returns the word of it for files: "missing", "gone", "wrong_device", ...
const char* name(Trouble trouble);

/// A change of the health: a trouble began, became worse or better, or ended; or an event that is no trouble.
struct HealthChange {
  SensorId sensor = kSystemSensor;      ///< kSystemSensor: the drive as a whole
  HealthLevel level = HealthLevel::Ok;  ///< from now on; Ok: the trouble is over, or an event
  std::optional<Trouble> trouble;       ///< empty: an event
  std::string cause;                    ///< what is wrong; of a trouble that is over, what was wrong
  std::string action;                   ///< what to do; empty if there is nothing to do
  double drive_s = 0;                   ///< when: s after the first packet of the recording
  std::optional<GpsTime> time;          ///< when, if GPS time is known
};

/// Returns the change as a line for people, without the name of the sensor: "alarm: connection lost: ...; check cable".
std::string text(const HealthChange& change);

/// A trouble from its beginning to its end.
struct HealthEpisode {
  SensorId sensor = kSystemSensor;
  Trouble trouble{};
  HealthLevel level = HealthLevel::Warning;  ///< the worst
  std::string cause, action;
  double begin_s = 0, end_s = 0;  ///< s after the first packet of the recording; begin is when the trouble itself began
  std::optional<GpsTime> begin, end;
  double begin_m = 0, end_m = 0;  ///< the driven path
  std::optional<Geodetic> place;  ///< where the vehicle was at the beginning
  bool lasts = true;              ///< it has not ended
};

/// Says whether the drive is good while it is driven: for each sensor and for the drive as a whole what is wrong, since
/// when, and what to do. It follows from the packets of the journal alone, so a replay says the same.
///
/// Health judges by what is missing, not by faults: a fault without consequence is no trouble. What is not there yet,
/// and the end of all sensors together, are no troubles either. Time is the packets' own; a gap of all packets of more
/// than a second counts as one second, unless ticks show that the time has passed.
/// Thread safety: none; the pipeline's thread calls all functions.
class Health {
 public:
  explicit Health(const config::Rig& rig);

  // What happens. Each call counts only; advance() judges.
  void on_packet(const Packet& packet);  ///< every packet that is not shed
  void on_measurement(const Measurement& measurement, const sync::HostClockModel& clock);
  void on_solution(const InsSolution& solution);
  void on_laser(const StampedLaserBatch& batch);
  void on_exposure(const Exposure& exposure);
  void on_cloud(const CloudBlock& block);
  void on_fault(const Fault& fault);

  /// Moves time on to `now`, which does not fall, and judges every half second. `gps` is the same time if it is known.
  void advance(HostTime now, std::optional<GpsTime> gps, const sync::HostClockModel& clock);
  /// Ends the drive: nothing is judged after it.
  void finish();
  /// Returns the changes since the last call.
  std::vector<HealthChange> take();

  HealthLevel level(SensorId sensor) const;  ///< now; of kSystemSensor: the worst of all
  /// Returns the troubles of the drive in the order of their beginnings; those beyond kMostEpisodes are only counted.
  const std::vector<HealthEpisode>& episodes() const { return episodes_; }
  std::uint64_t episodes_not_kept() const { return not_kept_; }
  double drive_s() const { return to_seconds(active_); }           ///< since the first packet
  double path_m() const { return path_m_; }                        ///< driven so far
  const std::optional<Geodetic>& place() const { return place_; }  ///< of the last good solution
  /// Returns when the last packet of any sensor came, s after the first packet.
  double last_packet_s() const { return to_seconds(last_any_); }
  /// Returns whether the sensor has ever sent a packet.
  bool has_come(SensorId sensor) const { return sensors_.at(sensor).first.has_value(); }
  static constexpr std::size_t kMostEpisodes = 2000;

 private:
  /// Counts of the last ten seconds, by half seconds.
  class Recent {
   public:
    void add(std::uint64_t n) { slots_[at_] += n; }
    void roll() { slots_[at_ = (at_ + 1) % slots_.size()] = 0; }
    std::uint64_t sum() const;

   private:
    std::array<std::uint64_t, 20> slots_{};
    std::size_t at_ = 0;
  };
  struct State {
    HealthLevel level = HealthLevel::Ok;
    std::size_t episode = 0;  ///< its index if level is not Ok
  };
  struct Sensor {
    std::string name;
    drivers::Role role{};
    nanoseconds silent_after{};
    int mark_input = 0;                            // of a camera
    std::optional<nanoseconds> first, last, gone;  // packets; a connection that is lost
    std::string why_gone;
    bool is_wrong_device = false;
    std::optional<nanoseconds> data;  // the last measurement of its role, or its first packet
    bool has_data = false;
    Recent packets, units, lost, unmatched;
    std::uint64_t images_without_mark = 0;
    std::optional<nanoseconds> late_fault;  // the last fault of another kind
    std::string fault, loss;
    nanoseconds sigma_ok{0};  // when the time of its data was last certain enough
    nanoseconds sigma{0};
    std::string words;  // a scanner's, of its clock
    std::array<State, kTroubles> states{};
  };

  bool is_quiet() const { return active_ - last_any_ > std::chrono::milliseconds(1200); }
  void judge(const sync::HostClockModel& clock);
  void judge_connection(SensorId id, Sensor& sensor);
  void judge_data(SensorId id, Sensor& sensor);
  void judge_camera(SensorId id, Sensor& sensor);
  void judge_clock(const sync::HostClockModel& clock);
  void judge_pulses();
  void judge_pos(SensorId id, Sensor& sensor);
  void judge_points(const sync::HostClockModel& clock);
  void judge_disk();
  /// Sets the state of one trouble. `since` is when it began.
  void set(SensorId sensor, Trouble trouble, HealthLevel level, nanoseconds since = nanoseconds(0),
           const std::string& cause = {}, const std::string& action = {});
  void tell(SensorId sensor, std::string what);

  const config::HealthLimits limits_;
  const SensorId pos_, pps_;
  const bool is_self_timed_;
  const double point_bytes_;     // of the cloud's file
  std::vector<Sensor> sensors_;  // by SensorId; [0] is the drive
  std::optional<HostTime> now_;
  std::optional<GpsTime> gps_;
  nanoseconds active_{0}, next_{0}, last_any_{0};  // time of the drive
  std::optional<nanoseconds> first_any_;
  std::optional<std::uint64_t> next_sequence_;
  Recent gaps_, all_packets_, points_, coloured_, returns_;
  std::array<std::optional<nanoseconds>, 5> marks_{};  // the last mark of each input
  std::optional<nanoseconds> last_point_, returns_since_, last_return_;
  bool was_locked_ = false, was_ready_ = false;
  nanoseconds locked_at_{0};
  LatePulses late_pulses_;
  std::optional<nanoseconds> first_solution_, last_good_, pose_ok_, last_sigma_;
  std::uint32_t status_ = 0;
  double pose_sigma_m_ = 0;
  std::optional<nanoseconds> first_fix_, fix_ok_;
  FixType fix_ = FixType::None;
  std::optional<Geodetic> place_;
  double path_m_ = 0;
  std::uint64_t bytes_ = 0, all_points_ = 0;
  std::optional<std::uint64_t> free_bytes_;
  DiskOutlook outlook_;
  bool is_over_ = false;
  std::vector<HealthChange> changes_;
  std::vector<HealthEpisode> episodes_;
  std::uint64_t not_kept_ = 0;
};

}  // namespace hueline::runtime
