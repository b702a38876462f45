// Any bytes as point clouds of ROS, bare and behind good heads: no crash, every byte counted once, and finite returns.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <variant>

#include "drivers/ros/ros_cloud_decoder.hpp"
#include "tests/rosbag/cloud_message.hpp"

namespace {

using namespace hueline;
using drivers::RosCloudDecoder;

void feed(const std::string& bytes, const RosCloudDecoder::Config& config) {
  RosCloudDecoder decoder(config);
  std::vector<Measurement> out;
  Packet packet;
  packet.received = host_time_ns(1'700'000'000'000'000'000);
  packet.bytes = Buffer::copy_of(storage::as_bytes(bytes));
  decoder.decode(packet, out);
  decoder.decode(packet, out);
  for (const Measurement& m : out)
    if (const auto* batch = std::get_if<LaserBatch>(&m))
      for (const LaserReturn& r : batch->returns)
        if (!std::isfinite(r.x) || !std::isfinite(r.y) || !std::isfinite(r.z) || r.azimuth < 0 || r.time_offset_ns < 0)
          std::abort();
  const DecodeCounts& c = decoder.counts();
  if (c.decoded_bytes + c.ignored_bytes + c.malformed_bytes != 2 * bytes.size()) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string input(reinterpret_cast<const char*>(data), size);
  for (const auto encoding : {drivers::RosEncoding::Ros1, drivers::RosEncoding::Cdr})
    for (const auto message :
         {RosCloudDecoder::Message::PointCloud2, RosCloudDecoder::Message::Livox, RosCloudDecoder::Message::LaserScan,
          RosCloudDecoder::Message::PackedPointCloud2, RosCloudDecoder::Message::PointCloud}) {
      RosCloudDecoder::Config config;
      config.message = message;
      config.encoding = encoding;
      feed(input, config);
      config.stamp_is_enough = size % 2 == 0;
      test::CloudMessage cloud;
      const auto at = [&](std::size_t i) { return size > i ? data[i] : std::uint8_t{0}; };
      cloud.is_big_endian = at(0) % 2 == 1;
      cloud.fields = {{"x", at(1), static_cast<std::uint8_t>(7 + at(2) % 2)},
                      {"y", at(3), 7},
                      {"z", 8, 7},
                      {"time", at(4), at(5)},
                      {"ring", at(6), at(7)}};
      cloud.point_step = at(8);
      cloud.height = at(9) % 4;
      cloud.width =
          cloud.point_step == 0
              ? 0
              : static_cast<std::uint32_t>(size / cloud.point_step / std::max<std::uint32_t>(cloud.height, 1));
      cloud.row_step = cloud.width * cloud.point_step;
      cloud.data = input;
      feed(cloud.bytes(encoding), config);
      test::RosWriter livox(encoding);
      livox.header(1, "l").put(std::uint64_t{at(0)}).put(std::uint32_t{0}).put(std::uint32_t{0});
      livox.put(static_cast<std::uint32_t>(size / 20)).raw(input);
      feed(livox.bytes(), config);
      test::RosWriter scan(encoding);
      scan.header(1, "s");
      for (std::size_t i = 0; i < 7; ++i) scan.put(static_cast<float>(at(i)) / 16);
      scan.put(static_cast<std::uint32_t>(size / 4)).raw(input.substr(0, size / 4 * 4)).put(std::uint32_t{0});
      feed(scan.bytes(), config);
      const auto points = static_cast<std::uint32_t>(size / 12);
      test::RosWriter older(encoding);
      older.header(1, "p").put(points).raw(input.substr(0, points * 12)).put(std::uint32_t{1}).text("time");
      feed(older.put(points).raw(input.substr(0, points * 4)).bytes(), config);
    }
  return 0;
}
