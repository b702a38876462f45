#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <stop_token>
#include <thread>
#include <vector>

#include "core/buffer.hpp"
#include "sim/devices/ladybug_camera.hpp"
#include "sim/wire/jpeg_planes_encode.hpp"

namespace hueline::test {

/// The simulator's Ladybug on USB, which makes images at the rate that its client sets while it is plugged in and
/// streaming. All are the same but for their sequence number and cycle time, which advances by 0.1 s, so a receiver can
/// tell whether one is whole. An exposure that the client is too slow for is lost, as in a camera without memory.
class LadybugOnUsb {
 public:
  static constexpr std::uint32_t kWidth = 3 * 64, kHeight = 2 * 48;  ///< of the mosaic of the six lenses

  explicit LadybugOnUsb(const sim::LadybugCamera::Config& config = {}) : camera_(config), painting_(paint()) {}
  ~LadybugOnUsb() { unplug(); }

  Status plug() {
    unplug();
    if (Status plugged = camera_.plug(); !plugged) return plugged;
    thread_ = std::jthread([this](const std::stop_token& stop) { expose(stop); });
    return {};
  }
  void unplug() {
    thread_ = {};  // ends before the cable is pulled, since one thread uses the camera
    camera_.unplug();
  }
  /// The next exposure has this fault.
  void spoil(sim::LadybugFault fault) { fault_ = fault; }
  /// That many exposures are counted and not sent.
  void skip(std::uint32_t exposures) { skipped_ += exposures; }
  /// While it pauses, nothing is sent.
  void pause(bool is_on) { pauses_ = is_on; }
  const sim::LadybugCamera& camera() const { return camera_; }
  /// Images that the client has taken.
  std::uint64_t sent() const { return sent_; }
  /// Exposures that the client was too slow for, or that came while it had not cleared a halt.
  std::uint64_t late() const { return late_; }

  /// Returns the bytes of an exposure.
  std::vector<std::byte> image(std::uint32_t sequence) const {
    std::vector<std::byte> out = painting_;
    const auto set = [&](std::size_t at, std::uint32_t value) {
      for (std::size_t i = 0; i < 4; ++i) out[at + i] = static_cast<std::byte>(value >> (24 - 8 * i));
    };
    set(0x00, (sequence / 10 % 128) << 25U | (sequence % 10 * 800) << 12U);
    set(0x20, sequence);
    return out;
  }

 private:
  static std::vector<std::byte> paint() {
    std::vector<std::uint8_t> mosaic(std::size_t{kWidth} * kHeight);
    for (std::size_t i = 0; i < mosaic.size(); ++i) mosaic[i] = static_cast<std::uint8_t>(i % kWidth + i / kWidth * 2);
    sim::JpegPlanesImage image;
    image.mosaic = mosaic;
    image.width = kWidth;
    image.height = kHeight;
    image.unix_us = 1'700'000'000'250'000;
    return sim::encode_jpeg_planes(image).value();
  }
  void expose(const std::stop_token& stop) {
    auto due = std::chrono::steady_clock::now();
    while (!stop.stop_requested()) {
      const double rate = std::max(1.0, double{camera_.get_float(sim::ladybug_register::kFrameRate_Hz)});
      const std::chrono::nanoseconds period(static_cast<std::int64_t>(1e9 / rate));
      const auto now = std::chrono::steady_clock::now();
      for (; due < now; due += period, ++sequence_) late_ += camera_.is_streaming();
      std::this_thread::sleep_until(due);
      due += period;
      sequence_ += skipped_.exchange(0);
      ++sequence_;
      if (pauses_ || !camera_.is_streaming()) continue;
      const Status taken =
          camera_.send(Buffer::copy_of(image(sequence_)), stop, fault_.exchange(sim::LadybugFault::None));
      ++(taken.ok() ? sent_ : late_);
    }
  }

  sim::LadybugCamera camera_;
  const std::vector<std::byte> painting_;
  std::atomic<sim::LadybugFault> fault_ = sim::LadybugFault::None;
  std::atomic<bool> pauses_ = false;
  std::atomic<std::uint32_t> skipped_ = 0;
  std::atomic<std::uint64_t> late_ = 0, sent_ = 0;
  std::uint32_t sequence_ = 0;
  std::jthread thread_;  // ends before the camera does
};

}  // namespace hueline::test
