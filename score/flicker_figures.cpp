#include "score/flicker_figures.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "score/colour_figures.hpp"
#include "sim/noise.hpp"

namespace hueline::score {
namespace {

std::array<float, 3> floats(Lab x) {
  return {static_cast<float>(x.L), static_cast<float>(x.a), static_cast<float>(x.b)};
}
Lab lab(const std::array<float, 3>& x) { return {x[0], x[1], x[2]}; }

}  // namespace

void FlickerFigures::add(sim::Vec3 place, std::uint16_t surface, std::uint64_t order, std::uint32_t exposure,
                         std::uint8_t lens, Lab claimed, Lab truth) {
  const auto cell = [](double x) {
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(x / kCell_m)) & 0xFFFF);
  };
  const std::uint64_t key =
      cell(place.x) | cell(place.y) << 16 | cell(place.z) << 32 | static_cast<std::uint64_t>(surface) << 48;
  if (sim::scrambled(key) % kOneIn != 0) return;
  const Side fresh{order, exposure, lens, floats(claimed), floats(truth)};
  std::vector<Side>& sides = cells_[key];
  const auto at = std::lower_bound(sides.begin(), sides.end(), fresh, [](const Side& a, const Side& b) {
    return std::tie(a.exposure, a.lens) < std::tie(b.exposure, b.lens);
  });
  if (at == sides.end() || at->exposure != exposure || at->lens != lens)
    sides.insert(at, fresh);
  else if (order < at->order)
    *at = fresh;
}

void FlickerFigures::report(ScenarioScore& score) const {
  sim::Spread steps;
  for (const auto& [key, sides] : cells_)
    for (std::size_t i = 1; i < sides.size(); ++i) {
      const Side &a = sides[i - 1], &b = sides[i];
      steps.add(std::max(0.0, ciede2000(lab(a.claimed), lab(b.claimed)) - ciede2000(lab(a.truth), lab(b.truth))));
    }
  score.figures["flicker_de00_p90"] =
      steps.count() ? Figure{steps.quantile(0.9), {}}
                    : Figure{{}, "no two neighbouring points have their colours from different exposures or lenses"};
  Chart chart{"Flicker: steps between neighbouring points of two exposures or lenses",
              "dE00",
              "% of pairs below",
              Chart::Kind::Lines,
              true,
              {},
              {}};
  chart.curves = {distribution("", steps)};
  score.charts.push_back(std::move(chart));
}

}  // namespace hueline::score
