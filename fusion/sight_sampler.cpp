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
    places_.clear();
    of_sight_.clear();
    for (std::size_t k = 0; k < sights.lens.size(); ++k) {
      if (sights.lens[k] == kNoLens) continue;
      const FloatLens& lens = lenses[sights.lens[k]];
      if (lens.camera != camera) continue;
      const auto [x, y, fx, fy] = place_in_image(lens, sights.x[k], sights.y[k]);
      places_.x.push_back(x);
      places_.y.push_back(y);
      places_.fx.push_back(fx);
      places_.fy.push_back(fy);
      of_sight_.push_back(static_cast<std::uint32_t>(k));
      // The pixels of a batch lie all over an image that no cache holds, so they are fetched before they are sampled.
      const std::uint8_t* pixel =
          view.data + static_cast<std::size_t>(y) * view.stride + static_cast<std::size_t>(x) * per_pixel;
      for (int row = 1 - kSampleReach; row <= kSampleReach; ++row)
        __builtin_prefetch(pixel + row * static_cast<std::ptrdiff_t>(view.stride));
    }
    samples_.resize(of_sight_.size());
    sample_each(view, places_, samples_.data());
    for (std::size_t k = 0; k < of_sight_.size(); ++k) pixels[of_sight_[k]] = samples_[k];
  }
}

}  // namespace hueline::fusion
