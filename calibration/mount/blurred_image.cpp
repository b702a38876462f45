#include "calibration/mount/blurred_image.hpp"

#include <algorithm>
#include <cmath>

namespace hueline::calibration {
namespace {

/// Returns the weights of a Gauss filter for the distances 0, 1, ... px. All weights of both sides add up to 1.
std::vector<float> weights_of(float blur_px) {
  const int reach = static_cast<int>(std::lround(4 * static_cast<double>(blur_px)));
  std::vector<double> exact;
  double sum = 0;
  for (int i = 0; i <= reach; ++i) {
    exact.push_back(std::exp(-0.5 * i * i / (static_cast<double>(blur_px) * static_cast<double>(blur_px))));
    sum += (i > 0 ? 2 : 1) * exact.back();
  }
  std::vector<float> out;
  for (const double one : exact) out.push_back(static_cast<float>(one / sum));
  return out;
}

/// Returns the place in 0 .. size - 1 that the mirror image shows at `i`; the border pixel itself is not repeated.
int mirrored(int i, int size) {
  if (size == 1) return 0;
  const int period = 2 * (size - 1), place = std::abs(i) % period;
  return std::min(place, period - place);
}

}  // namespace

BlurredImage::BlurredImage(const GreyImage& image, float blur_px)
    : width_(image.width), height_(image.height), blur_px_(blur_px), values_(image.pixels.size()) {
  for (std::size_t i = 0; i < values_.size(); ++i) values_[i] = static_cast<float>(image.pixels[i]) * (1 / 255.0F);
  if (!(blur_px > 0) || values_.empty()) return;
  const std::vector<float> weights = weights_of(blur_px);
  const int reach = static_cast<int>(weights.size()) - 1;
  // The filter is that of the rows and then that of the columns. Each weight takes a whole row, which the compiler
  // turns into vector instructions.
  const auto add = [&](float* out, const float* below, const float* above, float weight) {
    for (int x = 0; x < width_; ++x) out[x] += weight * (below[x] + above[x]);
  };
  std::vector<float> across(values_.size()), wide(static_cast<std::size_t>(width_ + 2 * reach));
  for (int y = 0; y < height_; ++y) {
    const float* row = values_.data() + static_cast<std::ptrdiff_t>(y) * width_;
    float* out = across.data() + static_cast<std::ptrdiff_t>(y) * width_;
    for (int x = -reach; x < width_ + reach; ++x) wide[static_cast<std::size_t>(x + reach)] = row[mirrored(x, width_)];
    for (int x = 0; x < width_; ++x) out[x] = weights[0] * row[x];
    for (int i = 1; i <= reach; ++i)
      add(out, wide.data() + reach - i, wide.data() + reach + i, weights[static_cast<std::size_t>(i)]);
  }
  for (int y = 0; y < height_; ++y) {
    const auto row = [&](int at) {
      return across.data() + static_cast<std::ptrdiff_t>(mirrored(at, height_)) * width_;
    };
    float* out = values_.data() + static_cast<std::ptrdiff_t>(y) * width_;
    for (int x = 0; x < width_; ++x) out[x] = weights[0] * row(y)[x];
    for (int i = 1; i <= reach; ++i) add(out, row(y - i), row(y + i), weights[static_cast<std::size_t>(i)]);
  }
}

}  // namespace hueline::calibration
