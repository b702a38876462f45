#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/frames.hpp"
#include "core/measurements.hpp"
#include "drivers/trajectory/sbet_file.hpp"
#include "drivers/trajectory/sbet_solutions.hpp"

namespace hueline::runtime {

/// A stretch of a drive, and by how much the post-processed trajectory differs from the POS's solutions there.
struct TrajectoryStretch {
  GpsTime begin{}, end{};
  Geodetic place{};                                ///< where it begins
  double horizontal_m = 0, up_m = 0, heading = 0;  ///< rms of the differences; heading in rad
};

/// How a post-processed trajectory fits to the POS's own solutions of the recording. Differences are the trajectory
/// minus the POS.
struct TrajectoryComparison {
  std::string file;
  std::uint64_t records = 0, left_out = 0, bytes_at_end = 0;         ///< of the whole file
  std::uint64_t accuracies_left_out = 0, accuracy_bytes_at_end = 0;  ///< of the file of its accuracies
  GpsTime begin{}, end{};                                            ///< the time that it covers
  GpsTime drive_begin{}, drive_end{};                                ///< the time of the POS's solutions
  std::uint64_t with_sigma = 0;  ///< of the records, those that have sigmas of their own
  std::string heading;           ///< how the heading was read, in words
  std::uint64_t compared = 0;
  std::array<double, 3> mean_enu{}, rms_enu{};          ///< m
  std::array<double, 3> mean_body{}, deviation_body{};  ///< m: a constant difference is a lever arm
  std::array<double, 3> rms_angles{};                   ///< roll, pitch, heading, rad
  double largest_m = 0;                                 ///< of the horizontal differences
  GpsTime largest_at{};
  /// Share of the horizontal differences within two sigma of both; 0.86 to 0.95 if the sigmas are true. Empty if the
  /// POS gave no sigma.
  std::optional<double> within_two_sigma;
  std::vector<TrajectoryStretch> stretches;  ///< those of 10 s that differ most, the worst first

  nlohmann::ordered_json json() const;
  /// Returns lines for the terminal.
  std::string text() const;
};

/// A trajectory that was calculated after the drive (SBET), which takes the place of the POS's solutions in a replay.
/// It must belong to the recording: before anything is coloured, all of its times, places and headings are compared
/// with what the POS said then. Thread safety: none; the pipeline's thread calls all functions.
class PostTrajectory {
 public:
  struct Config {
    std::string sbet;
    std::string smrmsg;      ///< empty: the rig's sigmas of a POS without sigmas are used
    bool is_utc = false;     ///< its times are UTC seconds of the week, not GPS seconds
    Point<Body> point_body;  ///< the point whose places it has, in Body, m
  };
  /// Calls a function with the POS's solutions of the recording, in order.
  using OwnSolutions = std::function<Status(const std::function<void(const InsSolution&)>&)>;

  /// Opens the files and compares them with the recording. Errors: those of SbetFile; Invalid if the file is not of
  /// this drive, has UTC times or headings of other axes, with what to do.
  static Result<std::unique_ptr<PostTrajectory>> open(const Config& config, const OwnSolutions& own);

  ~PostTrajectory();

  /// Gives all solutions up to `time` that were not given yet, in order.
  void take_until(GpsTime time, const std::function<void(const InsSolution&)>& use);
  /// Returns ok, or why the file could not be read to its end.
  const Status& status() const { return status_; }
  const TrajectoryComparison& comparison() const { return comparison_; }

 private:
  /// How the heading is read: the platform heading minus the wander angle, plus this many wander angles.
  enum class Heading : std::uint8_t { MinusWander = 0, Platform = 1, PlusWander = 2 };
  /// The file as solutions: with the week, the velocity and the axes of InsSolution.
  class Solutions;
  struct Differences;
  explicit PostTrajectory(const Config& config);
  Result<int> find_span(GpsTime near);
  Status compare(const OwnSolutions& own);
  Status choose_heading(const Differences& all);

  const Config config_;
  Heading heading_ = Heading::MinusWander;
  int week_ = 0;  // in which the file's seconds begin
  std::unique_ptr<Solutions> solutions_;
  std::optional<InsSolution> waiting_;
  bool is_over_ = false;
  Status status_;
  TrajectoryComparison comparison_;
};

}  // namespace hueline::runtime
