#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "fusion/depth_panorama.hpp"
#include "fusion/head_projector.hpp"
#include "fusion/panorama_renderer.hpp"

/// What PanoramaRenderer knows while it draws one panorama, and how it looks at many places of it at once. Internal to
/// the renderer. All results have the same bits with each set of vector instructions.
namespace hueline::fusion {

/// A lens at one moment.
struct PanoramaEye {
  FloatLens lens;  ///< from the head's frame at the moment of the panorama
  RawView image{};
  int rank = 0;                               ///< 0: the moment of the panorama; then the others in order
  std::span<const std::uint8_t> clearance{};  ///< pixels to the nearest that shows nothing; empty: all show something
  HeadMotion motion{};                        ///< in the frame of the panorama's moment, around the eye's own
  float ramp_px = 0;                          ///< the lens fades in over so many pixels
  const LowImage* low = nullptr;
  std::array<float, 3> gain{1.0f, 1.0f, 1.0f};
};

/// A column or row of the view: sine and cosine of its angle, and its place as a fraction.
struct PanoramaLine {
  float sine, cosine, fraction;
};

/// Many columns of the view.
struct PanoramaColumns {
  std::vector<float> sine, cosine, fraction;
  std::size_t size() const { return sine.size(); }
  void push_back(const PanoramaLine& line);
};

/// One panorama, and the eyes that look at it.
struct PanoramaScene {
  /// `natural_width` is that of PanoramaRenderer. Eyes are to be added.
  PanoramaScene(const PanoramaView& view, const DepthPanorama* depth, int ranks, float sphere_nearness,
                std::uint32_t natural_width);
  /// `u` and `v` may lie between pixels.
  PanoramaLine column(double u) const;
  PanoramaLine row(double v) const;

  const PanoramaView& view;
  const DepthPanorama* depth;  ///< null: everything lies on the stitching sphere
  int ranks;
  float sphere_nearness;
  Eigen::Matrix3f R_head_view;
  std::vector<PanoramaEye> eyes;  ///< in order of their ranks
  int samples;                    ///< of a pixel, in each direction
  PanoramaColumns columns;        ///< `samples` for each pixel of a row
  std::vector<std::uint32_t> pixel_of_column;
};

/// Places of the head's frame, m.
struct PanoramaPlaces {
  std::vector<float> x, y, z;
  std::vector<float> rise;  ///< sine of the elevation in the head's frame
  std::size_t size() const { return x.size(); }
  void resize(std::size_t size);
  /// Finds the places that the columns from `first` on, `count` of them, show in one row.
  void find(const PanoramaScene& scene, const PanoramaColumns& columns, std::size_t first, std::size_t count,
            const PanoramaLine& row);
  /// Takes the places with these indices of others.
  void take(const PanoramaPlaces& from, std::span<const std::uint32_t> chosen);

 private:
  std::vector<float> nearness_;
};

/// What an eye sees of places, one element for each.
struct PanoramaLook {
  LensSights sights;
  std::vector<float> ramp;  ///< how well inside the usable part of the image, 0 (the eye does not see it) to 1
  /// Returns whether the eye may see one of the places; if not, the results are not there.
  bool look(const PanoramaEye& eye, const PanoramaPlaces& places);

 private:
  bool project(const PanoramaEye& eye, const PanoramaPlaces& places);
  std::vector<float> x_, y_, z_, least_border_;  // of a head that moves: where a lens sees the places
};

/// Draws rows of a panorama. The object keeps its working memory. Thread safety: none; threads have one each.
class PanoramaPainter {
 public:
  PanoramaPainter(const PanoramaScene& scene, const PanoramaRenderer::Config& config, float hole_cosine);
  /// Draws the rows from `from` to before `to`. Adds the pixels that the panorama's moment shows to `seen`, and those
  /// that another shows to `filled`.
  void paint(std::uint32_t from, std::uint32_t to, RgbRaster& out, std::uint64_t& seen, std::uint64_t& filled);

 private:
  static constexpr std::size_t kPiece = 512;  ///< places at a time
  static constexpr std::size_t kMostSeers = 12;
  /// An eye that sees a place.
  struct Seer {
    std::uint32_t eye;
    float x, y, cosine, ramp;
  };
  struct Seers {
    std::array<Seer, kMostSeers> each;
    std::size_t count = 0;
  };
  /// What is to be sampled of an eye's image: where, and how much it is of which column.
  struct Order {
    ImagePlaces places;
    std::vector<float> weight;
    std::vector<std::uint32_t> column;
    std::size_t count = 0;
  };
  void add_piece(std::size_t first, std::size_t count, const PanoramaLine& row);
  void look(int rank, const PanoramaPlaces& places);
  bool choose(std::size_t at, Seers& seers) const;
  void give(std::uint32_t column, const Seers& seers);
  void order(std::uint32_t column, const Seer& seer, float weight);
  void sample_orders();

  const PanoramaScene& scene_;
  PanoramaRenderer::Config config_;
  float hole_cosine_;
  PanoramaPlaces places_, left_places_;
  std::vector<PanoramaLook> looks_;     // by eye
  std::vector<std::uint32_t> looking_;  // eyes of the rank that see a place of the piece
  std::vector<Order> orders_;           // by eye
  std::vector<std::uint32_t> left_;     // of the piece: places that no eye so far sees well
  std::vector<Seers> seers_;            // of the places left
  std::vector<Rgb> samples_of_eye_;
  std::vector<Rgb> sums_;                  // by pixel of a row
  std::vector<std::array<int, 2>> found_;  // samples, and those that the moment itself shows
};

}  // namespace hueline::fusion
