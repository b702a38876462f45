#include <fmt/format.h>

#include <system_error>
#include <utility>

#include "core/angle.hpp"
#include "core/output_file.hpp"
#include "products/image_tables.hpp"
#include "products/lens_picture.hpp"
#include "products/text_file.hpp"

namespace hueline::products {
namespace {

class ColmapTable : public ImageTable {
 public:
  ColmapTable(TextFile images, TextFile points) : images_(std::move(images)), points_(std::move(points)) {}

  void add(const TakenPicture& picture) override {
    const Transform<Lens, Enu> T = picture.T_enu_lens.inverse();
    const Eigen::Quaterniond& q = T.rotation;
    const Eigen::Vector3d& t = T.translation;
    // The second line lists observed points; there are none.
    images_.add(fmt::format("{} {:.12f} {:.12f} {:.12f} {:.12f} {:.6f} {:.6f} {:.6f} {} {}\n\n", ++count_, q.w(), q.x(),
                            q.y(), q.z(), t.x(), t.y(), t.z(), picture.lens + 1,
                            picture.file.substr(std::string_view("images/").size())));
  }

  Status close(std::span<const ColouredPoint> points) override {
    for (std::size_t i = 0; i < points.size(); ++i) {
      const ColouredPoint& p = points[i];
      points_.add(
          fmt::format("{} {:.4f} {:.4f} {:.4f} {} {} {} 0\n", i + 1, p.east, p.north, p.up, p.red, p.green, p.blue));
    }
    const Status images = images_.close(), ended = points_.close();
    return images ? ended : images;
  }

 private:
  TextFile images_, points_;
  std::uint64_t count_ = 0;
};

}  // namespace

Result<std::unique_ptr<ImageTable>> make_colmap_table(const PictureSet& set) {
  const std::filesystem::path folder = set.folder / "sparse" / "0";
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return output_error("make the folder " + folder.string(), error.value());
  std::string cameras = "# CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]\n";
  for (std::size_t i = 0; i < set.lenses.size(); ++i) {
    const PictureLens& lens = set.lenses[i];
    const ColmapCamera camera = colmap_camera(lens.intrinsics);
    cameras +=
        fmt::format("# {}\n{} {} {} {}", lens.name, i + 1, camera.model, lens.intrinsics.width, lens.intrinsics.height);
    for (const double one : camera.parameters) cameras += fmt::format(" {:.10g}", one);
    cameras += '\n';
  }
  if (Status written = write_output(folder / "cameras.txt", cameras); !written) return written.error();
  auto images = TextFile::create(folder / "images.txt"), points = TextFile::create(folder / "points3D.txt");
  if (!images) return images.error();
  if (!points) return points.error();
  images->add(
      fmt::format("# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, then a line of observed points (none)\n"
                  "# World: east, north, up, m, at latitude {:.9f} deg, longitude {:.9f} deg, ellipsoidal height "
                  "{:.4f} m. The pixels are not gravity-aligned.\n",
                  set.origin.latitude / kRadPerDeg, set.origin.longitude / kRadPerDeg, set.origin.ellipsoidal_height));
  points->add("# POINT3D_ID X Y Z R G B ERROR TRACK[] (without tracks)\n");
  return std::unique_ptr<ImageTable>(std::make_unique<ColmapTable>(std::move(*images), std::move(*points)));
}

}  // namespace hueline::products
