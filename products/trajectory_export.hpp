#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "core/result.hpp"
#include "fusion/trajectory.hpp"
#include "storage/file_writer.hpp"

/// The trajectory of a drive as a file for other programs.
namespace hueline::products {

/// The vehicle at one instant.
struct TrajectoryRow {
  GpsTime time{};
  Geodetic position{};                                       ///< of the chosen point
  Eigen::Vector3d velocity_enu = Eigen::Vector3d::Zero();    ///< of that point, m/s
  Attitude attitude{};                                       ///< of Body
  Eigen::Vector3d sigma_position = Eigen::Vector3d::Zero();  ///< of that point: one sigma east, north, up, m
  Eigen::Vector3d sigma_attitude = Eigen::Vector3d::Zero();  ///< one sigma roll, pitch, heading, rad
  bool is_behind_gap = false;  ///< where the vehicle was between the row before and this one is not known
};

/// Makes rows of the POS's solutions: at the times of the solutions, or at a rate. Memory: the solutions of a second.
/// Thread safety: none.
class TrajectoryRows {
 public:
  struct Config {
    fusion::Trajectory::Config trajectory;
    double rate_hz = 0;        ///< rows a second, at whole multiples of the interval; 0: one for each good solution
    Point<Body> point_body{};  ///< whose places are given
  };
  using Use = std::function<void(const TrajectoryRow&)>;
  TrajectoryRows(const Config& config, Use use)
      : config_(config), trajectory_(config.trajectory), use_(std::move(use)) {}

  /// Adds a solution, in order of time.
  void add(const InsSolution& solution);
  /// Gives the last rows.
  void finish() { give(true); }
  /// Times at which there was no pose, because solutions were missing.
  std::uint64_t missing() const { return missing_; }

 private:
  void give(bool everything);
  void give(GpsTime time);
  Config config_;
  fusion::Trajectory trajectory_;
  Use use_;
  std::deque<GpsTime> times_;              // of rows to come
  std::optional<GpsTime> newest_, given_;  // the newest time that was planned; the time of the latest row
  std::uint64_t missing_ = 0;
};

/// Writes rows to a file whose ending says what it is:
///   .out, .sbet  SBET: doubles, time in GPS seconds of the first row's week; its SMRMSG has the same name with .smrmsg
///   .csv         all of a row, angles in degrees
///   .gpx, .kml, .geojson  the line, broken at gaps and at the date line (points in GeoJSON), with times (not in KML)
/// What stands there stays until close() succeeds, and for ever if it is not called.
/// Thread safety: none.
class TrajectoryFile {
 public:
  /// Errors: Invalid for another ending; Io.
  static Result<std::unique_ptr<TrajectoryFile>> create(const std::filesystem::path& path, const std::string& name);
  virtual ~TrajectoryFile() = default;
  /// Appends a row, in order of time.
  Status add(const TrajectoryRow& row);
  /// Ends the file and closes it. Error: Io.
  Status close();
  std::uint64_t rows() const { return rows_; }

 protected:
  explicit TrajectoryFile(storage::FileWriter file) : file_(std::move(file)) {}
  virtual void begin(std::string& out) = 0;
  virtual void put(const TrajectoryRow& row, std::string& out) = 0;
  virtual Status end(std::string& out) = 0;
  /// Closes the file beside this one, if there is one. It is called when everything is written.
  virtual Status close_second() { return {}; }
  bool is_first() const { return rows_ == 0; }

 private:
  Status flush();
  storage::FileWriter file_;
  std::string buffer_;
  std::uint64_t rows_ = 0;
};

}  // namespace hueline::products
