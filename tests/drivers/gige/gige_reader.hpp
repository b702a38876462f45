#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "drivers/gige/aravis_source.hpp"
#include "drivers/gige/image_decoder.hpp"
#include "drivers/guest/guest_source.hpp"
#include "drivers/transport/host_clock.hpp"
#include "tests/drivers/gige/fake_camera.hpp"
#include "tests/drivers/transport/network_lab.hpp"

// What the tests of AravisSource share: the settings of a camera, reading for some time, looking at pixels.
namespace hueline::drivers {

using std::chrono::milliseconds;
using std::chrono::seconds;

inline AravisSource::Config at_loopback() {
  AravisSource::Config config;
  config.address = config.interface = "127.0.0.1";
  config.width = 320;
  config.height = 240;
  config.frame_rate_hz = 50;
  return config;
}

/// The same camera through a guest, a process of its own.
inline GuestSource::Config guest_of(const AravisSource::Config& camera) {
  GuestSource::Config config;
  config.driver = "genicam";
  config.text = camera.to_text();
  config.slots = camera.stream_buffers + camera.images_in_flight;
  config.hung_after = std::chrono::milliseconds(5000);  // a busy machine is no hanging library
  return config;
}
/// Calls open() until it returns something else than TimedOut.
inline Status open(PacketSource& source) {
  for (;;)
    if (Status opened = source.open(); opened.ok() || opened.error().code != ErrorCode::TimedOut) return opened;
}

// What came within `limit`, or until `enough` returned true.
struct Catch {
  std::vector<Packet> packets;
  std::vector<Image> images;
  std::map<FaultKind, std::uint64_t> faults;  // units
  std::optional<ErrorCode> ended;             // anything but TimedOut
};
template <class Enough>
Catch read(PacketSource& source, nanoseconds limit, Enough&& enough, bool keep_packets = true) {
  Catch caught;
  ImageDecoder decoder({});
  const HostTime end = host_now() + limit;
  while (host_now() < end && !enough(caught)) {
    auto packet = source.next({});
    if (!packet) {
      if (packet.error().code == ErrorCode::TimedOut) continue;
      caught.ended = packet.error().code;
      break;
    }
    if (packet->kind == PacketKind::Fault) {
      const auto fault = decode_fault(packet->sensor, packet->received, packet->bytes.bytes());
      EXPECT_TRUE(fault.ok());
      caught.faults[fault->kind] += fault->count;
      continue;
    }
    std::vector<Measurement> out;
    decoder.decode(*packet, out);
    for (auto& m : out) {
      if (auto* image = std::get_if<Image>(&m)) {
        if (!keep_packets) image->buffer = {};
        caught.images.push_back(std::move(*image));
      } else if (auto* fault = std::get_if<Fault>(&m)) {
        caught.faults[fault->kind] += fault->count;
      }
    }
    if (keep_packets) caught.packets.push_back(std::move(*packet));
  }
  return caught;
}
inline auto images(std::size_t count) {
  return [count](const Catch& c) { return c.images.size() >= count; };
}

inline bool is_as_painted(const Image& image) {
  const auto pixels = image.pixels();
  for (std::size_t i = 0; i < pixels.size(); ++i)
    if (static_cast<std::uint8_t>(pixels[i]) != test::FakeCamera::pixel(image.frame_id, i)) return false;
  return pixels.size() == std::size_t{image.width} * image.height;
}

class Gige : public testing::Test {
 protected:
  // Without a network of its own, the test runs on the computer's loopback, where another camera may hold the port.
  static void SetUpTestSuite() { has_own_network = test::enter_own_network(); }
  void SetUp() override {
    if (!has_own_network)
      GTEST_LOG_(INFO) << "no privilege for a network of its own; on the machine's loopback instead";
  }
  static inline bool has_own_network = false;
};

}  // namespace hueline::drivers
