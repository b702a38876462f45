#include "calibration/mount/calibration_watch.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
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
// How much of it changes from one part of a drive to another. Simulated streets show up to 0.01 px.
constexpr double kVaries_px = 0.005, kVaries_s = 2e-5;
constexpr double kTrial_px = 0.3, kTrial_s = 2e-3;  // sizes of the trials that show how the gradient answers
constexpr double kOver = 0.5;                       // share of its limit below which a reported drift is over

/// Returns the number of estimated standard deviations that a value exceeds as rarely as a normal one exceeds `sigmas`
/// true ones: Student's distribution by the approximation of Wallace (Annals of Mathematical Statistics 30, 1959).
double student(double sigmas, double freedom) {
  const double by = sigmas * (8 * freedom + 3) / (8 * freedom + 1);
  return std::sqrt(freedom * std::expm1(by * by / freedom));
}

/// Adds what stretches of a drive have in common to a covariance: a rotation that moves the images by `px`, and a time.
void add_common(const AlignmentLens& lens, double px, double s, Eigen::Matrix4d& covariance) {
  covariance.topLeftCorner<3, 3>().diagonal().array() += std::pow(px / lens.values.focal_px.mean(), 2);
  covariance(3, 3) += s * s;
}

}  // namespace

void CalibrationWatchConfig::visit(Keys& keys) {
  keys.number({"images_per_s", "1/s",
               "How many lens images a second are compared with the laser points around them, the lenses in turn; 2 "
               "notices small drifts within a minute. 0: nothing is watched."},
              images_per_s, {0, 20});
  keys.number({"window_s", "s",
               "The images of the last seconds are compared with the rig, and with those of the first five minutes of "
               "the drive. A drift is noticed within about this time."},
              window_s, {30, 600});
  keys.number({"least_turn_deg", "deg",
               "Smaller rotations of the head are not reported. Twice as large ones are noticed where images and laser "
               "show enough."},
              least_turn_deg, {0.001, 10});
  keys.number({"least_time_ms", "ms", "Smaller errors of the images' times are not reported."}, least_time_ms,
              {0.01, 1000});
  keys.number({"sigmas", "",
               "A drift is reported if it is so many times its own standard deviation, or more while the standard "
               "deviation is not well known: by Student's distribution."},
              sigmas, {3, 20});
}

KeyError CalibrationWatchConfig::validate() const {
  if (KeyError wrong = check_keys(*this); !wrong.empty()) return wrong;
  if (!(block_s > 0 && block_s * static_cast<double>(kFewestBlocks) <= window_s))
    return not_allowed("block_s", fmt::format("{}", block_s),
                       fmt::format("above 0, to 1/{} of window_s", kFewestBlocks));
  if (!(reference_s >= window_s)) return not_allowed("reference_s", fmt::format("{}", reference_s), "window_s or more");
  if (!(history_s >= 0)) return not_allowed("history_s", fmt::format("{}", history_s), "0 or more");
  if (!(blur_px >= 0.5 && blur_px <= 20)) return not_allowed("blur_px", fmt::format("{}", blur_px), "0.5 to 20 px");
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
  const BlurredImage picture(shot.image, static_cast<float>(config_.blur_px));
  const double by = axis < 3 ? kTrial_px / lenses_[shot.lens].values.focal_px.mean() : kTrial_s;
  const auto normals_at = [&](double amount) {
    HeadCorrection there = HeadCorrection::Zero();
    there[axis] = amount;
    return relation.normals(0, picture, corrected(T_body_head_, there), there[3]);
  };
  const HeadNormals less = normals_at(-by), more = normals_at(by);
  WatchedShot out;
  out.gradient = (less.gradient + more.gradient) / 2;
  out.response.col(axis) = 4 * (more.gradient - less.gradient) / (2 * by);
  out.patches = (less.patches + more.patches) / 2;
  return out;
}

bool CalibrationWatch::add(GpsTime exposure_mid, const WatchedShot& seen) {
  const bool is_complete = filling_ && exposure_mid - filling_->from >= from_seconds(config_.block_s);
  if (is_complete) complete_block();
  if (!filling_) filling_ = Block{exposure_mid, exposure_mid, {}};
  filling_->to = std::max(filling_->to, exposure_mid);
  filling_->sum += seen;
  return is_complete;
}

