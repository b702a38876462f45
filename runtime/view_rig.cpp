#include "runtime/view_rig.hpp"

#include <utility>

namespace hueline::runtime {

storage::ViewRig view_rig(const config::Rig& rig) {
  storage::ViewRig out;
  const auto names = rig.sensor_names();
  for (const fusion::LaserMount& laser : rig.geometry.lasers)
    out.scanners.emplace_back(names.at(laser.sensor), laser.T_body_scanner);
  out.T_body_head = rig.geometry.head.T_body_head;
  for (const fusion::LensMount& mount : rig.geometry.head.lenses) {
    const fusion::CameraIntrinsics& from = mount.intrinsics;
    storage::ViewLens lens;
    lens.name = mount.name;
    lens.camera = names.at(mount.camera);
    lens.T_head_lens = mount.T_head_lens;
    lens.is_fisheye = from.model == fusion::LensModel::KannalaBrandt;
    lens.focal_px = from.focal_px;
    lens.principal_point_px = from.principal_point_px;
    lens.distortion.assign(from.distortion.begin(), from.distortion.end());
    if (lens.is_fisheye) lens.distortion.resize(4);
    lens.x_offset = mount.x_offset;
    lens.y_offset = mount.y_offset;
    out.lenses.push_back(std::move(lens));
  }
  return out;
}

}  // namespace hueline::runtime
