#pragma once

#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "drivers/ros/ros_message.hpp"

/// The datagrams of scanners in messages of ROS: a driver that publishes them has received them as they are.
namespace hueline::drivers {

/// A datagram inside a message.
struct RosDatagram {
  std::optional<UnixTime> stamp;     ///< when the driver says that it received it, if it says so
  std::span<const std::byte> bytes;  ///< a part of the message
};

/// Returns whether messages of this type (ros_type()) carry datagrams: velodyne_msgs/VelodyneScan and VelodynePacket,
/// pandar_msgs/PandarScan, PandarPacket and PandarJumboPacket, the first two also of hesai_lidar,
/// nebula_msgs/NebulaPackets and NebulaPacket, PacketMsg of Ouster, udp_msgs/UdpPacket, hesai_ros_driver/UdpFrame and
/// UdpPacket, and the packets of Robosense (robosense_msgs, rslidar_msgs, rslidar_msg).
bool carries_datagrams(std::string_view type);
/// Returns whether messages of this type carry datagrams of a scanner that is not supported.
bool carries_unknown_datagrams(std::string_view type);
/// Returns whether such messages begin with a std_msgs/Header.
bool have_header(std::string_view type);

/// Appends the datagrams of a message to `out`. Returns false if the message is broken; datagrams before the break are
/// appended.
bool take_datagrams(std::string_view type, RosReader message, std::vector<RosDatagram>& out);

}  // namespace hueline::drivers
