#include "runtime/drive_watch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <memory>
#include <numbers>
#include <utility>

#include "core/angle.hpp"
#include "core/calendar.hpp"
#include "core/portable_math.hpp"
#include "fusion/lens_exposure.hpp"
#include "runtime/lens_image.hpp"
#include "runtime/lens_values.hpp"

namespace hueline::runtime {

using namespace calibration;

namespace {

constexpr nanoseconds kReach{150'000'000};  // returns are used so long before and after an exposure
constexpr nanoseconds kAround{10'000'000};  // so far around an exposure its motion is measured
constexpr std::uint32_t kMostWidth = 650;   // px
constexpr std::size_t kMostSamples = 100'000, kMostReturns = 4'000'000, kMostShots = 64;
constexpr float kNearest_m = 2, kFarthest_m = 80;  // nearer there is the own vehicle
// A slower vehicle shows the same again, which is no new evidence.
constexpr double kLeastSpeed = 1;

std::vector<AlignmentLens> lenses_of(const fusion::RigGeometry& rig) {
  std::vector<AlignmentLens> out;
  for (const fusion::LensMount& lens : rig.head.lenses) out.push_back(alignment_lens(lens, cell_for(lens, kMostWidth)));
  return out;
}

/// Returns for each reflectivity the share of weaker returns, because each scanner has its own scale.
std::array<float, 256> ranks_of(const std::array<std::size_t, 256>& counts) {
  std::array<float, 256> out{};
  std::size_t all = 0, below = 0;
  for (const std::size_t count : counts) all += count;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    out[i] = static_cast<float>(2 * below + counts[i]) / static_cast<float>(2 * std::max<std::size_t>(1, all));
    below += counts[i];
  }
  return out;
}

constexpr int kRowSteps = 3;  // how often the row of a point is corrected; each step leaves a twentieth of the error

/// Moves static points from where they are in Body at the middle of an exposure to where they are while their own row
/// is exposed, which is `row_time_s` later for each row below the middle one.
void move_to_rows(const AlignmentLens& lens, const Transform<Body, CameraHead>& T_body_head, double row_time_s,
                  const AlignmentShot& shot, std::vector<LaserSample>& samples) {
  const FastLens fast = fast_lens(lens, T_body_head.inverse(), shot, 0);
  const Eigen::Vector3f velocity = shot.velocity_body.cast<float>(), rate = shot.turn_rate_body.cast<float>();
  const auto row_s = static_cast<float>(row_time_s), middle = (static_cast<float>(lens.values.height) - 1) / 2;
  for (LaserSample& sample : samples) {
    const Eigen::Vector3f p = sample.p_body, by = velocity + rate.cross(p);
    float u, v;
    for (int step = 0; step < kRowSteps && fast.project(sample.p_body, u, v); ++step)
      sample.p_body = p - by * (row_s * (v - middle));
  }
}

/// A vector or its part as people read it, with its standard deviation along itself.
struct Size {
  double value, sigma;
};
Size size_of_turn(const HeadCorrection& by, const Eigen::Matrix4d& covariance) {
  const Eigen::Vector3d along = by.head<3>().normalized();
  return {by.head<3>().norm() * kDegPerRad,
          std::sqrt(along.dot(covariance.topLeftCorner<3, 3>() * along)) * kDegPerRad};
}

}  // namespace

DriveWatch::DriveWatch(const fusion::RigGeometry& rig, const CalibrationWatchConfig& config)
    : rig_(rig), config_(config), watch_(lenses_of(rig), rig.head.T_body_head, config) {}

void DriveWatch::add(const Exposure& exposure) {
  if (exposure.timing == ExposureTiming::Unmatched || !exposure.image.is_complete || rig_.head.lenses.empty()) return;
  const std::size_t lenses = rig_.head.lenses.size();
  const double passed = last_exposure_ ? to_seconds(exposure.exposure_mid - *last_exposure_) : 0;
  last_exposure_ = exposure.exposure_mid;
  allowed_ = std::min(allowed_ + std::max(0.0, passed) * config_.images_per_s, static_cast<double>(lenses));
  for (std::size_t looked_at = 0; looked_at < lenses && allowed_ >= 1; ++turn_, ++looked_at) {
    // The lens in turn is waited for, but not for ever: its camera may be gone.
    const bool waits = allowed_ < static_cast<double>(lenses);
    if (rig_.head.lenses[turn_ % lenses].camera != exposure.camera) {
      if (waits) return;
      continue;
    }
    const std::size_t index = turn_ % lenses;
    const fusion::LensMount& lens = rig_.head.lenses[index];
    allowed_ -= 1;
    Waiting waiting;
    waiting.mid = exposure.exposure_mid + fusion::lateness_of(exposure, lens);
    waiting.lens = index;
    waiting.axis = static_cast<int>((turn_ / lenses + index) % 4);
    waiting.image = grey_lens_image(exposure.image, lens, cell_for(lens, kMostWidth));
    if (waiting.image.pixels.empty()) continue;
    waiting_.push_back(std::move(waiting));
    if (waiting_.size() <= kMostShots) continue;
    waiting_.pop_front();
    ++report_.dropped;
  }
}

