#include "score/motion_figures.hpp"

#include <cmath>
#include <numeric>
#include <utility>

namespace hueline::score {
namespace {

/// Returns the share of the points of a histogram whose confidence is `from` or more; empty without points.
template <class Histogram>
std::optional<double> share_from(const Histogram& points, int from) {
  const auto all = std::accumulate(points.begin(), points.end(), std::uint64_t{0});
  if (all == 0) return std::nullopt;
  return static_cast<double>(std::accumulate(points.begin() + from, points.end(), std::uint64_t{0})) /
         static_cast<double>(all);
}

}  // namespace

void MotionFigures::add(bool is_truly_moving, std::uint8_t confidence) {
  ++(is_truly_moving ? dynamic_ : static_)[confidence];
}

void MotionFigures::report(ScenarioScore& score) const {
  const Figure no_static{{}, "no point lies on a thing that stands still"},
      no_dynamic{{}, "no point lies on a thing that moves by itself"};
  const auto wrongly = share_from(static_, kMoving), rightly = share_from(dynamic_, kMoving);
  Figures& f = score.figures;
  f["static_accuracy"] = wrongly ? Figure{1 - *wrongly, {}} : no_static;
  f["dynamic_accuracy"] = rightly ? Figure{*rightly, {}} : no_dynamic;
  f["associated_accuracy"] =
      wrongly && rightly ? Figure{std::sqrt((1 - *wrongly) * *rightly), {}} : (rightly ? no_static : no_dynamic);
  Chart chart{"Points told moving, by the least confidence that counts",
              "confidence",
              "% of points",
              Chart::Kind::Lines,
              false,
              {},
              {}};
  const auto curve = [](const char* label, const Histogram& points) {
    Chart::Curve out{label, {}, {}};
    for (int from = 1; from < 256; ++from)
      if (const auto share = share_from(points, from)) out.points.emplace_back(from, 100 * *share);
    return out;
  };
  chart.curves = {curve("on what moves", dynamic_), curve("on what stands", static_)};
  score.charts.push_back(std::move(chart));
}

}  // namespace hueline::score
