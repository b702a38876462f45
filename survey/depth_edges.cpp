#include "survey/depth_edges.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "runtime/lens_image.hpp"
#include "survey/latest_exposure.hpp"

namespace hueline::survey {
namespace {

using calibration::GreyImage;

// Neighbouring returns of a channel are nearer than this; farther ones have lost returns between them.
const float kNeighbour_cos = std::cos(1.0f * std::numbers::pi_v<float> / 180);
constexpr float kJump_m = 0.5f, kJump_share = 0.1f;
// A thing is smooth where the ranges of so many neighbouring returns differ by less than this. Leaves are not, and
// images of them have edges everywhere.
constexpr float kSmooth_m = 0.1f, kSmooth_share = 0.02f;
constexpr int kSmoothReturns = 5;
constexpr float kNearest_m = 2.0f, kFarthest_m = 60.0f;  // nearer there is the own vehicle
constexpr nanoseconds kAround{60'000'000};               // one revolution has all directions once
constexpr std::size_t kMostWaiting = 100;                // exposures with their images
constexpr int kImageEdge = 5;                            // grey levels a pixel
constexpr int kShift = 4;                                // of an arbitrary place, in radii

/// Returns whether the grey levels change by more than kImageEdge a pixel somewhere within `radius` of a pixel. The
/// gradient is that of Sobel. The place must be radius + 1 inside the image.
bool has_edge_near(const GreyImage& image, double x, double y, double radius) {
  const auto reach = static_cast<int>(std::ceil(radius));
  const int column = static_cast<int>(std::lround(x)), row = static_cast<int>(std::lround(y));
  for (int v = row - reach; v <= row + reach; ++v)
    for (int u = column - reach; u <= column + reach; ++u) {
      if ((u - x) * (u - x) + (v - y) * (v - y) > radius * radius) continue;
      const std::uint8_t* p = image.pixels.data() + static_cast<std::ptrdiff_t>(v) * image.width + u;
      const int w = image.width;
      const int right = p[1 - w] + 2 * p[1] + p[1 + w] - p[-1 - w] - 2 * p[-1] - p[-1 + w];
      const int down = p[w - 1] + 2 * p[w] + p[w + 1] - p[-w - 1] - 2 * p[-w] - p[-w + 1];
      constexpr int kSobel = 8;  // its response to one grey level a pixel
      if (right * right + down * down >= kSobel * kImageEdge * kSobel * kImageEdge) return true;
    }
  return false;
}

}  // namespace

DepthEdges::DepthEdges(const fusion::RigGeometry& rig, const Config& config)
    : rig_(rig),
      config_(config),
      projector_(rig.head, fusion::ColourMethod::Lens),
      some_(config.every, config.together) {}

void DepthEdges::on_settled_laser(const StampedLaserBatch& batch, const fusion::Trajectory& trajectory) {
  const auto mount = std::find_if(rig_.lasers.begin(), rig_.lasers.end(),
                                  [&](const fusion::LaserMount& laser) { return laser.sensor == batch.sensor; });
  if (mount == rig_.lasers.end()) return;
  std::vector<Channel>& channels = channels_[batch.sensor];
  const auto add = [&](const Place& near) {
    if (near.range_m < kNearest_m || near.range_m > kFarthest_m) return;
    if (const auto [pose, reason] = trajectory.pose_at(near.time); pose)
      edges_.push_back(
          {near.time,
           (pose->T_enu_body * (mount->T_body_scanner * Point<Scanner>{near.p_scanner.cast<double>()})).xyz});
  };
  for (const LaserReturn& r : batch.returns) {
    if (!(r.range_m > 0) || r.return_number != 1) continue;
    if (channels.size() <= r.channel) channels.resize(r.channel + std::size_t{1});
    Channel& channel = channels[r.channel];
    const Place now{batch.time + nanoseconds(r.time_offset_ns), {r.x, r.y, r.z}, r.range_m};
    const Place before = std::exchange(channel.last, now);
    const float jump = now.range_m - before.range_m, least = std::min(now.range_m, before.range_m);
    const bool is_beside =
        before.range_m > 0 && before.p_scanner.dot(now.p_scanner) >= kNeighbour_cos * before.range_m * now.range_m;
    if (is_beside && std::abs(jump) < kSmooth_m + kSmooth_share * least) {
      if (++channel.smooth == kSmoothReturns && channel.begin) add(*std::exchange(channel.begin, {}));
      continue;
    }
    const bool is_edge = is_beside && std::abs(jump) >= kJump_m + kJump_share * least;
    if (is_edge && jump > 0 && channel.smooth >= kSmoothReturns) add(before);
    channel.begin = is_edge && jump < 0 ? std::optional(now) : std::nullopt;
    channel.smooth = 1;
  }
  while (!edges_.empty() && edges_.front().time < batch.time - kLatestExposure) edges_.pop_front();
  while (!waiting_.empty() && waiting_.front().is_settled && waiting_.front().mid + 2 * kAround < batch.time) {
    decide(waiting_.front());
    waiting_.pop_front();
  }
}

void DepthEdges::on_exposure(const Exposure& exposure) {
  if (exposure.timing == ExposureTiming::Unmatched || !exposure.image.is_complete) return;
  if (!some_.chooses(exposure.exposure_mid)) return;
  waiting_.push_back({exposure.index, exposure.exposure_mid, exposure.camera, exposure.image, false, {}});
  if (waiting_.size() > kMostWaiting) waiting_.pop_front();
}

void DepthEdges::on_settled_exposure(const Exposure& exposure, const fusion::Trajectory& trajectory) {
  const auto waiting = std::find_if(waiting_.begin(), waiting_.end(),
                                    [&](const Waiting& one) { return one.exposure == exposure.index; });
  if (waiting == waiting_.end()) return;
  waiting->is_settled = true;
  if (const auto [pose, reason] = trajectory.pose_at(waiting->mid); pose)
    waiting->T_head_enu = (pose->T_enu_body * rig_.head.T_body_head).inverse();
}

void DepthEdges::decide(const Waiting& exposure) {
  if (!exposure.T_head_enu) return;
  ++counts_.exposures;
  const auto& cameras = projector_.cameras();
  std::vector<std::uint8_t> has_image;
  for (const SensorId camera : cameras) has_image.push_back(camera == exposure.camera ? 1 : 0);
  const std::uint32_t blind = projector_.blind_lenses(exposure.camera, exposure.image.lost);
  std::vector<GreyImage> images;
  for (const fusion::LensMount& lens : rig_.head.lenses)
    images.push_back(lens.camera == exposure.camera ? runtime::grey_lens_image(exposure.image, lens) : GreyImage{});
  const double border = config_.radius_px + 2;
  const auto look = [&](const GreyImage& image, double x, double y, std::uint64_t& asked, std::uint64_t& missed) {
    if (x < border || y < border || x > image.width - 1 - border || y > image.height - 1 - border) return;
    ++asked;
    missed += has_edge_near(image, x, y, config_.radius_px) ? 0 : 1;
  };
  for (const Edge& edge : edges_) {
    if (std::chrono::abs(edge.time - exposure.mid) > kAround) continue;
    const Eigen::Vector3f p = (*exposure.T_head_enu * Point<Enu>{edge.p_enu}).xyz.cast<float>();
    fusion::Sight sight;
    if (!projector_.see(p.x(), p.y(), p.z(), has_image.data(), blind, sight)) continue;
    const GreyImage& image = images[sight.lens];
    if (image.pixels.empty()) continue;
    look(image, sight.x, sight.y, counts_.edges, counts_.missed);
    const double off = kShift * config_.radius_px;
    for (const auto& [dx, dy] : {std::pair{off, 0.0}, {-off, 0.0}, {0.0, off}, {0.0, -off}})
      look(image, sight.x + dx, sight.y + dy, counts_.places, counts_.missed_there);
  }
}

DepthEdges::Counts DepthEdges::finish() {
  for (const Waiting& exposure : waiting_) decide(exposure);
  waiting_.clear();
  return counts_;
}

}  // namespace hueline::survey
