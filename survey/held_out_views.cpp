#include "survey/held_out_views.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "fusion/sight_sampler.hpp"

namespace hueline::survey {
namespace {

constexpr float kNearestView_m = 1.0f, kFarthestView_m = 150.0f;
constexpr float kBehind_m = 0.2f, kBehind_share = 0.05f;
constexpr std::size_t kMostWaitingViews = 32;  // exposures with their images
constexpr int kCells = 2;                      // of the coarse buffer, in the radius of a disc

fusion::Colouring::Config with_threads(fusion::Colouring::Config config, int threads) {
  config.threads = threads;
  return config;
}

fusion::CameraHeadGeometry without_masks(fusion::CameraHeadGeometry head) {
  for (fusion::LensMount& lens : head.lenses) lens.masks.clear();
  return head;
}

std::uint8_t to_byte(float value) { return static_cast<std::uint8_t>(std::clamp(value + 0.5f, 0.0f, 255.0f)); }

}  // namespace

HeldOutViews::HeldOutViews(const fusion::Colouring::Config& colouring, const fusion::RigGeometry& rig,
                           const Config& config, Sink sink)
    : config_(config),
      rig_(rig),
      sink_(std::move(sink)),
      projector_(config.every_lens ? without_masks(rig.head) : rig.head, fusion::ColourMethod::Lens),
      some_(config.every, colouring.together),
      colouring_(with_threads(colouring, config.threads), rig, [this](const CloudBlock& block) {
        for (const ColouredPoint& p : block.points)
          points_.push_back({p.time, p.east, p.north, p.up, {p.red, p.green, p.blue}, p.exposure != kNoExposure});
      }) {}

void HeldOutViews::on_exposure(const Exposure& exposure) {
  if (exposure.timing == ExposureTiming::Unmatched || !exposure.image.is_complete ||
      !some_.chooses(exposure.exposure_mid))
    return colouring_.add(exposure);
  waiting_.push_back({exposure.index, exposure.exposure_mid, exposure.camera, exposure.image, false, {}});
  if (waiting_.size() > kMostWaitingViews) waiting_.pop_front();
}

void HeldOutViews::on_settled_exposure(const Exposure& exposure, const fusion::Trajectory& trajectory) {
  const auto waiting = std::find_if(waiting_.begin(), waiting_.end(),
                                    [&](const Waiting& one) { return one.exposure == exposure.index; });
  if (waiting == waiting_.end()) return;
  waiting->is_settled = true;
  if (const auto [pose, reason] = trajectory.pose_at(waiting->mid); pose)
    waiting->T_head_enu = (pose->T_enu_body * rig_.head.T_body_head).inverse();
}

void HeldOutViews::on_watermark(GpsTime watermark) {
  colouring_.advance(watermark);
  colouring_.take_faults();  // the pipeline's own colouring tells them
  decide_ready(false);
}

void HeldOutViews::decide_ready(bool everything) {
  if (points_.empty()) return;
  const auto is_over = [&](const Waiting& one) {
    return everything || (one.is_settled && one.mid + config_.reach < points_.back().time);
  };
  for (; !waiting_.empty() && is_over(waiting_.front()); waiting_.pop_front()) decide(waiting_.front());
  GpsTime oldest = points_.back().time;
  if (!waiting_.empty()) oldest = std::min(oldest, waiting_.front().mid);
  while (points_.front().time < oldest - config_.reach) points_.pop_front();
}

void HeldOutViews::decide(const Waiting& exposure) {
  if (!exposure.T_head_enu) return;
  const Eigen::Matrix3f R_head_enu = exposure.T_head_enu->rotation.toRotationMatrix().cast<float>();
  const Eigen::Vector3d head_enu = exposure.T_head_enu->inverse().translation;
  std::vector<std::uint8_t> has_image;
  for (const SensorId camera : projector_.cameras()) has_image.push_back(camera == exposure.camera ? 1 : 0);
  const std::uint32_t blind = projector_.blind_lenses(exposure.camera, exposure.image.lost);
  std::vector<std::vector<Projected>> by_lens(rig_.head.lenses.size());
  for (const Held& point : points_) {
    if (std::chrono::abs(point.time - exposure.mid) > config_.reach) continue;
    const Eigen::Vector3f p =
        R_head_enu * (Eigen::Vector3d(point.east, point.north, point.up) - head_enu).cast<float>();
    const float distance = p.norm();
    if (distance < kNearestView_m || distance > kFarthestView_m) continue;
    fusion::Sight sight;
    if (config_.every_lens) {
      for (const fusion::FloatLens& lens : projector_.lenses())
        if (has_image[lens.camera] != 0 && (blind >> lens.index & 1) == 0 && lens.project(p.x(), p.y(), p.z(), sight))
          by_lens[lens.index].push_back({sight.x, sight.y, distance, &point});
    } else if (projector_.see(p.x(), p.y(), p.z(), has_image.data(), blind, sight)) {
      by_lens[sight.lens].push_back({sight.x, sight.y, distance, &point});
    }
  }
  for (std::size_t lens = 0; lens < by_lens.size(); ++lens)
    if (!by_lens[lens].empty()) predict(exposure, head_enu, static_cast<std::uint8_t>(lens), by_lens[lens]);
}

void HeldOutViews::predict(const Waiting& exposure, const Eigen::Vector3d& head_enu, std::uint8_t lens,
                           const std::vector<Projected>& points) {
  const fusion::LensMount& mount = rig_.head.lenses[lens];
  const fusion::RawView view = fusion::view_of(exposure.image);
  const auto width = static_cast<int>(mount.intrinsics.width), height = static_cast<int>(mount.intrinsics.height);
  if (view.data == nullptr || mount.x_offset + mount.intrinsics.width > view.width ||
      mount.y_offset + mount.intrinsics.height > view.height)
    return;
  const double disc_px = mount.intrinsics.focal_px.x() * config_.disc_deg * std::numbers::pi / 180;
  const int cell = std::max(1, static_cast<int>(std::lround(disc_px / kCells)));
  const int columns = (width - 1) / cell + 1, rows = (height - 1) / cell + 1;
  const auto reach = static_cast<int>(std::lround(disc_px / cell));
  nearest_.assign(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows),
                  std::numeric_limits<float>::max());
  const auto cell_of = [cell](float pixel) { return static_cast<int>(pixel + 0.5f) / cell; };
  const auto at = [columns](int column, int row) {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(column);
  };
  for (const Projected& p : points) {
    const int column = cell_of(p.x), row = cell_of(p.y);
    for (int j = std::max(-reach, -row); j <= std::min(reach, rows - 1 - row); ++j)
      for (int i = std::max(-reach, -column); i <= std::min(reach, columns - 1 - column); ++i) {
        if (i * i + j * j > reach * reach) continue;
        float& nearest = nearest_[at(column + i, row + j)];
        nearest = std::min(nearest, p.distance);
      }
  }
  winners_.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), nullptr);
  for (const Projected& p : points) {
    if (!p.point->is_coloured) continue;
    const float nearest = nearest_[at(cell_of(p.x), cell_of(p.y))];
    if (p.distance > nearest + kBehind_m + kBehind_share * nearest) continue;
    const Projected*& winner = winners_[static_cast<std::size_t>(p.y + 0.5f) * static_cast<std::size_t>(width) +
                                        static_cast<std::size_t>(p.x + 0.5f)];
    if (winner == nullptr || p.distance < winner->distance) winner = &p;
  }
  PredictedView out{exposure.exposure, lens, head_enu, {}};
  for (const Projected* p : winners_) {
    if (p == nullptr) continue;
    const fusion::Rgb seen = fusion::sample_lens(projector_.lenses()[lens], view, p->x, p->y);
    out.pixels.push_back({static_cast<std::uint16_t>(p->x + 0.5f),
                          static_cast<std::uint16_t>(p->y + 0.5f),
                          p->point->colour,
                          {to_byte(seen.red), to_byte(seen.green), to_byte(seen.blue)}});
  }
  sink_(out);
}

void HeldOutViews::finish() {
  colouring_.flush();
  decide_ready(true);
}

}  // namespace hueline::survey
