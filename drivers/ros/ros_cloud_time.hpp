#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "drivers/ros/ros_cloud.hpp"

/// The times of the points of a cloud. Drivers of ROS agree on no name, no unit and no zero for them.
namespace hueline::drivers {

/// The unit of a field of times.
enum class RosTimeUnit : std::uint8_t { Auto, Second, Millisecond, Microsecond, Nanosecond };
/// To what the values of a field of times count.
enum class RosTimeZero : std::uint8_t {
  Auto,
  Stamp,  ///< to header.stamp (velodyne_pointcloud, ouster-ros); a Livox's to its `timebase`
  Date,   ///< they are times since 1970 on the clock of header.stamp (hesai_ros_driver, rslidar_sdk)
  First,  ///< a clock of their own: header.stamp is taken for the first point's, of a Livox for its `timebase`
};

/// How the points of a topic's clouds are timed.
struct RosTimeRule {
  std::string field;  ///< empty: the points have no times of their own
  RosTimeUnit unit = RosTimeUnit::Auto;
  RosTimeZero zero = RosTimeZero::Auto;
  std::string seconds_field;  ///< whole seconds, to which `field` adds the rest; empty: `field` has the whole time
  bool operator==(const RosTimeRule&) const = default;
};
/// Returns the rule in words: "float32 time, s after header.stamp".
std::string in_words(const RosTimeRule& rule);

/// Completes `known` from a cloud with points.
/// - The field is the first of t, time, timestamp, time_stamp, offset_time, ... (case, _ and a unit at the end do not
///   matter) whose values differ between points.
/// - A field of one unit is the rest of a second if beside it stands one of whole seconds (timestamp_sec,
/// timestamp_nsec).
/// - The unit is the one behind the last _ of its name (time_offset_ns), or that in which the points span 2 ms to 2 s,
///   as a turn of a scanner or a frame of it does. If none does, it is s for floating point and ns for whole numbers.
/// - Values of at most 2 s count to header.stamp. Values within 10 s of header.stamp are dates. Others are of a clock
/// of
///   their own, as are those of a Livox whose `timebase` is more than 10 s from header.stamp.
/// Returns nothing for a cloud in which no two points have a return.
std::optional<RosTimeRule> recognise_times(const RosCloud& cloud, RosTimeRule known);

/// The return of one point.
struct RosPoint {
  std::uint32_t index = 0;     ///< of the point in the cloud
  std::int64_t offset_ns = 0;  ///< its time minus header.stamp
};
/// Says whether a point has a return: a place within 1000 km other than (0, 0, 0), by which drivers mark that there is
/// none.
class RosReturns {
 public:
  explicit RosReturns(const RosCloud& cloud);
  bool has(std::span<const std::byte> point) const { return place(point).has_value(); }
  struct Place {
    double x, y, z;  ///< m
  };
  std::optional<Place> place(std::span<const std::byte> point) const;

 private:
  const RosCloud& cloud_;
  const RosField *x_, *y_, *z_;
};

/// Returns the points that have a return, in the order of their times. `rule` is complete. Errors: Malformed if the
/// cloud has no such field, or if its values cannot be times by the rule: they span more than 2 s, or are more than 10
/// s from header.stamp.
Result<std::vector<RosPoint>> timed_points(const RosCloud& cloud, const RosTimeRule& rule);

}  // namespace hueline::drivers
