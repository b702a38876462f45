#include "score/sight_figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <utility>
#include <vector>

#include "score/colour_figures.hpp"

namespace hueline::score {
namespace {

/// Returns the kind of a surface: that of "parked car 3" is "parked car".
std::string kind_of(std::string surface) {
  while (!surface.empty() && (std::isdigit(static_cast<unsigned char>(surface.back())) || surface.back() == ' '))
    surface.pop_back();
  return surface;
}

}  // namespace

void SightFigures::add(const Observation& o) {
  ++returns_;
  if (!o.has_exposure) return;
  if (o.is_in_hole) {
    hole_coloured_.add(o.given.has_value());
    hole_bound_.add(o.is_seen_by_candidate);
    if (o.is_seen_by_candidate) hole_visible_.add(o.given.has_value());
  }
  coloured_bound_.add(o.is_seen_by_candidate);
  if (o.is_in_candidate) wrong_bound_.add(!o.is_seen_by_candidate);
  if (o.is_visible) {
    visible_coloured_.add(o.given.has_value());
    visible_coloured_bound_.add(o.is_seen_by_candidate);
  }
  if (o.is_moving) ++moving_seen_;
  if (!o.given) return;
  (o.is_in_hole ? hole_ : outside_hole_).add(o.given->difference);
  if (!o.is_in_lens) {  // outside by half a pixel or so, by the errors of time and pose
    ++not_in_lens_;
    return;
  }
  const bool is_wrong = o.met != Outlook::Met::Place;
  wrong_.add(is_wrong);
  wrong_occluded_.add(o.met == Outlook::Met::Before);
  wrong_by_ring_[o.edges.outline].add(is_wrong);
  wrong_by_kind_[kind_of(surfaces_[o.surface])].add(is_wrong);
  if (is_wrong) {
    wrong_colour_.add(o.given->difference);
    wrong_needlessly_ += o.is_seen_by_candidate ? 1 : 0;
  }
  (o.edges.any <= kEdgeRing ? edge_ : smooth_).add(o.given->difference);
  if (o.meets_moving) ++moving_seen_;
  contaminated_.add(is_wrong && (o.meets_moving || o.is_moving));
}

Chart SightFigures::chart_by_kind() const {
  constexpr std::size_t kKinds = 6, kLetters = 10;
  std::vector<std::pair<std::string, Share>> kinds(wrong_by_kind_.begin(), wrong_by_kind_.end());
  std::stable_sort(kinds.begin(), kinds.end(),
                   [](const auto& a, const auto& b) { return a.second.part > b.second.part; });
  if (kinds.size() > kKinds) kinds.resize(kKinds);
  Chart chart{"From a wrong surface, by what the point is on",
              "most wrong points first",
              "% of points",
              Chart::Kind::Bars,
              false,
              {},
              {}};
  Chart::Curve curve{"", {}, {}};
  for (const auto& [kind, share] : kinds) {
    curve.points.emplace_back(static_cast<double>(chart.bar_names.size()),
                              100.0 * static_cast<double>(share.part) / static_cast<double>(share.whole));
    chart.bar_names.push_back(kind.substr(0, kLetters));
  }
  chart.curves.push_back(std::move(curve));
  return chart;
}

void SightFigures::report(ScenarioScore& score) const {
  Figures& f = score.figures;
  constexpr const char* kNone = "no sampled point is coloured";
  f["visible_coloured_share"] = visible_coloured_.figure("no sampled return was seen by any lens");
  f["wrong_surface_share"] = wrong_.figure(kNone);
  f["coloured_share_bound"] = coloured_bound_.figure("the camera made no exposure");
  f["visible_coloured_share_bound"] = visible_coloured_bound_.figure("no sampled return was seen by any lens");
  f["wrong_surface_share_bound"] = wrong_bound_.figure("no candidate has a sampled return in its image");
  Share at_edges;
  for (std::size_t ring = 0; ring <= kEdgeRing; ++ring) {
    at_edges.part += wrong_by_ring_[ring].part;
    at_edges.whole += wrong_by_ring_[ring].whole;
  }
  f["wrong_surface_edge_share"] = at_edges.figure("no sampled coloured point is near an outline");
  f["hole_coloured_share"] = hole_coloured_.figure("no sampled return lies in the hole");
  f["hole_coloured_share_bound"] = hole_bound_.figure("no sampled return lies in the hole");
  f["hole_visible_coloured_share"] = hole_visible_.figure("no candidate saw a sampled return in the hole");
  f["moving_contaminated_share"] =
      moving_seen_ ? contaminated_.figure(kNone) : Figure{{}, "neither laser nor camera met anything that moves"};
  const auto median = [](const sim::Spread& s, const char* none) {
    return s.count() ? Figure{s.quantile(0.5), {}} : Figure{{}, none};
  };
  const auto ratio = [](const Figure& a, const Figure& b) {
    if (!a.value) return a;
    if (!b.value || *b.value <= 0) return Figure{{}, b.value ? "the denominator is 0" : b.reason};
    return Figure{*a.value / *b.value, {}};
  };
  f["colour_de00_edge_median"] = median(edge_, "no sampled coloured point is near an edge");
  f["colour_de00_smooth_median"] = median(smooth_, "no sampled coloured point is away from edges");
  f["edge_smooth_ratio"] = ratio(f["colour_de00_edge_median"], f["colour_de00_smooth_median"]);
  f["hole_de00_ratio"] = ratio(median(hole_, "no sampled point in the hole is coloured"),
                               median(outside_hole_, "no sampled point outside the hole is coloured"));
  score.notes.push_back(fmt::format(
      "rays: {} sampled returns, {} coloured; {} of a wrong surface ({} hidden, {} moved away; {} of them "
      "truly seen by another exposure or lens of the window), their median dE00 {:.1f}; {} in the hole; {} "
      "beyond the lens's border",
      returns_, wrong_.whole, wrong_.part, wrong_occluded_.part, wrong_.part - wrong_occluded_.part, wrong_needlessly_,
      wrong_colour_.count() ? wrong_colour_.quantile(0.5) : 0.0, hole_coloured_.whole, not_in_lens_));

  Chart colours{"Colour error, by where the point is", "dE00", "% of points below", Chart::Kind::Lines, true, {}, {}};
  colours.curves = {distribution("smooth", smooth_), distribution("near edges", edge_), distribution("hole", hole_),
                    distribution("wrong surface", wrong_colour_)};
  score.charts.push_back(std::move(colours));
  Chart wrong{"From a wrong surface, by distance to an outline",
              "lens pixels",
              "% of points",
              Chart::Kind::Bars,
              false,
              {"< 1", "1-2", "2-4", "4-8", "> 8"},
              {}};
  Chart::Curve curve{"", {}, {}};
  for (std::size_t ring = 0; ring < kRings; ++ring)
    if (wrong_by_ring_[ring].whole)
      curve.points.emplace_back(static_cast<double>(ring), 100.0 * static_cast<double>(wrong_by_ring_[ring].part) /
                                                               static_cast<double>(wrong_by_ring_[ring].whole));
  wrong.curves.push_back(std::move(curve));
  score.charts.push_back(std::move(wrong));
  score.charts.push_back(chart_by_kind());
}

}  // namespace hueline::score