void CalibrationWatch::complete_block() {
  blocks_.push_back(*std::exchange(filling_, {}));
  while (blocks_.back().to - blocks_.front().from > from_seconds(config_.window_s + config_.history_s))
    blocks_.pop_front();
  // What leaves the window belongs to the beginning of the drive, until that is over or something has drifted.
  for (std::size_t i = 0; i < window_begin(); ++i) {
    if (std::exchange(blocks_[i].has_left, true) || is_reference_closed_) continue;
    reference_ += blocks_[i].sum;
    is_reference_closed_ = static_cast<double>(++reference_blocks_) * config_.block_s >= config_.reference_s;
  }
  drift_ = judge();
  is_reference_closed_ |= drift_ && drift_->has_changed;
}

/// Returns the index of the first stretch of the present window.
std::size_t CalibrationWatch::window_begin() const {
  std::size_t begin = blocks_.size();
  const GpsTime first = blocks_.back().to - from_seconds(config_.window_s);
  while (begin > 0 && blocks_[begin - 1].from >= first) --begin;
  return begin;
}

/// Estimates the scatter from the differences of neighbouring stretches. Each stretch is in two of them, which leaves
/// them two thirds of the degrees of freedom (von Neumann, Annals of Mathematical Statistics 12, 1941).
CalibrationWatch::Scatter CalibrationWatch::scatter() const {
  Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
  std::size_t count = 0;
  for (std::size_t i = 1; i < blocks_.size(); ++i) {
    const WatchedShot &before = blocks_[i - 1].sum, &after = blocks_[i].sum;
    if (before.patches == 0 || after.patches == 0) continue;
    const auto p = static_cast<double>(before.patches), q = static_cast<double>(after.patches);
    const Eigen::Vector4d by = after.gradient / q - before.gradient / p;
    sum += by * by.transpose() / (1 / p + 1 / q);
    ++count;
  }
  if (count + 1 < kFewestBlocks) return {Eigen::Matrix4d::Constant(std::nan("")), 0};
  return {sum / static_cast<double>(count), 2.0 / 3 * static_cast<double>(count)};
}

/// Returns whether one of the four parameters is beyond its limit and its uncertainty. One that was beyond them before
/// needs half of both.
bool CalibrationWatch::is_beyond(const HeadCorrection& by, const Eigen::Matrix4d& covariance, double sigmas,
                                 int axis) const {
  const double limit = axis < 3 ? config_.least_turn_deg * kRadPerDeg : config_.least_time_ms * 1e-3,
               share = drift_ && (axis < 3 ? drift_->has_turned : drift_->is_late) ? kOver : 1;
  return std::abs(by[axis]) > share * std::max(limit, sigmas * std::sqrt(covariance(axis, axis)));
}

std::optional<CalibrationDrift> CalibrationWatch::judge() const {
  const std::size_t begin = window_begin();
  CalibrationDrift out;
  out.to = blocks_.back().to;
  WatchedShot window, all;
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    all += blocks_[i].sum;
    if (i < begin) continue;
    if (i == begin) out.from = blocks_[i].from;
    window += blocks_[i].sum;
  }
  out.patches = window.patches;
  if (window.patches < config_.fewest_patches ||
      out.to - out.from < from_seconds(config_.window_s - 2 * config_.block_s))
    return std::nullopt;
  // The response of all stretches is the best known one.
  const Eigen::Matrix4d step = -(all.response / static_cast<double>(all.patches)).inverse();
  const Scatter known = scatter();
  const Eigen::Matrix4d of_patch = step * known.of_patch * step.transpose();
  if (!of_patch.allFinite()) return std::nullopt;
  out.needed_sigmas = student(config_.sigmas, known.freedom);
  const auto mean = [](const WatchedShot& sum) -> Eigen::Vector4d {
    return sum.gradient / static_cast<double>(sum.patches);
  };
  out.error = step * mean(window);
  out.covariance = of_patch / static_cast<double>(window.patches);
  if (reference_blocks_ >= kFewestBlocks && reference_.patches >= config_.fewest_patches) {
    out.change = step * (mean(window) - mean(reference_));
    out.change_covariance = out.covariance + of_patch / static_cast<double>(reference_.patches);
    add_common(lenses_[0], kVaries_px, kVaries_s, out.change_covariance);
  }
  add_common(lenses_[0], kCommon_px, kCommon_s, out.covariance);
  for (int axis = 0; axis < 4; ++axis) {
    const bool has_changed = is_beyond(out.change, out.change_covariance, out.needed_sigmas, axis);
    out.has_changed |= has_changed;
    (axis < 3 ? out.has_turned : out.is_late) |=
        has_changed || is_beyond(out.error, out.covariance, out.needed_sigmas, axis);
  }
  return out;
}

}  // namespace hueline::calibration
