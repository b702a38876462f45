#include <fmt/format.h>

#include <filesystem>
#include <system_error>
#include <utility>

#include "core/angle.hpp"
#include "core/output_file.hpp"
#include "products/image_tables.hpp"
#include "products/lens_picture.hpp"
#include "products/ply_file.hpp"
#include "products/text_file.hpp"

namespace hueline::products {
namespace {

constexpr const char *kTransforms = "transforms.json", *kPoints = "points.ply";

class NerfstudioTable : public ImageTable {
 public:
  NerfstudioTable(TextFile file, const PictureSet& set) : file_(std::move(file)), set_(set) {}

  void add(const TakenPicture& picture) override {
    const auto& lens = set_.lenses[picture.lens].intrinsics;
    const Eigen::Matrix3d R = picture.T_enu_lens.rotation.toRotationMatrix();
    const Eigen::Vector3d& t = picture.T_enu_lens.translation;
    file_.add(fmt::format(
        "{}\n{{\"file_path\":\"{}\",\"w\":{},\"h\":{},\"fl_x\":{:.8f},\"fl_y\":{:.8f},\"cx\":{:.8f},\"cy\":"
        "{:.8f}",
        std::exchange(has_frame_, true) ? "," : "", picture.file, lens.width, lens.height, lens.focal_px.x(),
        lens.focal_px.y(), lens.principal_point_px.x() + 0.5, lens.principal_point_px.y() + 0.5));
    const auto& d = lens.distortion;
    if (lens.model == fusion::LensModel::KannalaBrandt)
      file_.add(fmt::format(",\"k1\":{:.12g},\"k2\":{:.12g},\"k3\":{:.12g},\"k4\":{:.12g}", d[0], d[1], d[2], d[3]));
    else
      file_.add(fmt::format(",\"k1\":{:.12g},\"k2\":{:.12g},\"p1\":{:.12g},\"p2\":{:.12g},\"k3\":{:.12g}", d[0], d[1],
                            d[2], d[3], d[4]));
    file_.add(",\"transform_matrix\":[");
    for (Eigen::Index i = 0; i < 3; ++i)
      file_.add(fmt::format("[{:.12f},{:.12f},{:.12f},{:.6f}],", R(i, 0), -R(i, 1), -R(i, 2), t[i]));
    file_.add("[0,0,0,1]]}");
  }

  Status close(const ShownPoints& shown) override {
    file_.add("\n]}\n");
    const Status closed = file_.close(), written = write_points(shown.points);
    return closed ? written : closed;
  }

 private:
  Status write_points(std::span<const ColouredPoint> points) const {
    using storage::LasType;
    auto file = PlyFile::create(set_.folder / kPoints, {"east, north, up, m, in the world of transforms.json"},
                                {{"x", LasType::F32},
                                 {"y", LasType::F32},
                                 {"z", LasType::F32},
                                 {"red", LasType::U8},
                                 {"green", LasType::U8},
                                 {"blue", LasType::U8}},
                                points.size());
    if (!file) return file.error();
    storage::Bytes bytes;
    for (const ColouredPoint& p : points) {
      for (const double one : {p.east, p.north, p.up}) storage::append(bytes, static_cast<float>(one));
      for (const std::uint8_t one : {p.red, p.green, p.blue}) storage::append(bytes, one);
    }
    if (Status written = file->add(bytes); !written) return written;
    return file->close();
  }

  TextFile file_;
  PictureSet set_;
  bool has_frame_ = false;
};

}  // namespace

Result<std::unique_ptr<ImageTable>> make_nerfstudio_table(const PictureSet& set) {
  bool is_fisheye = false, is_plane = false;
  for (const PictureLens& lens : set.lenses)
    (lens.intrinsics.model == fusion::LensModel::KannalaBrandt ? is_fisheye : is_plane) = true;
  if (is_fisheye && is_plane) {
    // Those of an earlier export are of other pictures.
    for (const char* file : {kTransforms, kPoints})
      if (std::error_code error; std::filesystem::remove(set.folder / file, error), error)
        return output_error(fmt::format("remove {}", (set.folder / file).string()), error.value());
    return Error{
        ErrorCode::Unsupported,
        "transforms.json has one lens model for all pictures, and the lenses of this rig have two: undistorted "
        "pictures have one (--lens pinhole)"};
  }
  auto file = TextFile::create(set.folder / kTransforms);
  if (!file) return file.error();
  file->add(fmt::format(
      "{{\"camera_model\":\"{}\",\"ply_file_path\":\"{}\",\"pixels_are_gravity_aligned\":false,\"world\":{{\"axes\":"
      "\"east, north, up, m\",\"latitude_deg\":{:.9f},\"longitude_deg\":{:.9f},\"ellipsoidal_height_m\":{:.4f}}},\n"
      "\"frames\":[",
      is_fisheye ? "OPENCV_FISHEYE" : "OPENCV", kPoints, set.origin.latitude / kRadPerDeg,
      set.origin.longitude / kRadPerDeg, set.origin.ellipsoidal_height));
  return std::unique_ptr<ImageTable>(std::make_unique<NerfstudioTable>(std::move(*file), set));
}

}  // namespace hueline::products
