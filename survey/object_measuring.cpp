#include "survey/object_measuring.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "core/angle.hpp"
#include "survey/latest_exposure.hpp"

namespace hueline::survey {
namespace {

/// A panorama whose time differs more from that of the drive's exposure is of another drive, or of a recording whose
/// exposures are numbered from elsewhere. The strobe delay of another rig moves it by less.
constexpr nanoseconds kSameExposure{20'000'000};

}  // namespace

std::string ObjectMeasuring::Config::validate() const {
  if (around < nanoseconds(10'000'000) || around > nanoseconds(600'000'000'000))
    return fmt::format("around is {} s; allowed: 0.01 to 600 s", to_seconds(around));
  if (!(pick_sigma_px > 0 && pick_sigma_px <= 100))
    return fmt::format("pick_sigma_px is {}; allowed: above 0 to 100 px", pick_sigma_px);
  if (!(turn_sigma_deg >= 0 && turn_sigma_deg <= 10))
    return fmt::format("turn_sigma_deg is {}; allowed: 0 to 10 deg", turn_sigma_deg);
  return surface.validate();
}

ObjectMeasuring::ObjectMeasuring(const config::Rig& rig, const std::vector<ObjectPick>& picks, const Config& config,
                                 const std::map<std::uint32_t, ListedPanorama>& panoramas)
    : rig_(rig), config_(config), panorama_(rig.geometry.head) {
  for (const ObjectPick& pick : picks) {
    Looking looking;
    looking.outcome.pick = pick;
    aim(looking, panoramas);
    shots_[pick.exposure].looking.push_back(looking_.size());
    looking_.push_back(std::move(looking));
  }
}

/// From the pixel to a lens and a direction in it.
void ObjectMeasuring::aim(Looking& looking, const std::map<std::uint32_t, ListedPanorama>& panoramas) const {
  const ObjectPick& pick = looking.outcome.pick;
  const auto& head = rig_.geometry.head;
  const auto made = panoramas.find(pick.exposure);
  const auto& shape = made == panoramas.end() ? head.panorama : made->second.view.shape;
  looking.outcome.lens_pixel = pick.pixel;
  fusion::LensPixel at{0, pick.pixel};
  double pixel_rad = std::numbers::pi / shape.height;
  if (pick.lens.empty()) {
    if (!panoramas.empty() && made == panoramas.end()) {
      looking.why_not = fmt::format("the table of panoramas has no exposure {}", pick.exposure);
      return;
    }
    if (!(pick.pixel.x() >= -0.5 && pick.pixel.x() < shape.width - 0.5 && pick.pixel.y() >= -0.5 &&
          pick.pixel.y() < shape.height - 0.5)) {
      looking.why_not = fmt::format("the pixel lies outside the panorama of {} x {}", shape.width, shape.height);
      return;
    }
    if (made != panoramas.end()) {
      looking.drawn = made->second.time;
      looking.direction_lens = made->second.view.R_head_view * fusion::Panorama(shape).direction_of(pick.pixel).xyz;
      looking.ray.sigma = std::hypot(config_.pick_sigma_px * pixel_rad, config_.turn_sigma_deg * kRadPerDeg);
      return;
    }
    const auto found = panorama_.lens_pixel(pick.pixel);
    if (!found) {
      looking.why_not = "no lens sees that part of the panorama";
      return;
    }
    at = *found;
  } else {
    const auto lens =
        std::find_if(head.lenses.begin(), head.lenses.end(), [&](const auto& one) { return one.name == pick.lens; });
    if (lens == head.lenses.end()) {
      looking.why_not = fmt::format("the rig has no lens '{}'; it has", pick.lens);
      for (const auto& one : head.lenses) looking.why_not += " " + one.name;  // no commas: it is a cell of a table
      return;
    }
    at.lens = static_cast<int>(lens - head.lenses.begin());
  }
  const auto& lens = head.lenses[static_cast<std::size_t>(at.lens)];
  looking.lens = at.lens;
  looking.outcome.lens = lens.name;
  looking.outcome.lens_pixel = at.pixel;
  const fusion::CameraModel model(lens.intrinsics);
  const auto direction = model.unproject(at.pixel);
  if (!direction || !model.in_image(at.pixel)) {
    looking.why_not = fmt::format("the pixel lies outside the image or the field of view of lens '{}'", lens.name);
    return;
  }
  looking.direction_lens = direction->xyz;
  if (!pick.lens.empty()) {
    const auto beside =
        model.unproject(at.pixel + Eigen::Vector2d(at.pixel.x() < lens.intrinsics.width / 2.0 ? 1 : -1, 0));
    pixel_rad = beside ? std::acos(std::min(1.0, beside->xyz.dot(direction->xyz))) : 1 / lens.intrinsics.focal_px.x();
  }
  looking.ray.sigma = std::hypot(config_.pick_sigma_px * pixel_rad, config_.turn_sigma_deg * kRadPerDeg);
}

/// With the head's pose: where its picks look, and what has been seen there so far.
void ObjectMeasuring::on_settled_exposure(const Exposure& exposure, const fusion::Trajectory& trajectory) {
  const auto found = shots_.find(exposure.index);
  if (found == shots_.end() || found->second.exposed) return;
  Shot& shot = found->second;
  shot.exposed = exposure.exposure_mid;
  const auto pose = trajectory.pose_at(exposure.exposure_mid);
  for (const std::size_t i : shot.looking) {
    Looking& looking = looking_[i];
    looking.outcome.exposed = exposure.exposure_mid;
    if (!looking.why_not.empty()) continue;
    const auto& head = rig_.geometry.head;
    const fusion::LensMount* lens = looking.lens < 0 ? nullptr : &head.lenses[static_cast<std::size_t>(looking.lens)];
    if (exposure.timing == ExposureTiming::Unmatched) {
      looking.why_not = "nothing tells when that exposure was";
    } else if (looking.drawn && abs(*looking.drawn - exposure.exposure_mid) > kSameExposure) {
      looking.why_not = fmt::format(
          "the panorama was taken at GPS time {:.3f} s and exposure {} of this drive at {:.3f} s: the table of "
          "panoramas "
          "belongs to another drive",
          static_cast<double>(count_ns(*looking.drawn)) * 1e-9, exposure.index,
          static_cast<double>(count_ns(exposure.exposure_mid)) * 1e-9);
    } else if (!pose.pose) {
      looking.why_not = fmt::format("no pose for the exposure: {}", fusion::name(pose.reason));
    } else if (lens && lens->camera != exposure.camera) {
      looking.why_not = fmt::format("exposure {} is of another camera than lens '{}'", exposure.index, lens->name);
    } else {
      const Transform<Enu, CameraHead> T_enu_head = pose.pose->T_enu_body * head.T_body_head;
      const Transform<Enu, Lens> T_enu_lens =
          lens ? T_enu_head * lens->T_head_lens : Transform<Enu, Lens>{T_enu_head.rotation, T_enu_head.translation};
      looking.ray.from_enu = T_enu_lens.translation;
      looking.ray.direction_enu = T_enu_lens.rotation * looking.direction_lens;
    }
  }
  for (const Held& point : held_) look(shot, point);
}

void ObjectMeasuring::look(const Shot& shot, const Held& point) {
  const nanoseconds after = point.time - *shot.exposed;
  if (after > config_.around || after < -config_.around) return;
  for (const std::size_t i : shot.looking) {
    Looking& looking = looking_[i];
    if (!looking.why_not.empty()) continue;
    const Eigen::Vector3d to = point.p_enu - looking.ray.from_enu;
    const double ahead = to.dot(looking.ray.direction_enu),
                 reach = std::min(config_.surface.reach_m, config_.surface.reach * ahead);
    if (ahead <= 0 || to.squaredNorm() - ahead * ahead > reach * reach) continue;
    looking.points.push_back({point.p_enu, point.from_enu, point.sigma_m, static_cast<float>(to_seconds(after))});
  }
}

void ObjectMeasuring::on_settled_laser(const StampedLaserBatch& batch, const fusion::Trajectory& trajectory) {
  const auto& lasers = rig_.geometry.lasers;
  const auto mount =
      std::find_if(lasers.begin(), lasers.end(), [&](const auto& one) { return one.sensor == batch.sensor; });
  if (mount == lasers.end()) return;
  georeference(batch, *mount, trajectory, rig_.colouring.pose_step, placed_);
  // A scanner moves by millimetres from return to return: its place is asked for once in a while.
  constexpr nanoseconds kPlaceEvery{1'000'000};
  std::optional<GpsTime> asked;
  Eigen::Vector3d from = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < placed_.size(); ++i) {
    const GpsTime time = batch.time + nanoseconds(batch.returns[placed_.source[i]].time_offset_ns);
    if (!asked || time - *asked > kPlaceEvery || *asked - time > kPlaceEvery) {
      const auto pose = trajectory.pose_at(time);
      if (!pose.pose) continue;  // cannot be: the point was placed with it
      from = (pose.pose->T_enu_body * mount->T_body_scanner).translation;
      asked = time;
    }
    held_.push_back({time, {placed_.east[i], placed_.north[i], placed_.up[i]}, from, placed_.sigma_m[i]});
    for (const auto& [index, shot] : shots_)
      if (shot.exposed) look(shot, held_.back());
  }
  if (held_.empty()) return;
  const GpsTime oldest = held_.back().time - config_.around - kLatestExposure;
  while (held_.front().time < oldest) held_.pop_front();
}

std::vector<PickOutcome> ObjectMeasuring::finish() {
  std::vector<PickOutcome> out;
  for (Looking& looking : looking_) {
    if (looking.why_not.empty() && !looking.outcome.exposed)
      looking.why_not = fmt::format("the drive has no exposure {}", looking.outcome.pick.exposure);
    looking.outcome.object = looking.why_not.empty()
                                 ? fusion::measure_object(looking.ray, looking.points, config_.surface)
                                 : Error{ErrorCode::Unavailable, looking.why_not};
    out.push_back(std::move(looking.outcome));
  }
  return out;
}

}  // namespace hueline::survey
