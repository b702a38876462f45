#include "score/round_view.hpp"

#include <algorithm>
#include <cmath>

namespace hueline::score {
namespace {

constexpr double kPixelsPerRadian = RoundView::kWidth / (2 * sim::kPi);
constexpr std::array<std::uint8_t, 3> kNothing{238, 240, 243};

/// Returns the colour of a difference of 0 .. 20 dE00: near white, yellow, red, dark red.
std::array<std::uint8_t, 3> heat(double difference) {
  constexpr std::array<std::array<double, 3>, 4> kStops{{{226, 236, 244}, {253, 219, 109}, {214, 62, 42}, {92, 8, 30}}};
  const double x = std::clamp(difference / 20, 0.0, 1.0) * (kStops.size() - 1);
  const auto i = std::min<std::size_t>(static_cast<std::size_t>(x), kStops.size() - 2);
  std::array<std::uint8_t, 3> out{};
  for (std::size_t c = 0; c < 3; ++c)
    out[c] = static_cast<std::uint8_t>(kStops[i][c] + (x - static_cast<double>(i)) * (kStops[i + 1][c] - kStops[i][c]));
  return out;
}

}  // namespace

RoundView::RoundView(const sim::Pose& T_enu_head)
    : T_head_enu_(inverse(T_enu_head)), pixels_(static_cast<std::size_t>(kWidth) * kHeight) {}

void RoundView::add(sim::Vec3 place_enu, std::array<std::uint8_t, 3> claimed, std::array<std::uint8_t, 3> truth,
                    double difference) {
  const sim::Vec3 p = T_head_enu_ * place_enu;
  const double distance = length(p);
  if (distance < 1.5 || distance > 60) return;
  const double column = kWidth / 2.0 - std::atan2(p.y, p.x) * kPixelsPerRadian;  // head: x forward, y left
  const double row = (sim::radians(kTop_deg) - std::asin(p.z / distance)) * kPixelsPerRadian;
  // A point is drawn as a disc of 3 cm or one pixel, so that the rings of the laser have no gaps nearby.
  const double radius = std::clamp(0.03 / distance * kPixelsPerRadian, 0.6, 2.5);
  for (int y = static_cast<int>(std::ceil(row - radius)); y <= std::floor(row + radius); ++y)
    for (int x = static_cast<int>(std::ceil(column - radius)); x <= std::floor(column + radius); ++x) {
      if (y < 0 || y >= kHeight) continue;
      const int wrapped = (x % kWidth + kWidth) % kWidth;
      Pixel& pixel = pixels_[static_cast<std::size_t>(y) * kWidth + static_cast<std::size_t>(wrapped)];
      // The nearest point wins. Of points within 5 cm, which are of one surface, the first one stays.
      if (distance > pixel.distance_m - 0.05) continue;
      pixel = {static_cast<float>(distance), claimed, truth, static_cast<float>(difference)};
    }
}

std::vector<Picture> RoundView::pictures() const {
  std::vector<Picture> out(3);
  const std::array<const char*, 3> captions{"as coloured", "truth: what a perfect camera at the scanner sees",
                                            "difference, dE00: pale 0, yellow 7, red 13, dark 20 and more"};
  for (std::size_t i = 0; i < out.size(); ++i) {
    out[i].caption = captions[i];
    out[i].width = kWidth;
    out[i].height = kHeight;
    for (const Pixel& p : pixels_)
      out[i].pixels.push_back(p.distance_m > 1e8f ? kNothing
                                                  : (i == 0 ? p.claimed : (i == 1 ? p.truth : heat(p.difference))));
  }
  return out;
}

}  // namespace hueline::score