void DriveWatch::add(const StampedLaserBatch& batch) {
  const auto laser = std::find_if(rig_.lasers.begin(), rig_.lasers.end(),
                                  [&](const fusion::LaserMount& one) { return one.sensor == batch.sensor; });
  if (laser == rig_.lasers.end() || batch.returns.empty() || batch.time < watermark_ - kReach) return;
  std::int32_t last = 0;
  for (const LaserReturn& r : batch.returns) last = std::max(last, r.time_offset_ns);
  Batch out;
  out.time = batch.time + nanoseconds(last / 2);
  out.laser = static_cast<std::size_t>(laser - rig_.lasers.begin());
  out.returns.reserve(batch.returns.size());
  for (const LaserReturn& r : batch.returns)
    if (r.range_m >= kNearest_m && r.range_m <= kFarthest_m)
      out.returns.push_back({{r.x, r.y, r.z}, r.time_offset_ns - last / 2, r.reflectivity});
  held_returns_ += out.returns.size();
  // Two scanners' packets may overtake each other.
  auto after = batches_.end();
  while (after != batches_.begin() && std::prev(after)->time > out.time) --after;
  settled_ = std::min(settled_, static_cast<std::size_t>(after - batches_.begin()));
  batches_.insert(after, std::move(out));
  forget();
}

void DriveWatch::forget() {
  GpsTime oldest = watermark_;
  if (!waiting_.empty()) oldest = std::min(oldest, waiting_.front().mid);
  while (!batches_.empty() && (batches_.front().time < oldest - kReach || held_returns_ > kMostReturns)) {
    held_returns_ -= batches_.front().returns.size();
    batches_.pop_front();
    settled_ -= settled_ > 0 ? 1 : 0;
  }
}

/// Takes the poses that are settled now. Later the trajectory may have forgotten them.
void DriveWatch::settle(const fusion::Trajectory& trajectory, const std::function<bool(GpsTime)>& is_settled) {
  for (; settled_ < batches_.size() && is_settled(batches_[settled_].time); ++settled_)
    if (Batch& batch = batches_[settled_]; !std::exchange(batch.is_settled, true))
      batch.pose = trajectory.pose_at(batch.time).pose;
  for (Waiting& one : waiting_) {
    if (one.is_settled || !is_settled(one.mid + kAround)) continue;
    one.is_settled = true;
    const auto here = trajectory.pose_at(one.mid).pose, before = trajectory.pose_at(one.mid - kAround).pose,
               after = trajectory.pose_at(one.mid + kAround).pose;
    if (!here || !before || !after || here->velocity_enu.norm() < kLeastSpeed) continue;
    const Eigen::Vector3d turn =
        portable::rotation_vector(before->T_enu_body.rotation.conjugate() * after->T_enu_body.rotation);
    const Transform<Body, Enu> T_body_enu = here->T_enu_body.inverse();
    one.motion = Motion{T_body_enu, T_body_enu.rotation * here->velocity_enu, turn / (2 * to_seconds(kAround))};
  }
}

void DriveWatch::advance(GpsTime watermark, const fusion::Trajectory& trajectory,
                         const std::function<bool(GpsTime)>& is_settled) {
  watermark_ = std::max(watermark_, watermark);
  settle(trajectory, is_settled);
  while (!waiting_.empty() && waiting_.front().is_settled) {
    const GpsTime end = waiting_.front().mid + kReach;
    if (watermark_ < end || !is_settled(end)) return;
    look(std::move(waiting_.front()));
    waiting_.pop_front();
  }
}

