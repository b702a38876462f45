#pragma once

#include <memory>

#include "rosbag/bag.hpp"

namespace hueline::rosbag {

/// Returns a recording whose messages of foxglove_msgs (FoxgloveReader::of_ros()) are those of ROS that say the same.
/// One that has not its type's form is damage, which is skipped.
std::unique_ptr<Bag> turned_bag(std::unique_ptr<Bag> bag);

}  // namespace hueline::rosbag
