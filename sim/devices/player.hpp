#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>

#include "core/bounded_queue.hpp"
#include "core/result.hpp"
#include "sim/devices/can_sender.hpp"
#include "sim/devices/drive_clock.hpp"
#include "sim/devices/gige_camera.hpp"
#include "sim/devices/laser_sender.hpp"
#include "sim/devices/pos_server.hpp"
#include "sim/devices/pps_server.hpp"
#include "sim/wire/timeline.hpp"

namespace hueline::sim {

/// Statistics of one channel.
struct ChannelReport {
  std::uint64_t sent = 0;  ///< events that left the device (Pos, Pps: that were offered to the clients)
  /// Events that the kernel refused or a client could not take; Camera: no acquisition, or no file.
  std::uint64_t failed = 0;
  std::int64_t latest_ns = 0;  ///< largest delay of an event after its time
  double mean_lateness_ns = 0;
  std::uint64_t later_than_1ms = 0;
};

/// The outcome of playing a timeline.
struct PlayReport {
  std::array<ChannelReport, kWireChannels> channels{};  ///< indexed by WireChannel
  PosServer::Counts pos;
  GvspStream::Counts camera;
  std::string first_camera_problem;  ///< why the first image failed; empty: none failed
  std::string problem;               ///< why it ended early; empty: it did not, or it was stopped
  bool is_complete = false;          ///< false: stopped or ended before the end
  const ChannelReport& of(WireChannel channel) const { return channels[static_cast<std::size_t>(channel)]; }
};

/// How far a timeline is played.
struct PlayProgress {
  std::int64_t drive_ns = 0;
  std::uint64_t events = 0;
};

/// The vehicle's devices on real sockets. Opens them, waits for the program to connect and plays timelines in real
/// time. Thread safety: none; `run()` ends when its stop token requests it.
class Player {
 public:
  struct Config {
    /// Empty: the vehicle has no such device; likewise below.
    std::optional<LaserSender::Config> laser = LaserSender::Config{};
    std::optional<LaserSender::Config> second_laser;  ///< sends the events whose WireEvent::laser is 1
    std::optional<PosServer::Config> pos = PosServer::Config{};
    std::optional<PpsServer::Config> pps = PpsServer::Config{};
    std::optional<CanSender::Config> wheel;                           ///< the vehicle's CAN bus
    std::optional<GigeCamera::Config> camera = GigeCamera::Config{};  ///< width and height must be set
    std::size_t image_bytes_ahead = 256U << 20U;  ///< size of the images that are read from disk before their time
    double speed = 1.0;                  ///< 0.1 .. 10; the clocks of the devices still show the times of the drive
    std::int64_t lead_ns = 200'000'000;  ///< from run() to drive time 0
    std::string validate() const;
  };

  /// Opens all devices. Errors: Invalid (configuration), and those of the devices.
  static Result<std::unique_ptr<Player>> open(const Config& config);
  explicit Player(const Config& config) : config_(config) {}

  /// Waits until somebody has asked the POS for logs, somebody listens for PPS edges and somebody has started the
  /// camera's acquisition. Senders of datagrams wait for nobody. Errors: TimedOut (the message names who is missing).
  Status wait_until_ready(std::int64_t timeout_ns, const std::stop_token& stop);

  /// Called from the thread of run() about twice in each second of drive time.
  using Progress = std::function<void(const PlayProgress&)>;

  /// Plays a timeline.
  PlayReport run(const Timeline& timeline, const std::stop_token& stop, const Progress& progress = {});

  /// Plays timelines that follow one another in one drive time, as those of Laps do. Another thread calls `next` for
  /// each while the one before is played; null: there are no more.
  using NextTimeline = std::function<Result<std::shared_ptr<const Timeline>>()>;
  PlayReport run(const NextTimeline& next, const std::stop_token& stop, const Progress& progress = {});

  /// Returns the port on which the POS listens; 0 without a POS.
  std::uint16_t pos_port() const { return pos_ ? pos_->port() : std::uint16_t{0}; }
  /// Returns the CLOCK_MONOTONIC_RAW of drive time 0 of the running or last timeline.
  std::int64_t host_begin_ns() const { return host_begin_ns_; }

 private:
  /// The camera's events of all timelines, on their way from the thread that gets timelines to the one that reads
  /// files, and on to the one that sends images.
  struct ImageEvents {
    BoundedQueue<WireEvent> to_read{{kMostEvents}}, to_send{{kMostEvents}};
    static constexpr std::size_t kMostEvents = 1024;
  };

  bool send(const WireEvent& event, const DriveClock& clock);
  Status send_image(const WireEvent& event, Buffer pixels, const std::stop_token& stop);
  void play_images(ImageEvents& images, const DriveClock& clock, const std::stop_token& stop, PlayReport& report);

  const Config config_;
  std::int64_t host_begin_ns_ = 0;
  std::unique_ptr<LaserSender> laser_, second_laser_;
  std::unique_ptr<PosServer> pos_;
  std::unique_ptr<PpsServer> pps_;
  std::unique_ptr<CanSender> wheel_;
  std::unique_ptr<GigeCamera> camera_;
};

}  // namespace hueline::sim
