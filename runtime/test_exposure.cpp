#include "runtime/test_exposure.hpp"

#include <fmt/format.h>

#include <numeric>
#include <utility>

#include "fusion/pixel_sampler.hpp"

namespace hueline::runtime {
namespace {

constexpr int kBinWidth = 256 / static_cast<int>(LensLight::kBins);
constexpr std::size_t kDarkBins = 2;  // sensors add a few values to keep their noise above zero
constexpr nanoseconds kEvery{1'000'000'000};
constexpr double kAllDark = 0.995, kMuchDark = 0.5, kMuchSaturated = 0.3;  // shares of the pixels

/// Counts the bytes of a lens's part of an image. Each byte is a pixel of a mosaic, or a colour of one.
void count(const fusion::RawView& view, const fusion::LensMount& lens, LensLight& light) {
  const std::size_t bytes = view.format == PixelFormat::Rgb8 ? 3 : 1;
  for (std::uint32_t y = 0; y < lens.intrinsics.height; ++y) {
    const std::uint8_t* row = view.data + (lens.y_offset + y) * view.stride + lens.x_offset * bytes;
    for (std::size_t i = 0; i < lens.intrinsics.width * bytes; ++i) ++light.pixels[row[i] / kBinWidth];
  }
}

}  // namespace

std::uint64_t LensLight::count() const { return std::accumulate(pixels.begin(), pixels.end(), std::uint64_t{0}); }

int LensLight::median() const {
  const std::uint64_t all = count();
  std::uint64_t below = 0;
  for (std::size_t bin = 0; bin < kBins; ++bin)
    if ((below += pixels[bin]) * 2 >= all) return static_cast<int>(bin + 1) * kBinWidth - 1;
  return 0;
}

double LensLight::dark_share() const {
  const auto dark = std::accumulate(pixels.begin(), pixels.begin() + kDarkBins, std::uint64_t{0});
  return count() > 0 ? static_cast<double>(dark) / static_cast<double>(count()) : 0;
}

double LensLight::saturated_share() const {
  return count() > 0 ? static_cast<double>(pixels.back()) / static_cast<double>(count()) : 0;
}

void TestExposure::take(const Image& image) {
  const auto known = cameras_.find(image.sensor);
  if (!image.is_complete || (known != cameras_.end() && image.received - known->second.at < kEvery)) return;
  const fusion::RawView view = fusion::view_of(image);
  if (view.data == nullptr) return;
  Counted counted{image.received, {}};
  for (const fusion::LensMount& lens : rig_.geometry.head.lenses) {
    const bool fits =
        lens.x_offset + lens.intrinsics.width <= view.width && lens.y_offset + lens.intrinsics.height <= view.height;
    if (lens.camera != image.sensor || !fits) continue;
    LensLight& light = counted.lenses[lens.name];
    light.camera = lens.camera_name;
    light.lens = lens.name;
    count(view, lens, light);
  }
  cameras_[image.sensor] = std::move(counted);
}

std::vector<LensLight> TestExposure::lenses() const {
  std::vector<LensLight> out;
  for (const fusion::LensMount& lens : rig_.geometry.head.lenses)
    if (const auto camera = cameras_.find(lens.camera); camera != cameras_.end())
      if (const auto light = camera->second.lenses.find(lens.name); light != camera->second.lenses.end())
        out.push_back(light->second);
  return out;
}

std::vector<Finding> check_light(const std::vector<LensLight>& lenses) {
  std::vector<Finding> out;
  for (const LensLight& one : lenses) {
    const std::string light = fmt::format("of its pixels {:.0f} % are dark and {:.0f} % saturated (test exposure)",
                                          100 * one.dark_share(), 100 * one.saturated_share());
    if (one.dark_share() >= kAllDark)
      out.push_back({true, one.lens, "sees nothing: " + light,
                     "take off its cap, look for dirt; at night, give a reason to start all the same"});
    else if (one.dark_share() >= kMuchDark)
      out.push_back({false, one.lens, "is much too dark: " + light, "raise exposure or gain of " + one.camera});
    else if (one.saturated_share() >= kMuchSaturated)
      out.push_back({false, one.lens, "is much too bright: " + light, "lower exposure or gain of " + one.camera});
  }
  return out;
}

}  // namespace hueline::runtime
