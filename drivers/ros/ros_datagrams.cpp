#include "drivers/ros/ros_datagrams.hpp"

#include <algorithm>
#include <array>

namespace hueline::drivers {
namespace {

/// How a message type holds its datagrams.
struct Layout {
  std::string_view type;
  bool has_header = false;      ///< std_msgs/Header comes first
  bool is_many = false;         ///< then a sequence of packets, instead of one
  bool has_stamp = false;       ///< each packet begins with its time
  bool has_own_header = false;  ///< each packet of a sequence begins with a std_msgs/Header
  std::size_t flag_bytes = 0;   ///< bytes that say what the packet is
  std::size_t fixed_bytes = 0;  ///< its bytes are an array of this size; 0: a sequence
  bool has_size = false;        ///< behind the array, how many of its bytes were received
  bool has_sender = false;      ///< address and port of the sender lie before the bytes
};

constexpr std::size_t kVelodyne = 1206, kPandar = 1500, kRobosense = 1248;
constexpr std::size_t kRslidarFlags = 2;  // whether it is a status packet, and whether a frame begins with it
constexpr std::array<Layout, 21> kLayouts{{
    {.type = "velodyne_msgs/VelodyneScan",
     .has_header = true,
     .is_many = true,
     .has_stamp = true,
     .fixed_bytes = kVelodyne},
    {.type = "velodyne_msgs/VelodynePacket", .has_stamp = true, .fixed_bytes = kVelodyne},
    {.type = "pandar_msgs/PandarScan",
     .has_header = true,
     .is_many = true,
     .has_stamp = true,
     .fixed_bytes = kPandar,
     .has_size = true},
    {.type = "pandar_msgs/PandarPacket", .has_stamp = true, .fixed_bytes = kPandar, .has_size = true},
    {.type = "pandar_msgs/PandarJumboPacket", .has_stamp = true, .has_size = true},
    {.type = "hesai_lidar/PandarScan",
     .has_header = true,
     .is_many = true,
     .has_stamp = true,
     .fixed_bytes = kPandar,
     .has_size = true},
    {.type = "hesai_lidar/PandarPacket", .has_stamp = true, .fixed_bytes = kPandar, .has_size = true},
    {.type = "nebula_msgs/NebulaPackets", .has_header = true, .is_many = true, .has_stamp = true},
    {.type = "nebula_msgs/NebulaPacket", .has_stamp = true},
    {.type = "ouster_ros/PacketMsg"},
    {.type = "ouster_msgs/PacketMsg"},
    {.type = "ouster_sensor_msgs/PacketMsg"},
    {.type = "udp_msgs/UdpPacket", .has_header = true, .has_sender = true},
    {.type = "robosense_msgs/RobosenseScan",
     .has_header = true,
     .is_many = true,
     .has_stamp = true,
     .fixed_bytes = kRobosense},
    {.type = "robosense_msgs/RobosensePacket", .has_stamp = true, .fixed_bytes = kRobosense},
    {.type = "rslidar_msgs/rslidarScan",
     .has_header = true,
     .is_many = true,
     .has_stamp = true,
     .fixed_bytes = kRobosense},
    {.type = "rslidar_msgs/rslidarPacket", .has_stamp = true, .fixed_bytes = kRobosense},
    {.type = "rslidar_msg/RslidarScan",
     .has_header = true,
     .is_many = true,
     .has_own_header = true,
     .flag_bytes = kRslidarFlags},
    {.type = "rslidar_msg/RslidarPacket", .has_header = true, .flag_bytes = kRslidarFlags},
    {.type = "hesai_ros_driver/UdpFrame", .has_header = true, .is_many = true, .has_stamp = true, .has_size = true},
    {.type = "hesai_ros_driver/UdpPacket", .has_stamp = true, .has_size = true},
}};

const Layout* find_layout(std::string_view type) {
  const auto* found = std::ranges::find(kLayouts, type, &Layout::type);
  return found == kLayouts.end() ? nullptr : found;
}

}  // namespace

bool carries_datagrams(std::string_view type) { return find_layout(type) != nullptr; }

bool carries_unknown_datagrams(std::string_view type) {
  constexpr std::array<std::string_view, 6> kUnknown{"seyond/SeyondScan",
                                                     "seyond/SeyondPacket",
                                                     "innovusion_msgs/InnovusionScan",
                                                     "innovusion_msgs/InnovusionPacket",
                                                     "lslidar_msgs/LslidarScan",
                                                     "lslidar_msgs/LslidarPacket"};
  return std::ranges::find(kUnknown, type) != kUnknown.end();
}

bool have_header(std::string_view type) {
  const Layout* layout = find_layout(type);
  return layout && layout->has_header;
}

bool take_datagrams(std::string_view type, RosReader message, std::vector<RosDatagram>& out) {
  const Layout* layout = find_layout(type);
  if (!layout) return false;
  if (layout->has_header) message.take_header();
  const std::uint32_t count = layout->is_many ? message.take_count(4) : 1;
  for (std::uint32_t i = 0; i < count && message.ok(); ++i) {
    RosDatagram one;
    if (layout->has_stamp) one.stamp = message.take_time();
    if (layout->has_own_header) message.take_header();
    message.take_bytes(layout->flag_bytes);
    if (layout->has_sender) {
      message.take_string();
      message.take<std::int32_t>();
    }
    one.bytes = layout->fixed_bytes > 0 ? message.take_bytes(layout->fixed_bytes) : message.take_byte_sequence();
    if (layout->has_size)
      one.bytes = one.bytes.first(std::min<std::size_t>(one.bytes.size(), message.take<std::uint32_t>()));
    // A driver that does not stamp leaves zero.
    if (one.stamp && one.stamp->time_since_epoch() <= nanoseconds(0)) one.stamp.reset();
    if (message.ok()) out.push_back(one);
  }
  return message.ok();
}

}  // namespace hueline::drivers
