#include "score/seam_figures.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "score/colour_figures.hpp"
#include "sim/noise.hpp"

namespace hueline::score {
namespace {

void sum(std::array<float, 3>& into, Lab x) {
  into[0] += static_cast<float>(x.L);
  into[1] += static_cast<float>(x.a);
  into[2] += static_cast<float>(x.b);
}
Lab mean(const std::array<float, 3>& sums, std::uint32_t count) {
  return (1.0 / count) * Lab{sums[0], sums[1], sums[2]};
}

/// All cubes that two sides have in common.
struct Seam {
  std::vector<double> L, a, b;
  Lab truth;  // sum
};
double middle(std::vector<double>& values) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace

void SeamFigures::add(sim::Vec3 place, std::uint16_t surface, std::uint32_t exposure, std::uint8_t lens, Lab claimed,
                      Lab truth) {
  const auto cell = [](double x) {
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(x / kCell_m)) & 0xFFFF);
  };
  const std::uint64_t key =
      cell(place.x) | cell(place.y) << 16 | cell(place.z) << 32 | static_cast<std::uint64_t>(surface) << 48;
  std::vector<Side>& sides = cells_[key];
  auto side =
      std::find_if(sides.begin(), sides.end(), [&](const Side& s) { return s.exposure == exposure && s.lens == lens; });
  if (side == sides.end()) {
    Side fresh;
    fresh.exposure = exposure;
    fresh.lens = lens;
    side = sides.insert(sides.end(), fresh);
  }
  ++side->count;
  sum(side->error, claimed - truth);
  sum(side->truth, truth);
}

void SeamFigures::report(ScenarioScore& score) const {
  std::map<std::array<std::uint32_t, 4>, Seam> seams;
  for (const auto& [key, sides] : cells_)
    for (std::size_t i = 0; i < sides.size(); ++i)
      for (std::size_t k = 0; k < sides.size(); ++k) {
        const Side &a = sides[i], &b = sides[k];
        const std::array<std::uint32_t, 4> name{a.exposure, a.lens, b.exposure, b.lens};
        // A seam has either the same lens or the same exposure on both sides. Each pair is used once.
        if (a.count < kEnough || b.count < kEnough || (a.exposure == b.exposure) == (a.lens == b.lens) ||
            name > std::array<std::uint32_t, 4>{b.exposure, b.lens, a.exposure, a.lens})
          continue;
        Seam& seam = seams[name];
        const Lab step = mean(b.error, b.count) - mean(a.error, a.count);
        seam.L.push_back(step.L);
        seam.a.push_back(step.a);
        seam.b.push_back(step.b);
        seam.truth = seam.truth + 0.5 * (mean(a.truth, a.count) + mean(b.truth, b.count));
      }
  sim::Spread exposure_steps, lens_steps;
  for (auto& [name, seam] : seams) {
    if (seam.L.size() < kEnoughCubes) continue;
    const Lab truth = (1.0 / static_cast<double>(seam.L.size())) * seam.truth;
    const Lab half = 0.5 * Lab{middle(seam.L), middle(seam.a), middle(seam.b)};
    (name[0] == name[2] ? lens_steps : exposure_steps).add(ciede2000(truth - half, truth + half));
  }
  const auto median = [](const sim::Spread& s, const char* none) {
    return s.count() ? Figure{s.quantile(0.5), {}} : Figure{{}, none};
  };
  score.figures["exposure_seam_de00"] = median(exposure_steps, "no two exposures colour enough of one surface");
  score.figures["lens_seam_de00"] = median(lens_steps, "no two lenses of an exposure colour enough of one surface");
  Chart chart{"Steps across seams", "dE00", "% of seams below", Chart::Kind::Lines, true, {}, {}};
  chart.curves = {distribution("between exposures", exposure_steps), distribution("between lenses", lens_steps)};
  score.charts.push_back(std::move(chart));
}

}  // namespace hueline::score
