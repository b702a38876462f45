#include "survey/vehicle_masks.hpp"

#include <algorithm>
#include <chrono>

namespace hueline::survey {
namespace {

constexpr double kMoved_m = 1.0;  // nearer views show the same place
// A walking vehicle drives over the road in front of its scanner within this time.
constexpr nanoseconds kReach = std::chrono::seconds(4);
// So many points are fine enough to hide each other with small discs, and large ones hide the far road.
constexpr double kDisc_deg = 0.15;

}  // namespace

std::vector<MaskPass> mask_passes(const fusion::RigGeometry& rig) {
  const auto& lenses = rig.head.lenses;
  const MaskPass all{std::vector<bool>(lenses.size(), true), std::vector<bool>(lenses.size(), true)};
  MaskPass ahead = all, back = all;
  for (std::size_t i = 0; i < lenses.size(); ++i) {
    const Eigen::Vector3d axis =
        (rig.head.T_body_head.rotation * lenses[i].T_head_lens.rotation) * Eigen::Vector3d::UnitZ();
    const bool is_ahead = axis.y() >= 0;
    ahead.gives_colour[i] = back.is_judged[i] = is_ahead;
    back.gives_colour[i] = ahead.is_judged[i] = !is_ahead;
  }
  const auto none = [](const std::vector<bool>& of) { return std::ranges::find(of, true) == of.end(); };
  if (none(ahead.gives_colour) || none(back.gives_colour)) return {all, all};
  return {all, ahead, back};
}

fusion::RigGeometry rig_of_pass(fusion::RigGeometry rig, const MaskPass& pass,
                                const std::vector<calibration::VehicleMask::Found>& found) {
  rig.head.nadir_half_angle = 0;
  for (std::size_t i = 0; i < rig.head.lenses.size(); ++i) {
    fusion::LensMount& lens = rig.head.lenses[i];
    lens.masks.clear();
    if (i < found.size() && pass.gives_colour[i]) lens.masks = found[i].polygons;
    const double right = lens.intrinsics.width, below = lens.intrinsics.height;
    if (!pass.gives_colour[i]) lens.masks = {{{-1, -1}, {right, -1}, {right, below}, {-1, below}}};
  }
  return rig;
}

VehicleMasks::VehicleMasks(const fusion::Colouring::Config& colouring, const fusion::RigGeometry& rig, int threads)
    : taken_at_(rig.head.lenses.size()),
      views_(colouring, rig,
             {.every = 2, .reach = kReach, .disc_deg = kDisc_deg, .threads = threads, .every_lens = true},
             [this](const PredictedView& view) { take(view); }) {
  for (const fusion::LensMount& lens : rig.head.lenses)
    masks_.emplace_back(static_cast<int>(lens.intrinsics.width), static_cast<int>(lens.intrinsics.height));
}

void VehicleMasks::take(const PredictedView& view) {
  auto& taken_at = taken_at_[view.lens];
  if (taken_at && (*taken_at - view.head_enu).norm() < kMoved_m) return;
  taken_at = view.head_enu;
  masks_[view.lens].add(view.pixels);
}

std::vector<calibration::VehicleMask::Found> VehicleMasks::finish() {
  views_.finish();
  std::vector<calibration::VehicleMask::Found> out;
  for (const calibration::VehicleMask& mask : masks_) out.push_back(mask.find());
  return out;
}

}  // namespace hueline::survey
