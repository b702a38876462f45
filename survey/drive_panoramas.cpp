#include "survey/drive_panoramas.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "fusion/head_motion.hpp"
#include "survey/latest_exposure.hpp"

namespace hueline::survey {
namespace {

using std::numbers::pi;
constexpr nanoseconds kPoseStep{500'000};
/// What the vehicle hides comes from the exposures before and after that are the nearest beyond these distances. The
/// far ones look at what lies behind the vehicle, which those on the way to it hide as well.
constexpr std::array kFill_m{3.0, 6.0, 12.0};
constexpr double kFillMost_m = 20.0;
constexpr nanoseconds kFillAround{4'000'000'000};

/// The view's axes in the local level (east, north, up), if its x axis points to `heading` and z up.
Eigen::Quaterniond level_view(double heading) {
  Eigen::Matrix3d R;
  R.col(0) = Eigen::Vector3d(std::sin(heading), std::cos(heading), 0);
  R.col(1) = Eigen::Vector3d(-std::cos(heading), std::sin(heading), 0);
  R.col(2) = Eigen::Vector3d::UnitZ();
  return Eigen::Quaterniond(R);
}

double heading_of(const Eigen::Vector3d& direction) {
  const double heading = std::atan2(direction.x(), direction.y());
  return heading < 0 ? heading + 2 * pi : heading;
}

}  // namespace

DrivePanoramas::DrivePanoramas(const config::Rig& rig, const Config& config, Use use)
    : rig_(rig),
      config_(config),
      use_(std::move(use)),
      renderer_(rig.geometry.head, config.rendering),
      pool_(config.threads),
      depth_(config.depth),
      width_(config.width > 0 ? config.width : renderer_.natural_width()) {}

void DrivePanoramas::on_settled_laser(const StampedLaserBatch& batch, const fusion::Trajectory& trajectory) {
  const GpsTime now = batch.time;
  const auto& lasers = rig_.geometry.lasers;
  const auto mount =
      std::find_if(lasers.begin(), lasers.end(), [&](const auto& one) { return one.sensor == batch.sensor; });
  if (mount != lasers.end()) {
    georeference(batch, *mount, trajectory, kPoseStep, georeferenced_);
    const Transform<CameraHead, Scanner> T_head_scanner =
        rig_.geometry.head.T_body_head.inverse() * mount->T_body_scanner;
    Placed placed;
    placed.time = batch.time;
    for (std::size_t i = 0; i < georeferenced_.size(); ++i) {
      const LaserReturn& one = batch.returns[georeferenced_.source[i]];
      if (one.range_m < config_.own_vehicle_m &&
          !renderer_.is_seen(T_head_scanner * Point<Scanner>{{one.x, one.y, one.z}}))
        continue;
      const Eigen::Vector3d p(georeferenced_.east[i], georeferenced_.north[i], georeferenced_.up[i]);
      if (placed.points.empty()) placed.base_enu = p;
      placed.points.push_back((p - placed.base_enu).cast<float>());
    }
    if (!placed.points.empty()) {
      // Two scanners' packets may overtake each other.
      auto after = placed_.end();
      while (after != placed_.begin() && std::prev(after)->time > now) --after;
      placed_.insert(after, std::move(placed));
    }
  }
  while (!placed_.empty() && placed_.front().time < now - kLatestExposure - config_.around - kFillAround &&
         (moments_.empty() || placed_.front().time < moments_.front().time - config_.around))
    placed_.pop_front();
  find_motions(trajectory, now);
  make_ready(now - (fills() ? std::max(config_.around, kFillAround) : config_.around));
}

void DrivePanoramas::on_exposure(const Exposure& exposure) {
  const auto& cameras = renderer_.cameras();
  const auto camera = std::find(cameras.begin(), cameras.end(), exposure.camera);
  if (camera == cameras.end() || !wants_more_) return;
  if (!config_.choice.numbers.empty()) exposures_.insert(exposure.index);
  if (exposure.timing == ExposureTiming::Unmatched) {
    ++counts_.without_time;
    return;
  }
  if (!exposure.image.is_complete || !fusion::view_of(exposure.image).data) {
    ++counts_.incomplete;
    return;
  }
  const auto index = static_cast<std::size_t>(camera - cameras.begin());
  const GpsTime time = exposure.exposure_mid;
  const auto together = [&](const Moment& moment) {
    const nanoseconds apart = moment.time > time ? moment.time - time : time - moment.time;
    return apart <= rig_.colouring.together && moment.images[index].width == 0;
  };
  auto moment = std::find_if(moments_.rbegin(), moments_.rend(), together);
  if (moment == moments_.rend()) {
    Moment fresh;
    fresh.exposure = exposure.index;
    fresh.time = time;
    fresh.sigma = exposure.sigma;
    fresh.images.resize(cameras.size());
    const auto& choice = config_.choice;
    fresh.is_chosen = counts_.moments++ % static_cast<std::uint64_t>(choice.every) == 0 && choice.numbers.empty() &&
                      choice.has_time(time);
    auto at = moments_.end();
    while (at != moments_.begin() && std::prev(at)->time > time) --at;
    moment = std::make_reverse_iterator(std::next(moments_.insert(at, std::move(fresh))));
  }
  const auto& choice = config_.choice;
  if (!choice.numbers.empty() && choice.has_number(exposure.index) && choice.has_time(time)) moment->is_chosen = true;
  moment->exposure = std::min(moment->exposure, exposure.index);
  Image& image = moment->images[index];
  image = exposure.image;
  moment->low.clear();  // a panorama that filled from this moment may have made them without this image
  // The other cameras of a moment may have the chosen number.
  if (!moment->is_chosen && !fills() && (choice.numbers.empty() || cameras.size() == 1)) image.buffer = {};
  const auto& lenses = rig_.geometry.head.lenses;
  for (std::size_t i = 0; i < lenses.size(); ++i)
    if (lenses[i].camera == exposure.camera)
      moment->motion.lateness[i] = fusion::lateness_at(exposure, lenses[i], moment->time);
  moment->blind |= renderer_.blind_lenses(exposure.camera, exposure.image.lost);
  const std::size_t bytes = image.buffer.bytes().size();
  moment->bytes += bytes;
  waiting_bytes_ += bytes;
  while (waiting_bytes_ > config_.most_waiting_bytes && moments_.front().is_settled) {
    if (!moments_.front().is_done) {
      if (moments_.front().is_chosen) ++counts_.early;
      make(0);
    }
    forget_front();
  }
}

void DrivePanoramas::on_settled_exposure(const Exposure& exposure, const fusion::Trajectory& trajectory) {
  for (Moment& moment : moments_) {
    const nanoseconds apart =
        moment.time > exposure.exposure_mid ? moment.time - exposure.exposure_mid : exposure.exposure_mid - moment.time;
    if (apart > rig_.colouring.together || moment.is_settled) continue;
    moment.is_settled = true;
    moment.pose = trajectory.pose_at(moment.time).pose;
  }
  find_motions(trajectory, exposure.exposure_mid);
  if (!config_.use_depth) make_ready(exposure.exposure_mid - rig_.colouring.together);
}

/// Finds out how the head moved at the moments around which the poses are final: those to `reached` are.
void DrivePanoramas::find_motions(const fusion::Trajectory& trajectory, GpsTime reached) {
  for (Moment& moment : moments_) {
    if (moment.has_motion || moment.time + fusion::kMotionAround > reached) continue;
    const auto lateness = moment.motion.lateness;
    moment.motion = fusion::motion_at(trajectory, moment.time, rig_.geometry.head.T_body_head);
    moment.motion.lateness = lateness;
    moment.has_motion = true;
  }
}

void DrivePanoramas::make_ready(GpsTime reached) {
  for (std::size_t i = 0; i < moments_.size() && moments_[i].is_settled && moments_[i].time < reached; ++i)
    if (!moments_[i].is_done) make(i);
  // Later panoramas may need the images of earlier moments.
  const nanoseconds kept = fills() ? kFillAround : nanoseconds(0);
  while (!moments_.empty() && moments_.front().is_done && moments_.front().time < reached - kept) forget_front();
}

void DrivePanoramas::forget_front() {
  waiting_bytes_ -= moments_.front().bytes;
  moments_.pop_front();
}

std::vector<std::size_t> DrivePanoramas::neighbours(std::size_t index) const {
  const Moment& own = moments_[index];
  const auto place = [&](const Moment& moment) {
    return (moment.pose->T_enu_body * rig_.geometry.head.T_body_head).translation;
  };
  std::vector<std::size_t> out;
  for (const double least : kFill_m)
    for (const int step : {-1, 1})
      for (auto i = static_cast<std::ptrdiff_t>(index) + step; i >= 0 && i < std::ssize(moments_); i += step) {
        const Moment& other = moments_[static_cast<std::size_t>(i)];
        const nanoseconds apart = other.time > own.time ? other.time - own.time : own.time - other.time;
        if (apart > kFillAround || !other.pose) continue;
        const double away = (place(other) - place(own)).norm();
        if (away > kFillMost_m) break;
        if (away < least) continue;
        if (std::find(out.begin(), out.end(), static_cast<std::size_t>(i)) == out.end())
          out.push_back(static_cast<std::size_t>(i));
        break;
      }
  return out;
}

std::vector<fusion::RawView> DrivePanoramas::views(const Moment& moment) const {
  std::vector<fusion::RawView> out;
  for (const Image& image : moment.images)
    out.push_back(image.width > 0 && !image.buffer.bytes().empty() ? fusion::view_of(image) : fusion::RawView{});
  return out;
}

/// Returns the images of a moment as the renderer takes them, from the panorama's own place.
fusion::HeadShot DrivePanoramas::shot_of(Moment& moment, const std::vector<fusion::RawView>& images) {
  if (moment.low.empty()) moment.low = renderer_.low_images(images, pool_);
  return {images, moment.blind, {}, moment.low, moment.motion};
}

std::size_t DrivePanoramas::gather(const Moment& moment, const Transform<Enu, CameraHead>& T_enu_view) {
  std::vector<Eigen::Vector3f> points;
  const Eigen::Matrix3d R = T_enu_view.rotation.conjugate().toRotationMatrix();
  const Eigen::Matrix3f R_float = R.cast<float>();
  for (const Placed& placed : placed_) {
    if (placed.time < moment.time - config_.around || placed.time > moment.time + config_.around) continue;
    const Eigen::Vector3f base = (R * (placed.base_enu - T_enu_view.translation)).cast<float>();
    for (const Eigen::Vector3f& p : placed.points) points.push_back(R_float * p + base);
  }
  depth_.clear();
  depth_.add(points, pool_);
  return points.size();
}

void DrivePanoramas::make(std::size_t index) {
  moments_[index].is_done = true;
  Moment& moment = moments_[index];
  if (!moment.is_chosen || !wants_more_) return;
  ++counts_.chosen;
  if (!moment.pose || !origin_) {
    ++counts_.without_pose;
    return;
  }
  DrivePanorama out;
  out.exposure = moment.exposure;
  out.time = moment.time;
  out.sigma = moment.sigma;
  const auto& head = rig_.geometry.head;
  const Transform<Enu, CameraHead> T_enu_head = moment.pose->T_enu_body * head.T_body_head;
  out.origin = *origin_;
  out.centre_enu = {T_enu_head.translation};
  out.sigma_horizontal_m = std::hypot(moment.pose->sigma_position.x(), moment.pose->sigma_position.y());
  out.sigma_up_m = moment.pose->sigma_position.z();
  // The level at the head is not that of the drive's origin: a kilometre away they differ by half a minute of arc.
  const Transform<Ecef, Enu> T_ecef_enu = ecef_from_enu(*origin_);
  out.centre = to_geodetic(T_ecef_enu * out.centre_enu);
  const Eigen::Quaterniond R_level_enu = ecef_from_enu(out.centre).rotation.conjugate() * T_ecef_enu.rotation;
  const Eigen::Quaterniond R_level_head = R_level_enu * T_enu_head.rotation;
  out.head_heading = heading_of(R_level_head * Eigen::Vector3d::UnitX());

  fusion::PanoramaView view;
  view.shape.width = width_;
  view.shape.height = width_ / 2;
  out.is_level = config_.orientation != PanoramaOrientation::Head;
  if (!out.is_level) {
    const auto& shape = head.panorama;
    view.shape.forward_column = (shape.forward() + 0.5) * width_ / shape.width - 0.5;
    view.shape.is_clockwise = shape.is_clockwise;
    const Eigen::Vector3d middle =
        fusion::Panorama(view.shape).direction_of({(view.shape.width - 1) / 2.0, (view.shape.height - 1) / 2.0}).xyz;
    const Eigen::Quaterniond R_head_middle(
        Eigen::AngleAxisd(std::atan2(middle.y(), middle.x()), Eigen::Vector3d::UnitZ()));
    const Eigen::Matrix3d R = (R_level_head * R_head_middle).toRotationMatrix();
    out.heading = heading_of(R.col(0));
    out.pitch = std::asin(std::clamp(R(2, 0), -1.0, 1.0));
    out.roll = std::atan2(R(2, 1), R(2, 2));
  } else {
    out.heading = config_.orientation == PanoramaOrientation::North ? 0 : out.head_heading;
    view.R_head_view = R_level_head.conjugate() * level_view(out.heading);
  }
  if (config_.use_depth) {
    out.points = gather(moment, {T_enu_head.rotation * view.R_head_view, T_enu_head.translation});
    depth_.close(pool_);
    out.known_share = depth_.known_share();
  }
  const std::vector<fusion::RawView> images = views(moment);
  std::vector<std::vector<fusion::RawView>> other_images;
  std::vector<fusion::HeadShot> others;
  if (fills()) {
    const std::vector<std::size_t> near = neighbours(index);
    for (const std::size_t i : near) other_images.push_back(views(moments_[i]));
    for (std::size_t i = 0; i < near.size(); ++i) {
      Moment& other = moments_[near[i]];
      others.push_back(shot_of(other, other_images[i]));
      others.back().T_shot_head = (other.pose->T_enu_body * head.T_body_head).inverse() * T_enu_head;
    }
  }
  out.rendered = renderer_.render(view, shot_of(moment, images), others, config_.use_depth ? &depth_ : nullptr, pool_);
  out.view = view;
  ++counts_.made;
  wants_more_ = use_(std::move(out));
}

std::optional<std::uint32_t> DrivePanoramas::missing_number() const {
  return config_.choice.missing_number(exposures_);
}

void DrivePanoramas::finish() {
  for (std::size_t i = 0; i < moments_.size(); ++i)
    if (!moments_[i].is_done) make(i);
  moments_.clear();
}

}  // namespace hueline::survey
