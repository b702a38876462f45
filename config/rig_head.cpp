#include "config/rig_head.hpp"

#include "config/calibration_record.hpp"
#include "config/mounting.hpp"

namespace hueline::config {
namespace {

constexpr double kDeg = 3.14159265358979323846 / 180;

std::vector<fusion::Polygon> read_polygons(Section& section, const std::string& key) {
  std::vector<fusion::Polygon> out;
  for (Section& one : section.list_or_empty(key)) {
    const auto numbers = one.numbers("polygon_px", {-100000, 100000});
    if (numbers.size() < 6 || numbers.size() % 2) one.refuse("polygon_px", "allowed: u, v of three corners or more");
    fusion::Polygon polygon;
    for (std::size_t i = 0; i < numbers.size(); i += 2) polygon.emplace_back(numbers[i], numbers[i + 1]);
    out.push_back(std::move(polygon));
    one.finish();
  }
  return out;
}

fusion::PanoramaShape read_panorama(Section section) {
  fusion::PanoramaShape shape;
  shape.width = static_cast<std::uint32_t>(section.integer("width", {16, 65535}));
  shape.height = static_cast<std::uint32_t>(section.integer("height", {8, 65535}));
  shape.forward_column = section.number("forward_column", {-0.5, 100000}, (shape.width - 1) / 2.0);
  shape.is_clockwise = section.boolean("clockwise", true);
  shape.stitching_radius_m = section.number("stitching_radius_m", {0.5, 10000});
  if (const std::string wrong = shape.validate(); !wrong.empty()) section.refuse("width", wrong);
  section.finish();
  return shape;
}

fusion::LensMount read_lens(Section section, const std::map<std::string, SensorId>& cameras) {
  fusion::LensMount lens;
  lens.name = section.text("name");
  std::vector<std::pair<std::string, SensorId>> words(cameras.begin(), cameras.end());
  lens.camera = section.choice<SensorId>("camera", words);
  const auto offset = section.integers("offset_px", {0, 100000});
  if (offset.size() != 2) section.refuse("offset_px", "allowed: two whole numbers, column and row");
  lens.x_offset = static_cast<std::uint32_t>(offset[0]);
  lens.y_offset = static_cast<std::uint32_t>(offset[1]);
  lens.T_head_lens = read_transform<CameraHead, Lens>(section, "T_head_lens");
  lens.intrinsics = read_intrinsics(section);
  lens.masks = read_polygons(section, "masks");
  section.finish();
  return lens;
}

}  // namespace

fusion::CameraIntrinsics read_intrinsics(Section& section) {
  fusion::CameraIntrinsics out;
  out.model = section.choice<fusion::LensModel>(
      "model", {{"brown", fusion::LensModel::Brown}, {"kannala_brandt", fusion::LensModel::KannalaBrandt}});
  out.width = static_cast<std::uint32_t>(section.integer("width", {8, 65535}));
  out.height = static_cast<std::uint32_t>(section.integer("height", {8, 65535}));
  const auto focal = section.numbers("focal_px", 2, {1, 1e6});
  const auto principal = section.numbers("principal_point_px", 2, {-1e6, 1e6});
  out.focal_px = {focal[0], focal[1]};
  out.principal_point_px = {principal[0], principal[1]};
  const auto distortion = section.numbers("distortion", {-1000, 1000});
  const std::size_t most = out.model == fusion::LensModel::Brown ? 5 : 4;
  if (distortion.size() > most)
    section.refuse("distortion", most == 5 ? "allowed: at most 5 numbers, k1 k2 p1 p2 k3" : "allowed: at most 4 numbers, k1 k2 k3 k4");
  std::copy(distortion.begin(), distortion.end(), out.distortion.begin());
  out.max_angle = section.number("max_angle_deg", {1, 143}, out.max_angle / kDeg) * kDeg;
  if (const std::string wrong = out.validate(); !wrong.empty()) section.refuse("model", wrong);
  check_calibration_record(section);
  return out;
}

fusion::CameraHeadGeometry read_head(Section section, const std::map<std::string, SensorId>& cameras) {
  fusion::CameraHeadGeometry head;
  head.T_body_head = read_transform<Body, CameraHead>(section, "T_body_head");
  head.nadir_half_angle = section.number("nadir_half_angle_deg", {0, 85}, 0.0) * kDeg;
  head.panorama = read_panorama(section.section("panorama"));
  head.panorama_masks = read_polygons(section, "panorama_masks");
  for (Section& lens : section.list("lenses")) head.lenses.push_back(read_lens(lens, cameras));
  if (const std::string wrong = head.validate(); !wrong.empty()) section.refuse("lenses", wrong);
  section.finish();
  return head;
}

}  // namespace hueline::config