std::vector<LaserSample> DriveWatch::samples_around(GpsTime mid, const Transform<Body, Enu>& T_body_enu) const {
  const auto begin = std::lower_bound(batches_.begin(), batches_.end(), mid - kReach,
                                      [](const Batch&one, GpsTime time) { return one.time < time; }),
             end = std::lower_bound(begin, batches_.end(), mid + kReach,
                                    [](const Batch&one, GpsTime time) { return one.time < time; });
  std::size_t count = 0;
  std::vector<std::array<std::size_t, 256>> counts(rig_.lasers.size());
  for (auto batch = begin; batch != end; ++batch) {
    count += batch->returns.size();
    for (const Return& r : batch->returns) ++counts[batch->laser][r.reflectivity];
  }
  std::vector<std::array<float, 256>> ranks;
  for (const auto& one : counts) ranks.push_back(ranks_of(one));
  const std::size_t stride = count / kMostSamples + 1;
  std::vector<LaserSample> out;
  out.reserve(count / stride + 1);
  std::size_t at = 0;
  for (auto batch = begin; batch != end; ++batch) {
    if (!batch->pose) continue;
    const Transform<Body, Scanner> T = T_body_enu * batch->pose->T_enu_body * rig_.lasers[batch->laser].T_body_scanner;
    const Eigen::Matrix3f R = T.rotation.toRotationMatrix().cast<float>();
    const Eigen::Vector3f p = T.translation.cast<float>(),
                          velocity = (T_body_enu.rotation * batch->pose->velocity_enu).cast<float>();
    const auto apart_s = static_cast<float>(to_seconds(batch->time - mid));
    for (const Return& r : batch->returns)
      if (at++ % stride == 0)
        out.push_back({R * r.p_scanner + p + velocity * (static_cast<float>(r.time_offset_ns) * 1e-9F),
                       ranks[batch->laser][r.reflectivity], 0, apart_s});
  }
  return out;
}

void DriveWatch::look(Waiting&& waiting) {
  if (!waiting.motion) {
    ++report_.standing;
    return;
  }
  const Motion& motion = *waiting.motion;
  AlignmentShot shot;
  shot.lens = waiting.lens;
  shot.image = std::move(waiting.image);
  shot.velocity_body = motion.velocity_body;
  shot.turn_rate_body = motion.turn_rate_body;
  std::vector<LaserSample> samples = samples_around(waiting.mid, motion.T_body_enu);
  if (const fusion::LensMount& lens = rig_.head.lenses[waiting.lens]; lens.row_time != nanoseconds(0)) {
    const int cell = cell_for(lens, kMostWidth);
    move_to_rows(alignment_lens(lens, cell), rig_.head.T_body_head, cell * to_seconds(lens.row_time), shot, samples);
  }
  shot.samples = std::make_shared<const std::vector<LaserSample>>(std::move(samples));
  const WatchedShot seen = watch_.look_at(shot, waiting.axis);
  ++report_.images;
  report_.patches += seen.patches;
  if (watch_.add(waiting.mid, seen) && watch_.drift()) tell();
}

/// Tells what the window that has just been judged shows, if it is new.
void DriveWatch::tell() {
  const CalibrationDrift& drift = *watch_.drift();
  ++report_.windows;
  report_.last = drift;
  const bool has_turned = !std::exchange(was_turned_, drift.has_turned) && drift.has_turned,
             is_late = !std::exchange(was_late_, drift.is_late) && drift.is_late;
  const HeadCorrection& by = drift.has_changed ? drift.change : drift.error;
  const Eigen::Matrix4d& covariance = drift.has_changed ? drift.change_covariance : drift.covariance;
  const std::string when = fmt::format("between {} and {}", iso_utc(drift.from), iso_utc(drift.to));
  const auto say = [&](std::string what) {
    ++report_.drifts;
    faults_.push_back({rig_.head.lenses.front().camera, FaultKind::Implausible, {}, 1, std::move(what)});
  };
  if (has_turned) {
    const Size size = size_of_turn(by, covariance);
    say(
        fmt::format("the head {} by {:.3f} +- {:.3f} deg (about its x, y, z by {:.3f}, {:.3f}, {:.3f} deg), by images "
                    "and laser {}: check how it is mounted, and calibrate it again",
                    drift.has_changed ? "has turned since the beginning of the drive" : "is turned against the rig",
                    size.value, size.sigma, by.x() * kDegPerRad, by.y() * kDegPerRad, by.z() * kDegPerRad, when));
  }
  if (is_late)
    say(
        fmt::format("the images {} {:.3f} +- {:.3f} ms {} than their times, by images and laser {}: check strobe and "
                    "event input, `strobe_delay_us` and `exposure_us`",
                    drift.has_changed ? "have become" : "are", std::abs(by[3]) * 1e3, std::sqrt(covariance(3, 3)) * 1e3,
                    by[3] > 0 ? "later" : "earlier", when));
}

std::vector<Fault> DriveWatch::take_faults() { return std::exchange(faults_, {}); }

}  // namespace hueline::runtime
