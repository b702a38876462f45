#pragma once

#include <array>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/decoder.hpp"
#include "runtime/drive_watch.hpp"
#include "runtime/ingest.hpp"
#include "runtime/post_trajectory.hpp"
#include "runtime/products.hpp"
#include "runtime/verdict.hpp"
#include "storage/journal_segments.hpp"
#include "sync/wheel_odometer.hpp"

namespace hueline::runtime {

/// Returns the receiver's own status of a solution (InsSolution::status) in words for people.
std::string ins_status_words(std::uint32_t status);

/// Counts what a drive gave and what it lost, and writes it as JSON and as text. Everything in it follows from the
/// journal, so a live run and a replay agree.
/// Thread safety: none; the pipeline's thread calls all functions.
class Summary : public ProductSink {
 public:
  /// `sensors` has the names by SensorId; index 0 is hueline itself.
  explicit Summary(std::vector<std::string> sensors);

  /// Takes a packet of the journal; in a replay shed ones too, which a live run does not see: it tells them by
  /// on_shed().
  void on_packet(const Packet& packet);
  /// Adds a sensor's packets that are in the journal and were not given to on_packet(), because they were shed.
  void on_shed(SensorId sensor, const Ingest::Shed& shed);
  /// Sets the counts of a sensor's decoder.
  void on_decoded(SensorId sensor, const DecodeCounts& counts);
  /// Adds what a wheel encoder measured, and its comparison with the POS.
  void on_wheels(SensorId sensor, const sync::WheelOdometer::Way& speeds, const sync::WheelOdometer::Way& pulses);
  /// Sets what the watch over mounting and times did and found.
  void on_watch(const WatchReport& report) { watch_ = report; }
  /// The map of cloud.las.
  struct Map {
    std::string crs;    ///< "EPSG:25832"
    std::string name;   ///< "ETRS89 / UTM zone 32N"
    std::string words;  ///< what was done to the POS's positions
  };
  void on_map(Map map) { map_ = std::move(map); }
  /// The parts of the cloud that were written beside it.
  struct Parts {
    std::string split;   ///< as the rig names it: "tile:100m"
    std::string folder;  ///< in the drive's folder
    std::uint64_t files = 0, points = 0, bytes = 0;
    std::uint64_t missing = 0;  ///< points of the drive on the map that they do not hold
  };
  void on_parts(Parts parts) { parts_ = std::move(parts); }
  const std::optional<Parts>& parts() const { return parts_; }
  /// Sets what a ring has removed of the recording, as the recording itself says.
  void on_removed(const storage::RemovedSegments& removed) { removed_ = removed; }
  /// Sets how the post-processed trajectory differs from the POS's solutions that it replaces.
  void on_trajectory(const TrajectoryComparison& comparison) { trajectory_ = comparison; }
  /// To be called if the products end before the recording does. A replay makes them whole. `why` is a sentence.
  void on_early_end(const std::string& why) { ends_early_ = why; }
  void on_returns(std::uint64_t returns) { returns_ += returns; }      ///< decoded returns, of all scanners
  void on_unfused(const std::string& reason, std::uint64_t points);    ///< returns that did not become points
  void on_unwritten(const std::string& reason, std::uint64_t points);  ///< points that cloud.las does not hold
  /// Adds a sentence of its own, such as why returns were not placed.
  void on_note(std::string sentence) { notes_.push_back(std::move(sentence)); }

  void on_cloud(const CloudBlock& block, const fusion::Trajectory&) override;
  void on_exposure(const Exposure& exposure) override;
  void on_solution(const InsSolution& solution) override;
  void on_sync_state(std::optional<GpsTime> time, SensorId clock, SyncState state) override;
  void on_fault(const Fault& fault) override;
  void on_command(const OperatorCommand& command) override;

