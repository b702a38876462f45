#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/frames.hpp"
#include "core/measurements.hpp"
#include "core/result.hpp"
#include "core/time.hpp"

namespace hueline::storage {

/// How a cloud is cut into parts: strips of the drive, or tiles of the map.
struct CloudSplit {
  enum class Kind : std::uint8_t {
    Time,      ///< strips of so many seconds, at whole multiples of GPS time
    Distance,  ///< strips of so many metres of the path
    Tile,      ///< squares of the map whose sides are so many metres, at whole multiples of the coordinates
  };
  Kind kind = Kind::Time;
  double size = 0;  ///< s or m, greater than 0

  /// Reads "time:60s", "distance:500m" or "tile:100m"; the unit may be left out. Errors: Invalid, with what is allowed.
  static Result<CloudSplit> parse(const std::string& text);
  /// Returns what parse() reads, with the unit.
  std::string text() const;

  bool is_strips() const { return kind != Kind::Tile; }
  bool operator==(const CloudSplit&) const = default;
};

/// Cuts a drive into strips of `length_m` by the places where the vehicle was. Steps below half a metre count once they
/// add up, so that a standing vehicle drives nowhere. Thread safety: none.
class PathStrips {
 public:
  explicit PathStrips(double length_m) : length_m_(length_m) {}
  /// Adds the place of a solution, in order of time. Solutions that are not good have none.
  void add(const InsSolution& solution);
  /// The times at which each strip but the last ends.
  const std::vector<GpsTime>& ends() const { return ends_; }

 private:
  double length_m_, driven_m_ = 0;
  std::optional<Point<Ecef>> last_;
  std::vector<GpsTime> ends_;
};

}  // namespace hueline::storage
