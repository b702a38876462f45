// Reads any bytes as a recording of ROS: no crash, no endless loop, and every datagram lies inside its message.
#include <cstdint>
#include <cstdlib>

#include "drivers/ros/ros_datagrams.hpp"
#include "rosbag/bag.hpp"
#include "tests/rosbag/sample_bag.hpp"
#include "tests/storage/fuzz_file.hpp"

namespace {

using namespace hueline;

/// Returns small whole recordings, which the fuzzer's bytes edit.
std::vector<std::string> recordings() {
  const std::string scan = test::RosWriter(drivers::RosEncoding::Cdr)
                               .header(1'700'000'000'000'000'000, "laser")
                               .put(std::uint32_t{1})
                               .time(1'700'000'000'000'000'000)
                               .sequence("packet")
                               .bytes();
  const std::vector<test::SampleMessage> messages{
      {"/laser", "nebula_msgs/NebulaPackets", 1'700'000'000'000'000'000, scan},
      {"/chatter", "std_msgs/String", 1'700'000'000'100'000'000, "text"}};
  const test::WrittenFile sqlite, mcap;
  test::write_sqlite(sqlite.path(), messages);
  test::write_mcap(mcap.path(), messages, storage::Compression::None);
  return {sqlite.contents(), mcap.contents(), test::ros1_bag(messages, "none", [](const std::string& s) { return s; })};
}

/// This is global, so that the compiler does not leave out the reading.
std::uint64_t read_bytes = 0;

void read_all(const std::string& bytes) {
  const test::MemoryFile file(bytes);
  auto bag = rosbag::open_bag(file.path());
  if (!bag.ok()) return;
  std::vector<drivers::RosDatagram> datagrams;
  for (std::uint64_t errors = 0; errors <= bytes.size();) {
    const auto message = (*bag)->next();
    if (!message.ok()) {
      if (message.error().code != ErrorCode::Malformed) return;
      if (++errors > bytes.size()) std::abort();  // each damage is reported once
      continue;
    }
    const auto& topic = (*bag)->topics().at(message->topic);
    datagrams.clear();
    drivers::take_datagrams(topic.type, {message->data.bytes(), topic.encoding}, datagrams);
    for (const auto& one : datagrams)
      for (const std::byte b : one.bytes) read_bytes += static_cast<std::uint8_t>(b);
  }
}

}  // namespace

std::uint64_t fuzz_read_bytes() { return read_bytes; }

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::vector<std::string> whole = recordings();
  if (size < 2) return 0;
  std::string file = whole[data[0] % whole.size()];
  test::edit(file, data + 2, size - 2, data[1] % 12u);
  read_all(file);
  for (const auto encoding : {drivers::RosEncoding::Cdr, drivers::RosEncoding::Ros1}) {
    const auto message = std::as_bytes(std::span(data, size));
    std::vector<drivers::RosDatagram> datagrams;
    for (const char* type :
         {"velodyne_msgs/VelodyneScan", "pandar_msgs/PandarScan", "nebula_msgs/NebulaPackets",
          "rslidar_msg/RslidarScan", "hesai_ros_driver/UdpFrame", "ouster_ros/PacketMsg", "udp_msgs/UdpPacket"})
      drivers::take_datagrams(type, {message, encoding}, datagrams);
    for (const auto& one : datagrams)
      for (const std::byte b : one.bytes) read_bytes += static_cast<std::uint8_t>(b);
  }
  return 0;
}