  std::uint64_t points() const { return points_; }
  std::uint64_t exposures() const { return exposures_; }
  double path_m() const { return path_m_; }
  /// Returns the operator's marks, in order; those beyond kMostMarks are only counted.
  const std::vector<OperatorCommand>& marks() const { return marks_; }
  static constexpr std::size_t kMostMarks = 10'000;
  std::uint64_t wire_packets() const;  ///< packets of devices, without faults and ticks
  /// Points with a colour: those of the states Direct and Neighbour.
  std::uint64_t coloured_points() const;
  double coloured_share() const;  ///< of the points
  /// Returns the share of the returns that became points. Returns without a range cannot become points and do not
  /// count.
  double placed_share() const;
  /// Sets the health of the drive and its verdict, to be written.
  void on_verdict(const Health& health, Verdict verdict);
  const std::optional<Verdict>& verdict() const { return verdict_; }
  /// Returns the sum of the counts of all faults of this kind.
  std::uint64_t lost(FaultKind kind) const;

  nlohmann::ordered_json json() const;
  /// Returns a page for the terminal.
  std::string text() const;

 private:
  struct FaultLine {
    std::uint64_t events = 0, count = 0;
    std::string first, last;  // details of the faults
  };
  struct Sensor {
    std::string name;
    std::uint64_t packets = 0, bytes = 0, shed = 0;
    DecodeCounts decoded;
    std::map<FaultKind, FaultLine> faults;
  };
  struct Wheels {
    SensorId sensor;
    sync::WheelOdometer::Way speeds, pulses;
  };
  struct SigmaStatistics {
    std::uint64_t count = 0;
    double sum_square_us = 0, largest_us = 0;
    void add(nanoseconds sigma);
    double rms_us() const;
  };

  nlohmann::ordered_json marks_json() const;
  nlohmann::ordered_json episode_json(const HealthEpisode& episode) const;
  /// Returns whether a fault of this sensor may have had a consequence: the sensor had a trouble, or the drive is not
  /// usable.
  bool had_trouble(SensorId sensor) const;
  nlohmann::ordered_json wheels_json(const Wheels& wheels) const;
  nlohmann::ordered_json watch_json() const;
  std::string watch_text() const;
  static nlohmann::ordered_json sensor_json(const Sensor& sensor);

  std::vector<Sensor> sensors_;
  std::vector<Wheels> wheels_;
  std::optional<WatchReport> watch_;  // empty: nothing was watched
  storage::RemovedSegments removed_;
  std::optional<Map> map_;                          // empty: there is no cloud
  std::optional<Parts> parts_;                      // empty: there are none
  std::optional<TrajectoryComparison> trajectory_;  // empty: the POS's solutions were used
  std::uint64_t points_ = 0, packets_ = 0, bytes_ = 0, gaps_ = 0, next_sequence_ = 0;
  std::array<std::uint64_t, kColourStates> by_state_{};
  std::uint64_t returns_ = 0;
  std::map<std::string, std::uint64_t> unfused_, unwritten_;
  std::vector<std::string> notes_;
  std::vector<HealthEpisode> episodes_;
  std::uint64_t episodes_not_kept_ = 0;
  std::optional<Verdict> verdict_;
  std::string ends_early_;  // empty if they do not
  std::array<std::uint64_t, 3> exposures_by_timing_{};
  std::uint64_t exposures_ = 0, incomplete_images_ = 0;
  SigmaStatistics exposure_sigma_;
  std::uint64_t solutions_ = 0, good_solutions_ = 0;
  struct NotGood {
    std::uint64_t solutions = 0;
    nanoseconds lasted{0};
  };
  static constexpr std::size_t kMostStatuses = 64;  // a receiver has about twenty
  std::map<std::uint32_t, NotGood> solutions_by_status_;
  NotGood other_statuses_;
  std::optional<GpsTime> last_solution_;
  GpsTime first_{}, last_{};
  double path_m_ = 0;
  bool has_place_ = false;
  Geodetic last_place_{};
  struct Change {
    std::optional<GpsTime> time;
    SensorId clock;
    SyncState state;
  };
  // Enough for hours with an antenna under trees. A source with wrong data can cause any number of changes.
  static constexpr std::size_t kMostChanges = 10'000;
  std::vector<OperatorCommand> marks_;
  std::uint64_t marks_not_kept_ = 0;
  std::vector<Change> changes_;
  std::uint64_t change_count_ = 0;
};

}  // namespace hueline::runtime
