#include "sim/devices/player.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <thread>
#include <utility>

#include "sim/devices/image_prefetch.hpp"

namespace hueline::sim {
namespace {

constexpr std::int64_t kProgressNs = 500'000'000;
constexpr std::int64_t kLateNs = 1'000'000;
constexpr std::int64_t kDrainNs = 2'000'000'000;
constexpr auto kPollInterval = std::chrono::milliseconds(10);

void note(ChannelReport& channel, bool is_sent, std::int64_t lateness_ns) {
  ++(is_sent ? channel.sent : channel.failed);
  channel.latest_ns = std::max(channel.latest_ns, lateness_ns);
  channel.mean_lateness_ns += (static_cast<double>(lateness_ns) - channel.mean_lateness_ns) /
                              static_cast<double>(channel.sent + channel.failed);
  if (lateness_ns > kLateNs) ++channel.later_than_1ms;
}

/// Opens a device if the vehicle has it.
template <class Device>
Status open_into(std::unique_ptr<Device>& device, const std::optional<typename Device::Config>& config) {
  if (!config) return {};
  Result<std::unique_ptr<Device>> opened = Device::open(*config);
  if (!opened) return opened.error();
  device = std::move(opened).value();
  return {};
}

}  // namespace

std::string Player::Config::validate() const {
  if (!(speed >= 0.1 && speed <= 10)) return fmt::format("speed: {} is not within 0.1 .. 10", speed);
  if (lead_ns < 0) return fmt::format("lead_ns: {} is negative", lead_ns);
  for (const auto& [device, problem] :
       {std::pair("laser", laser ? laser->validate() : std::string()),
        std::pair("second_laser", second_laser ? second_laser->validate() : std::string()),
        std::pair("pos", pos ? pos->validate() : std::string()),
        std::pair("pps", pps ? pps->validate() : std::string()),
        std::pair("wheel", wheel ? wheel->validate() : std::string()),
        std::pair("camera", camera ? camera->validate() : std::string())}) {
    if (!problem.empty()) return fmt::format("{}.{}", device, problem);
  }
  return {};
}

Result<std::unique_ptr<Player>> Player::open(const Config& config) {
  if (std::string problem = config.validate(); !problem.empty()) return Error{ErrorCode::Invalid, std::move(problem)};
  auto player = std::make_unique<Player>(config);
  if (Status opened = open_into(player->laser_, config.laser); !opened) return opened.error();
  if (Status opened = open_into(player->second_laser_, config.second_laser); !opened) return opened.error();
  if (Status opened = open_into(player->pos_, config.pos); !opened) return opened.error();
  if (Status opened = open_into(player->pps_, config.pps); !opened) return opened.error();
  if (Status opened = open_into(player->wheel_, config.wheel); !opened) return opened.error();
  if (Status opened = open_into(player->camera_, config.camera); !opened) return opened.error();
  return player;
}

Status Player::wait_until_ready(std::int64_t timeout_ns, const std::stop_token& stop) {
  const std::int64_t deadline = monotonic_raw_ns() + timeout_ns;
  for (;;) {
    std::string missing;
    if (pos_ && pos_->listening_clients() == 0) missing += " nobody has asked the POS for logs;";
    if (pps_ && pps_->clients() == 0) missing += " nobody listens for PPS edges;";
    if (camera_ && !camera_->is_streaming()) missing += " nobody has started the camera's acquisition;";
    if (missing.empty()) return {};
    if (stop.stop_requested()) return Error{ErrorCode::Stopped, "stopped while waiting for the devices' clients"};
    if (monotonic_raw_ns() > deadline) {
      missing.pop_back();
      return Error{ErrorCode::TimedOut, "the simulated vehicle waited in vain for the program:" + missing};
    }
    std::this_thread::sleep_for(kPollInterval);
  }
}

bool Player::send(const WireEvent& event, const DriveClock& clock) {
  LaserSender* laser = event.laser == 0 ? laser_.get() : second_laser_.get();
  switch (event.channel) {
    case WireChannel::LaserData:
      return laser != nullptr && laser->send_data(event.payload);
    case WireChannel::LaserPosition:
      return laser != nullptr && laser->send_position(event.payload);
    case WireChannel::Pos:
      pos_->publish(event.payload, event.log, event.piece_bytes);
      return true;
    case WireChannel::Pps:
      return pps_->publish(event.sequence, clock.host_ns(event.edge_ns)) == 0;
    case WireChannel::Wheel:
      return wheel_->send(event.payload);
    case WireChannel::Camera:
      return false;
  }
  return false;
}

Status Player::send_image(const WireEvent& event, Buffer pixels, const std::stop_token& stop) {
  CameraImage image{event.sequence, event.camera_counter_ns, event.width, event.height, std::move(pixels)};
  image.missing_packets = event.missing_packets;
  image.exposure_ns = event.reported_exposure_ns;
  image.gain = event.reported_gain;
  const std::size_t size = std::size_t{event.width} * event.height;
  if (image.pixels.size() > size) {
    // The camera was set to fewer rows than its sensor has.
    image.ignores_region = true;
    image.pixels = image.pixels.part(0, size);
  }
  return camera_->send(image, stop);
}

/// Runs in a thread of its own, because sending an image takes many milliseconds.
void Player::play_images(ImageEvents& images, const DriveClock& clock, const std::stop_token& stop,
                         PlayReport& report) {
  ChannelReport& channel = report.channels[static_cast<std::size_t>(WireChannel::Camera)];
  ImagePrefetch files(
      [&](const std::stop_token& ended) -> std::optional<std::string> {
        std::optional<WireEvent> event = images.to_read.pop(ended);
        if (!event) return std::nullopt;
        std::string file = event->image_file;
        if (!images.to_send.push(std::move(*event), ended)) return std::nullopt;
        return file;
      },
      config_.image_bytes_ahead);
  while (const std::optional<ImagePrefetch::Image> pixels = files.next(stop)) {
    const std::optional<WireEvent> event = images.to_send.pop(stop);
    if (!event || !clock.sleep_until(event->at_ns, stop)) return;
    const std::int64_t lateness = monotonic_raw_ns() - clock.host_ns(event->at_ns);
    const Status sent = pixels->ok() ? send_image(*event, pixels->value(), stop) : Status(pixels->error());
    if (!sent.ok() && sent.error().code == ErrorCode::Stopped) return;
    note(channel, sent.ok(), lateness);
    if (!sent.ok() && report.first_camera_problem.empty()) report.first_camera_problem = sent.error().message;
  }
}

PlayReport Player::run(const Timeline& timeline, const std::stop_token& stop, const Progress& progress) {
  // The caller keeps the timeline until all is played.
  std::shared_ptr<const Timeline> only(std::shared_ptr<const void>(), &timeline);
  return run([&] { return Result(std::exchange(only, nullptr)); }, stop, progress);
}

PlayReport Player::run(const NextTimeline& next, const std::stop_token& stop, const Progress& progress) {
  PlayReport report, image_report;
  BoundedQueue<std::shared_ptr<const Timeline>> timelines({1});
  ImageEvents images;
  std::string problem;
  std::jthread building([&] {
    for (;;) {
      const Result<std::shared_ptr<const Timeline>> built = next();
      if (!built.ok()) problem = built.error().message;
      if (!built.ok() || *built == nullptr || !timelines.push(*built, stop)) break;
      for (const WireEvent& event : (*built)->events) {
        if (!camera_ || event.channel != WireChannel::Camera) continue;
        WireEvent image = event;
        image.image_file = (std::filesystem::path((*built)->image_folder) / event.image_file).string();
        if (!images.to_read.push(std::move(image), stop)) break;
      }
    }
    timelines.close();
    images.to_read.close();
  });
  std::optional<std::shared_ptr<const Timeline>> timeline = timelines.pop(stop);

  host_begin_ns_ = monotonic_raw_ns() + config_.lead_ns;
  const DriveClock clock(host_begin_ns_, config_.speed);
  std::jthread sending([&] { play_images(images, clock, stop, image_report); });
  // Images are sent by another thread and not by the loop below.
  const std::array<bool, kWireChannels> has_device = {
      laser_ != nullptr, laser_ != nullptr, pos_ != nullptr, pps_ != nullptr, false, wheel_ != nullptr};
  report.is_complete = true;
  std::uint64_t events = 0;
  std::int64_t next_progress = 0;
  const auto play = [&](const WireEvent& event) {
    const auto channel = static_cast<std::size_t>(event.channel);
    if (!has_device[channel]) return true;
    if (!clock.sleep_until(event.at_ns, stop)) return false;
    const std::int64_t lateness = monotonic_raw_ns() - clock.host_ns(event.at_ns);
    note(report.channels[channel], send(event, clock), lateness);
    ++events;
    if (progress && event.at_ns >= next_progress) {
      progress({event.at_ns, events});
      next_progress = event.at_ns + kProgressNs;
    }
    return true;
  };
  // To free the events of a lap takes longer than the devices may be silent, so another thread does it.
  BoundedQueue<std::shared_ptr<const Timeline>> played({1});
  std::jthread freeing([&] {
    while (played.pop()) continue;
  });
  while (timeline && report.is_complete) {
    report.is_complete = std::all_of((*timeline)->events.begin(), (*timeline)->events.end(), play);
    std::optional<std::shared_ptr<const Timeline>> next_lap = timelines.pop(stop);
    played.push(std::move(*timeline), {});
    timeline = std::move(next_lap);
  }
  played.close();
  building.join();
  sending.join();
  report.problem = problem;
  report.channels[static_cast<std::size_t>(WireChannel::Camera)] = image_report.of(WireChannel::Camera);
  report.first_camera_problem = image_report.first_camera_problem;
  if (camera_) report.camera = camera_->counts();
  if (stop.stop_requested() || !problem.empty()) report.is_complete = false;
  if (pos_) {
    const std::int64_t deadline = monotonic_raw_ns() + kDrainNs;
    while (!pos_->is_drained() && monotonic_raw_ns() < deadline) std::this_thread::sleep_for(kPollInterval);
    report.pos = pos_->counts();
  }
  return report;
}

}  // namespace hueline::sim
