#pragma once

#include <cstdint>
#include <vector>

#include "fusion/exposure_timeline.hpp"
#include "fusion/head_projector.hpp"
#include "fusion/pixel_sampler.hpp"

namespace hueline::fusion {

/// A place in the image of a camera, as sample() takes it.
struct PlaceInImage {
  int x, y;
  float fx, fy;
};

/// Returns the place in its camera's image of a pixel of a lens.
inline PlaceInImage place_in_image(const FloatLens& lens, float lens_x, float lens_y) {
  // The coordinates are not negative, because a lens shows nothing nearer to its border than kLeastBorder_px.
  const auto x = static_cast<int>(lens_x), y = static_cast<int>(lens_y);
  return {x + static_cast<int>(lens.x_offset), y + static_cast<int>(lens.y_offset), lens_x - static_cast<float>(x),
          lens_y - static_cast<float>(y)};
}

/// Samples the image of a camera at the nearest pixel of a place of a lens, without what lies around it.
inline Rgb sample_nearest_pixel(const FloatLens& lens, const RawView& view, float lens_x, float lens_y) {
  const auto [x, y, fx, fy] = place_in_image(lens, lens_x + 0.5f, lens_y + 0.5f);
  return sample_pixel(view, x, y);
}

/// Samples the image of a camera at a place of a lens that FloatLens::project() found, outside its mask. The sample has
/// nothing of what the mask covers.
inline Rgb sample_lens(const FloatLens& lens, const RawView& view, float lens_x, float lens_y) {
  if (lens.is_at_margin(lens_x, lens_y)) return sample_nearest_pixel(lens, view, lens_x, lens_y);
  const auto [x, y, fx, fy] = place_in_image(lens, lens_x, lens_y);
  return sample(view, x, y, fx, fy);
}

/// Samples the images of a moment at many sights. The object keeps its working memory. Thread safety: none.
class SightSampler {
 public:
  /// Writes to `pixels`, for each sight with a pixel, what sample_lens() returns. `sights` need no border_px.
  void sample(const std::vector<FloatLens>& lenses, const Moment& moment, const Sights& sights,
              std::vector<Rgb>& pixels);

 private:
  // Of one camera: the places in its image, the indices of their sights, and what the image shows there.
  ImagePlaces places_;
  std::vector<std::uint32_t> of_sight_;
  std::vector<Rgb> samples_;
};

}  // namespace hueline::fusion
