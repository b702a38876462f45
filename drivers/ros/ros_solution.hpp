#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "core/time.hpp"
#include "drivers/ros/ros_message.hpp"

/// Solutions of NovAtel receivers in messages of the two drivers that ROS has for them: novatel_oem7_msgs (NovAtel's
/// own) and novatel_gps_msgs (of novatel_gps_driver).
namespace hueline::drivers {

/// Returns whether messages of this type (ros_type()) are solutions: INSPVA and INSPVAX of novatel_oem7_msgs, Inspva
/// and Inspvax of novatel_gps_msgs.
bool carries_solution(std::string_view type);
/// Returns whether these solutions state their sigmas themselves, as INSPVAX does.
bool solution_states_sigmas(std::string_view type);
/// Returns whether messages of this type are the sigmas of solutions in messages of their own: INSSTDEV of
/// novatel_oem7_msgs, Insstdev of novatel_gps_msgs.
bool carries_solution_sigmas(std::string_view type);

/// A solution, in the order and the units of the receiver's log INSPVA.
struct RosSolutionValues {
  std::array<double, 3> place{};     ///< latitude and longitude, deg; ellipsoidal height, m
  std::array<double, 3> velocity{};  ///< north, east, up, m/s
  std::array<double, 3> angles{};    ///< roll, pitch, azimuth, deg
  std::uint32_t status = 0;          ///< of the inertial solution
};

/// What one message says.
struct RosSolution {
  UnixTime stamp{};                           ///< header.stamp
  GpsTime time{};                             ///< by the receiver's clock
  std::optional<RosSolutionValues> values;    ///< nothing: the message has sigmas alone
  std::optional<std::array<float, 9>> sigma;  ///< of the values, in the same order and units
};

/// Reads a message of one of these types. Returns nothing if it is broken, or if its receiver does not know the week.
std::optional<RosSolution> take_solution(std::string_view type, RosReader message);

}  // namespace hueline::drivers
