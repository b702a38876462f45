// Faults of images, as the camera delivers them.
#include <algorithm>
#include <cmath>
#include <optional>

#include "sim/faults/stages.hpp"

namespace hueline::sim {
namespace {

constexpr std::int64_t kRepeatAfterNs = 12'000'000;

bool concerns_images(FaultType type) { return type >= FaultType::ImageLoss && type <= FaultType::CameraClockStuck; }

/// Applies one line to the images one after the other.
struct ImageSpoiler {
  const FaultLine& line;
  SeededRandom random;
  std::size_t hits = 0;
  std::uint64_t missed = 0;                 // images that the camera did not count
  std::optional<std::uint64_t> returned{};  // first sequence number after the camera came back
  std::int64_t returned_counter = 0;
  std::optional<std::string> frozen{};
  std::optional<std::int64_t> stuck{};
  std::vector<WireEvent> extra{};

  bool chance() {
    const bool happens = random.uniform() < line.strength;
    hits += happens ? 1 : 0;
    return happens;
  }

  /// Applies the line to an image within its time. Returns true if the image never arrives.
  bool spoil(WireEvent& event) {
    switch (line.type) {
      case FaultType::ImageLoss:
        return chance();
      case FaultType::ImageMissed:
        if (!chance()) break;
        ++missed;
        return true;
      case FaultType::ImageRepeat:
        if (chance()) {
          extra.push_back(event);
          extra.back().at_ns += kRepeatAfterNs;
        }
        break;
      case FaultType::ImageFreeze:
        if (!frozen) {
          frozen = event.image_file;
          break;
        }
        event.image_file = *frozen;
        ++hits;
        break;
      case FaultType::CameraDisconnect:
        ++hits;
        return true;
      case FaultType::ImageLate:
        event.at_ns += std::llround(line.strength * 1e6);
        ++hits;
        break;
      case FaultType::ImageWrongSize:
        event.height = std::max(2u, static_cast<std::uint32_t>(event.height * line.strength) / 2 * 2);
        ++hits;
        break;
      case FaultType::ImageIncomplete:
        event.missing_packets = static_cast<std::uint32_t>(std::llround(line.strength));
        ++hits;
        break;
      case FaultType::CameraClockStuck:
        if (!stuck) stuck = event.camera_counter_ns;
        event.camera_counter_ns = *stuck;
        ++hits;
        break;
      default:
        break;
    }
    return false;
  }

  /// Applies what remains of the line to an image at or after its beginning.
  void follow(WireEvent& event) {
    event.sequence -= missed;
    const double since_ns = static_cast<double>(event.at_ns - line.begin_ns()), span_ns = line.for_s * 1e9;
    if (line.type == FaultType::FrameNumberJump)
      event.sequence += static_cast<std::uint64_t>(std::llround(line.strength));
    if (line.type == FaultType::CameraClockStep) event.camera_counter_ns += std::llround(line.strength * 1e9);
    if (line.type == FaultType::CameraClockDrift) {
      const double ramp = std::min(since_ns, span_ns);
      event.camera_counter_ns +=
          std::llround(line.strength * 1e-6 * (ramp * ramp / (2 * span_ns) + std::max(0.0, since_ns - span_ns)));
    }
    if (line.type == FaultType::CameraDisconnect && event.at_ns >= line.end_ns()) {
      if (!returned) {
        returned = event.sequence;
        returned_counter = event.camera_counter_ns - std::llround(line.strength * 1e9);
      }
      event.sequence -= *returned;
      event.camera_counter_ns -= returned_counter;
    }
  }
};

}  // namespace

std::size_t spoil_images(const FaultLine& line, std::vector<WireEvent>& events, SeededRandom random) {
  if (!concerns_images(line.type)) return 0;
  ImageSpoiler spoiler{line, random};
  std::erase_if(events, [&](WireEvent& event) {
    if (event.channel != WireChannel::Camera || event.at_ns < line.begin_ns()) return false;
    const bool is_inside = line.covers(event.at_ns);
    spoiler.follow(event);
    return is_inside && spoiler.spoil(event);
  });
  // A camera sends one image after the other, so a late image delays those after it.
  std::int64_t earliest = 0;
  for (WireEvent& event : events)
    if (event.channel == WireChannel::Camera) event.at_ns = earliest = std::max(earliest, event.at_ns);
  for (WireEvent& event : spoiler.extra) events.push_back(std::move(event));
  sort_by_time(events);
  const bool stays = line.type == FaultType::FrameNumberJump || line.type == FaultType::CameraClockStep ||
                     line.type == FaultType::CameraClockDrift;
  return stays ? 1 : spoiler.hits;
}

}  // namespace hueline::sim
