#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "core/buffer.hpp"
#include "core/measurements.hpp"
#include "sim/devices/u3v_camera.hpp"

namespace hueline::test {

/// The simulator's USB3 Vision camera, which makes images at the rate that its client sets while it is plugged in and
/// streaming. The stamp of an image says what is painted on it, so a receiver can tell whether an image is whole and
/// has its own stamp. An exposure that the client is too slow for is lost, as in a camera without memory.
class UsbCamera {
 public:
  explicit UsbCamera(const sim::U3vCamera::Config& config) : config_(config) {
    for (std::size_t i = 0; i < paintings_.size(); ++i) {
      std::vector<std::byte> pixels(std::size_t{config.width} * config.height);
      for (std::size_t at = 0; at < pixels.size(); ++at) pixels[at] = pixel(static_cast<std::int64_t>(i), at);
      paintings_[i] = Buffer::copy_of(pixels);
    }
    camera_ = sim::U3vCamera::make(config).value();
  }
  ~UsbCamera() { unplug(); }

  Status plug() {
    unplug();
    if (Status plugged = camera_->plug(); !plugged) return plugged;
    thread_ = std::jthread([this](const std::stop_token& stop) { expose(stop); });
    return {};
  }
  void unplug() {
    thread_ = {};  // ends before the cable is pulled, since one thread uses the camera
    camera_->unplug();
  }
  /// The next exposure has this fault.
  void spoil(sim::U3vFault fault) { fault_ = fault; }
  /// While it pauses, the camera exposes nothing.
  void pause(bool is_pausing) { is_pausing_ = is_pausing; }
  /// That many exposures are counted and not sent.
  void skip(std::uint64_t exposures) { skipped_ += exposures; }
  /// Waits until the camera streams.
  bool wait_until_streaming(std::chrono::milliseconds limit) const {
    const auto end = std::chrono::steady_clock::now() + limit;
    while (!camera_->is_streaming() && std::chrono::steady_clock::now() < end)
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    return camera_->is_streaming();
  }
  std::uint32_t feature(std::uint32_t address) const { return camera_->feature(address); }
  /// Images that the client has taken.
  std::uint64_t sent() const { return sent_; }
  /// Exposures that the client was too slow for.
  std::uint64_t late() const { return late_; }

  /// An exposure every 2^32 ns and a little, so that a stamp that lost its upper half shows.
  static std::int64_t stamp_of(std::uint64_t sequence) { return static_cast<std::int64_t>(sequence) * 4'294'967'301; }
  /// What it reports of the exposure with this stamp.
  static std::int64_t exposure_of(std::int64_t stamp) { return 10'000 * (stamp % 1000 + 1); }
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
  void expose(const std::stop_token& stop) {
    auto due = std::chrono::steady_clock::now();
    while (!stop.stop_requested()) {
      const std::uint32_t rate = std::max(1U, camera_->feature(sim::camera_register::kFrameRateMilliHz));
      const std::chrono::nanoseconds period(1'000'000'000'000 / rate);
      const auto now = std::chrono::steady_clock::now();
      for (; due < now; due += period, ++sequence_, ++late_) continue;
      std::this_thread::sleep_until(due);
      due += period;
      sequence_ += skipped_.exchange(0);
      ++sequence_;
      if (is_pausing_ || !camera_->is_streaming()) continue;
      const std::int64_t stamp = stamp_of(sequence_);
      const Status taken = camera_->send({.sequence = sequence_,
                                          .counter_ns = stamp,
                                          .width = config_.width,
                                          .height = config_.height,
                                          .pixels = paintings_[static_cast<std::size_t>(stamp % 4)],
                                          .exposure_ns = exposure_of(stamp),
                                          .gain = 2},
                                         stop, fault_.exchange(sim::U3vFault::None));
      if (taken.ok()) ++sent_;
    }
  }

  const sim::U3vCamera::Config config_;
  std::array<Buffer, 4> paintings_;
  std::unique_ptr<sim::U3vCamera> camera_;
  std::atomic<sim::U3vFault> fault_ = sim::U3vFault::None;
  std::atomic<std::uint64_t> skipped_ = 0, late_ = 0, sent_ = 0;
  std::atomic<bool> is_pausing_ = false;
  std::uint64_t sequence_ = 0;
  std::jthread thread_;  // ends before the camera does
};

}  // namespace hueline::test
