#include "score/colour_figures.hpp"

#include <cmath>
#include <string>
#include <utility>

namespace hueline::score {

void ColourFigures::add(std::uint32_t exposure, Lab claimed, Lab truth, double difference) {
  difference_.add(difference);
  if (difference > 20) ++over20_;
  OfExposure& e = exposures_[exposure];
  ++e.count;
  e.lightness_error += claimed.L - truth.L;
}

Chart::Curve distribution(const std::string& label, const sim::Spread& spread) {
  Chart::Curve curve{label, {}, {}};
  if (spread.count() == 0) return curve;
  for (int percent = 2; percent <= 99; ++percent) curve.points.emplace_back(spread.quantile(percent / 100.0), percent);
  return curve;
}

void ColourFigures::report(ScenarioScore& score) const {
  Figures& f = score.figures;
  const auto n = static_cast<double>(difference_.count());
  for (const char* name : {"colour_de00_median", "colour_de00_p95", "colour_de00_over20_share"})
    f[name] = {{}, "no coloured point has a true colour"};
  f["frame_swing_L"] = {{}, "fewer than two exposures gave a hundred points each"};
  if (difference_.count() == 0) return;
  f["colour_de00_median"] = {difference_.quantile(0.5), {}};
  f["colour_de00_p95"] = {difference_.quantile(0.95), {}};
  f["colour_de00_over20_share"] = {static_cast<double>(over20_) / n, {}};

  Chart chart{"Mean lightness error of each exposure's points", "exposure", "L*", Chart::Kind::Points, false, {}, {}};
  Chart::Curve curve{"given - true", {}, {}};
  double square = 0;
  std::size_t steps = 0;
  bool has_last = false;
  double last = 0;
  for (const auto& [exposure, e] : exposures_) {
    if (e.count < 100) continue;
    const double mean = e.lightness_error / static_cast<double>(e.count);
    if (has_last) {
      square += (mean - last) * (mean - last);
      ++steps;
    }
    last = mean;
    has_last = true;
    curve.points.emplace_back(exposure, mean);
  }
  if (steps) f["frame_swing_L"] = {std::sqrt(square / static_cast<double>(steps)), {}};
  chart.curves.push_back(std::move(curve));
  score.charts.push_back(std::move(chart));
}

}  // namespace hueline::score
