#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "core/buffer.hpp"
#include "core/measurements.hpp"
#include "sim/devices/gige_camera.hpp"

namespace hueline::test {

/// The simulator's GigE Vision camera, which streams as long as the object lives. Its stamps count images, and the
/// stamp of an image says what is painted on it. So a receiver can tell whether an image is whole and has its own
/// stamp.
class EmulatedCamera {
 public:
  struct Config {
    std::string address = "127.0.0.1";
    std::uint32_t width = 320, height = 240;
    double rate_hz = 50;
    double link_bytes_per_second = 110e6;
    bool reports_exposure = false;  ///< as chunks: exposure_of() and gain_of() of each image
    std::uint16_t chunk_payload_type = 0x4001;
    double lost_packet_share = 0;
    std::int64_t restarts_at = 0;  ///< the images are counted from 1 again after this one, once; 0: never
  };
  explicit EmulatedCamera(const Config& config) {
    for (std::size_t i = 0; i < paintings_.size(); ++i) {
      std::vector<std::byte> pixels(std::size_t{config.width} * config.height);
      for (std::size_t at = 0; at < pixels.size(); ++at) pixels[at] = pixel(static_cast<std::int64_t>(i), at);
      paintings_[i] = Buffer::copy_of(pixels);
    }
    sim::GigeCamera::Config camera;
    camera.interface = config.address;
    camera.width = config.width;
    camera.height = config.height;
    camera.stream.link_bytes_per_second = config.link_bytes_per_second;
    camera.stream.lost_packet_share = config.lost_packet_share;
    camera.stream.chunk_payload_type = config.chunk_payload_type;
    camera.reports_exposure = config.reports_exposure;
    auto opened = sim::GigeCamera::open(camera);
    if (!opened) {
      problem_ = opened.error().message;
      return;
    }
    camera_ = std::move(opened).value();
    thread_ = std::jthread([this, config](const std::stop_token& stop) { stream(config, stop); });
  }

  const std::string& problem() const { return problem_; }
  static std::int64_t exposure_of(std::int64_t stamp) { return 10'000 * (stamp % 1000 + 1); }
  static float gain_of(std::int64_t stamp) { return stamp % 2 == 0 ? 1.0f : 2.0f; }
  static bool is_as_painted(const Image& image) {
    const auto pixels = image.pixels();
    const std::int64_t stamp = image.time.time_since_epoch().count();
    for (std::size_t at = 0; at < pixels.size(); ++at)
      if (pixels[at] != pixel(stamp, at)) return false;
    return pixels.size() == std::size_t{image.width} * image.height;
  }

 private:
  static std::byte pixel(std::int64_t stamp, std::size_t at) {
    return static_cast<std::byte>(static_cast<std::size_t>(stamp % 4) * 61 + at * 7 + (at >> 8) + (at >> 16));
  }
  void stream(const Config& config, const std::stop_token& stop) {
    auto due = std::chrono::steady_clock::now();
    std::int64_t restarts_at = config.restarts_at;
    for (std::int64_t number = 1; !stop.stop_requested(); ++number) {
      due += std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 / config.rate_hz));
      sim::CameraImage image{static_cast<std::uint64_t>(number), number, config.width, config.height,
                             paintings_[static_cast<std::size_t>(number % 4)]};
      image.exposure_ns = exposure_of(number);
      image.gain = gain_of(number);
      (void)camera_->send(image, stop);
      if (number == restarts_at) number = restarts_at = 0;
      std::this_thread::sleep_until(due);
    }
  }

  std::array<Buffer, 4> paintings_;
  std::string problem_;
  std::unique_ptr<sim::GigeCamera> camera_;
  std::jthread thread_;  // ends before the camera does
};

}  // namespace hueline::test
