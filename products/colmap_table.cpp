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
  ColmapTable(TextFile images, TextFile points, const std::vector<PictureLens>& lenses)
      : images_(std::move(images)), points_(std::move(points)) {
    for (const PictureLens& lens : lenses) focal_px_.push_back(lens.intrinsics.focal_px.mean());
  }

  void add(const TakenPicture&) override {}  // what a picture shows is known in the end

  Status close(const ShownPoints& shown) override {
    for (std::size_t i = 0; i < shown.pictures.size(); ++i) add_image(i + 1, shown.pictures[i], shown.seen[i]);
    add_points(shown);
    const Status images = images_.close(), ended = points_.close();
    return images ? ended : images;
  }

 private:
  /// Where a point was observed.
  struct Place {
    std::uint32_t picture, index;
  };

  void add_image(std::size_t number, const TakenPicture& picture, const std::vector<Observation>& seen) {
    const Transform<Lens, Enu> T = picture.T_enu_lens.inverse();
    const Eigen::Quaterniond& q = T.rotation;
    const Eigen::Vector3d& t = T.translation;
    images_.add(fmt::format("{} {:.12f} {:.12f} {:.12f} {:.12f} {:.6f} {:.6f} {:.6f} {} {}\n", number, q.w(), q.x(),
                            q.y(), q.z(), t.x(), t.y(), t.z(), picture.lens + 1,
                            picture.file.substr(std::string_view("images/").size())));
    const char* between = "";
    for (const Observation& one : seen) {
      images_.add(
          fmt::format("{}{:.3f} {:.3f} {}", std::exchange(between, " "), one.u + 0.5f, one.v + 0.5f, one.point + 1));
    }
    images_.add("\n");
  }

  void add_points(const ShownPoints& shown) {
    const auto& [pictures, points, seen] = shown;
    // The observations in the order of the points: those of a point end where those of the next one begin.
    std::vector<std::size_t> ends(points.size() + 1, 0);
    for (const auto& picture : seen)
      for (const Observation& one : picture) ++ends[one.point + 1];
    for (std::size_t i = 0; i < points.size(); ++i) ends[i + 1] += ends[i];
    std::vector<Place> places(ends.back());
    for (std::size_t picture = 0; picture < seen.size(); ++picture)
      for (std::size_t index = 0; index < seen[picture].size(); ++index)
        places[ends[seen[picture][index].point]++] = {static_cast<std::uint32_t>(picture),
                                                      static_cast<std::uint32_t>(index)};
    std::size_t begin = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const ColouredPoint& p = points[i];
      const auto track = std::span(places).subspan(begin, ends[i] - begin);
      begin = ends[i];
      double shift_px = 0;
      for (const Place& at : track) {
        const TakenPicture& picture = pictures[at.picture];
        const double distance = (Eigen::Vector3d(p.east, p.north, p.up) - picture.T_enu_lens.translation).norm();
        shift_px += focal_px_[picture.lens] * p.sigma_m / distance;
      }
      points_.add(fmt::format("{} {:.5f} {:.5f} {:.5f} {} {} {} {:.4g}", i + 1, p.east, p.north, p.up, p.red, p.green,
                              p.blue, track.empty() ? -1.0 : shift_px / static_cast<double>(track.size())));
      for (const Place& at : track) points_.add(fmt::format(" {} {}", at.picture + 1, at.index));
      points_.add("\n");
    }
  }

  TextFile images_, points_;
  std::vector<double> focal_px_;  // of each lens
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
      fmt::format("# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, then a line of observed points: X Y POINT3D_ID ...\n"
                  "# World: east, north, up, m, at latitude {:.9f} deg, longitude {:.9f} deg, ellipsoidal height "
                  "{:.4f} m. The pixels are not gravity-aligned.\n",
                  set.origin.latitude / kRadPerDeg, set.origin.longitude / kRadPerDeg, set.origin.ellipsoidal_height));
  points->add(
      "# POINT3D_ID X Y Z R G B ERROR TRACK[] as (IMAGE_ID POINT2D_IDX); ERROR: px that the sigma of the place "
      "makes\n");
  return std::unique_ptr<ImageTable>(std::make_unique<ColmapTable>(std::move(*images), std::move(*points), set.lenses));
}

}  // namespace hueline::products
