#include "fusion/sight_sampler.hpp"

#include <cstddef>

#include "core/coloured_point.hpp"

namespace hueline::fusion {

void SightSampler::sample(const std::vector<FloatLens>& lenses, const Moment& moment, const Sights& sights,
                          std::vector<Rgb>& pixels) {
  pixels.resize(sights.lens.size());
  for (std::size_t camera = 0; camera < moment.pictures.size(); ++camera) {
    const RawView& view = moment.pictures[camera].view;
    const std::size_t per_pixel = view.format == PixelFormat::Rgb8 ? 3 : 1;
    // Room for all; how many are of this camera is known at the end.
    places_.resize(sights.lens.size());
    of_sight_.resize(sights.lens.size());
    std::size_t count = 0;
    for (std::size_t k = 0; k < sights.lens.size(); ++k) {
      if (sights.lens[k] == kNoLens) continue;
      const FloatLens& lens = lenses[sights.lens[k]];
      if (lens.camera != camera) continue;
      if (lens.is_at_margin(sights.x[k], sights.y[k])) {
        pixels[k] = sample_nearest_pixel(lens, view, sights.x[k], sights.y[k]);
        continue;
      }
      const auto [x, y, fx, fy] = place_in_image(lens, sights.x[k], sights.y[k]);
      places_.x[count] = x;
      places_.y[count] = y;
      places_.fx[count] = fx;
      places_.fy[count] = fy;
      of_sight_[count++] = static_cast<std::uint32_t>(k);
      // The pixels of a batch lie all over an image that no cache holds, so they are fetched before they are sampled.
      const std::uint8_t* pixel =
          view.data + static_cast<std::size_t>(y) * view.stride + static_cast<std::size_t>(x) * per_pixel;
      for (int row = 1 - kSampleReach; row <= kSampleReach; ++row)
        __builtin_prefetch(pixel + row * static_cast<std::ptrdiff_t>(view.stride));
    }
    places_.resize(count);
    samples_.resize(count);
    sample_each(view, places_, samples_.data());
    for (std::size_t k = 0; k < count; ++k) pixels[of_sight_[k]] = samples_[k];
  }
}

}  // namespace hueline::fusion
