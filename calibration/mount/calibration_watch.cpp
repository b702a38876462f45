#include "calibration/mount/calibration_watch.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "calibration/mount/intensity_relation.hpp"
#include "core/angle.hpp"

namespace hueline::calibration {
namespace {

constexpr std::size_t kFewestBlocks = 6;
constexpr double kMargin_deg = 0.5;  // beside the image; larger drifts are noticed as well
// Least sigma of what all images have in common: simulated drives show 0.03 to 0.1 px (head_adjustment.cpp), and 0.1
// ms.
constexpr double kCommon_px = 0.05, kCommon_s = 1e-4;
constexpr double kTrial_px = 0.3, kTrial_s = 2e-3;  // sizes of the trials that show how the gradient answers

GpsTime::duration seconds(double s) {
  return std::chrono::duration_cast<GpsTime::duration>(std::chrono::duration<double>(s));
}

}  // namespace

std::string CalibrationWatchConfig::validate() const {
  if (!(block_s > 0 && block_s <= 600)) return fmt::format("block_s is {}; allowed: above 0, to 600 s", block_s);
  if (!(window_s >= static_cast<double>(kFewestBlocks) * block_s && window_s <= 3600))
    return fmt::format("window_s is {}; allowed: {} times block_s to 3600 s", window_s, kFewestBlocks);
  if (!(least_turn_deg > 0 && least_time_ms > 0)) return "least_turn_deg and least_time_ms must be above 0";
  if (!(sigmas >= 1)) return fmt::format("sigmas is {}; allowed: 1 or more", sigmas);
  if (!(blur_px >= 0.5 && blur_px <= 20)) return fmt::format("blur_px is {}; allowed: 0.5 to 20 px", blur_px);
  return {};
}

CalibrationWatch::CalibrationWatch(std::vector<AlignmentLens> lenses, const Transform<Body, CameraHead>& T_body_head,
                                   const CalibrationWatchConfig& config)
    : lenses_(std::move(lenses)), T_body_head_(T_body_head), config_(config) {}

WatchedShot& WatchedShot::operator+=(const WatchedShot& other) {
  gradient += other.gradient;
  response += other.response;
  patches += other.patches;
  return *this;
}

WatchedShot CalibrationWatch::look_at(const AlignmentShot& shot, int axis) const {
  const std::vector<AlignmentShot> one{shot};
  const IntensityRelation relation(lenses_, one, T_body_head_, kMargin_deg);
  const double by = axis < 3 ? kTrial_px / lenses_[shot.lens].values.focal_px.mean() : kTrial_s;
  const auto normals_at = [&](double amount) {
    HeadCorrection there = HeadCorrection::Zero();
    there[axis] = amount;
    return relation.normals(0, corrected(T_body_head_, there), there[3], static_cast<float>(config_.blur_px));
  };
  const HeadNormals less = normals_at(-by), more = normals_at(by);
  WatchedShot out;
  out.gradient = (less.gradient + more.gradient) / 2;
  out.response.col(axis) = 4 * (more.gradient - less.gradient) / (2 * by);
  out.patches = (less.patches + more.patches) / 2;
  return out;
}

void CalibrationWatch::add(GpsTime exposure_mid, const WatchedShot& seen) {
  if (blocks_.empty() || exposure_mid - blocks_.back().from >= seconds(config_.block_s)) {
    const bool is_full =
        !blocks_.empty() && blocks_.back().to - blocks_.front().from >= seconds(config_.window_s - config_.block_s);
    if (is_full && !reference_) reference_ = estimate();
    blocks_.push_back({exposure_mid, exposure_mid, {}});
  }
  Block& block = blocks_.back();
  block.to = std::max(block.to, exposure_mid);
  block.sum += seen;
  while (block.to - blocks_.front().from > seconds(config_.window_s)) blocks_.pop_front();
}

std::optional<CalibrationWatch::Estimate> CalibrationWatch::estimate() const {
  if (blocks_.size() < kFewestBlocks) return std::nullopt;
  WatchedShot sum;
  for (const Block& block : blocks_) sum += block.sum;
  if (sum.patches < config_.fewest_patches) return std::nullopt;
  const Eigen::Matrix4d inverse = sum.response.inverse();
  if (!inverse.allFinite()) return std::nullopt;
  // Differences of the stretches from their share of the sum are their noise.
  Eigen::Matrix4d scatter = Eigen::Matrix4d::Zero();
  for (const Block& block : blocks_) {
    const Eigen::Vector4d left =
        block.sum.gradient - sum.gradient * (static_cast<double>(block.sum.patches) / static_cast<double>(sum.patches));
    scatter += left * left.transpose();
  }
  const auto count = static_cast<double>(blocks_.size());
  return Estimate{-inverse * sum.gradient, inverse * scatter * inverse.transpose() * (count / (count - 1)),
                  sum.patches};
}

std::optional<CalibrationDrift> CalibrationWatch::drift() const {
  const auto now = estimate();
  if (!now) return std::nullopt;
  CalibrationDrift out;
  out.from = blocks_.front().from;
  out.to = blocks_.back().to;
  out.patches = now->patches;
  out.error = now->error;
  out.covariance = now->covariance;
  out.covariance.topLeftCorner<3, 3>().diagonal().array() +=
      std::pow(kCommon_px / lenses_[0].values.focal_px.mean(), 2);
  out.covariance(3, 3) += kCommon_s * kCommon_s;
  if (reference_) {
    out.change = now->error - reference_->error;
    out.change_covariance = now->covariance + reference_->covariance;
  }
  const auto is_sure = [&](const HeadCorrection& by, const Eigen::Matrix4d& covariance, int axis) {
    const double limit = axis < 3 ? config_.least_turn_deg * kRadPerDeg : config_.least_time_ms * 1e-3;
    return std::abs(by[axis]) > std::max(limit, config_.sigmas * std::sqrt(covariance(axis, axis)));
  };
  for (int axis = 0; axis < 4; ++axis) {
    const bool is_off =
        is_sure(out.error, out.covariance, axis) || (reference_ && is_sure(out.change, out.change_covariance, axis));
    (axis < 3 ? out.has_turned : out.is_late) |= is_off;
  }
  return out;
}

}  // namespace hueline::calibration
