#include "score/view_figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "score/colour_figures.hpp"

namespace hueline::score {
namespace {

// Beyond these luminances there is noise or saturation, and a ratio says nothing.
constexpr double kDark = 0.005, kBright = 0.95;
constexpr double kClose = 10;  // dE00

double luminance(const std::array<double, 3>& light) {
  return 0.2126 * light[0] + 0.7152 * light[1] + 0.0722 * light[2];
}

}  // namespace

void HeldOutFigures::add(std::span<const HeldOutPixel> pixels) {
  const std::size_t stride = std::max<std::size_t>(1, pixels.size() / kMostPixels);
  std::vector<double> ratios;
  for (std::size_t i = 0; i < pixels.size(); i += stride) {
    const double predicted = luminance(lab_.light(pixels[i].predicted)), seen = luminance(lab_.light(pixels[i].seen));
    if (predicted > kDark && predicted < kBright && seen > kDark && seen < kBright) ratios.push_back(seen / predicted);
  }
  if (ratios.size() < kFewestPixels) {
    ++small_views_;
    return;
  }
  const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
  std::nth_element(ratios.begin(), middle, ratios.end());
  ++views_;
  for (std::size_t i = 0; i < pixels.size(); i += stride) {
    std::array<double, 3> predicted = lab_.light(pixels[i].predicted);
    for (double& channel : predicted) channel = std::min(1.0, channel * *middle);
    const double difference = ciede2000(LabOfRgb::of_light(predicted), lab_(pixels[i].seen));
    difference_.add(difference);
    within10_ += difference <= kClose ? 1 : 0;
    ++pixels_;
  }
}

void HeldOutFigures::report(ScenarioScore& score) const {
  Figures& f = score.figures;
  const Figure none{{}, "the cloud has no points in an image that was left out"};
  f["held_out_de00_median"] = pixels_ ? Figure{difference_.quantile(0.5), {}} : none;
  f["held_out_within10_share"] =
      pixels_ ? Figure{static_cast<double>(within10_) / static_cast<double>(pixels_), {}} : none;
  score.notes.push_back(
      fmt::format("left out of a second colouring: {} lens images, {} pixels of them compared with the cloud; {} lens "
                  "images with fewer than {} pixels",
                  views_, pixels_, small_views_, kFewestPixels));
  Chart chart{"Images that were left out, predicted from the cloud",
              "dE00",
              "% of pixels below",
              Chart::Kind::Lines,
              true,
              {},
              {}};
  chart.curves = {distribution("", difference_)};
  score.charts.push_back(std::move(chart));
}

void add_depth_edge_figures(const DepthEdgeFacts& facts, ScenarioScore& score) {
  const auto share = [](std::uint64_t part, std::uint64_t whole) {
    return whole ? Figure{static_cast<double>(part) / static_cast<double>(whole), {}}
                 : Figure{{}, "the laser has no depth edge in an examined image"};
  };
  score.figures["depth_edge_missed_share"] = share(facts.missed, facts.edges);
  score.figures["depth_edge_missed_share_by_chance"] = share(facts.missed_there, facts.places);
  score.notes.push_back(fmt::format("depth edges: {} in {} examined exposures, {} of them without an image edge",
                                    facts.edges, facts.exposures, facts.missed));
}

void add_unwatched_drift_figures(ScenarioScore& score) {
  for (const char* name : {"drift_noticed_s", "drift_false_alarms"})
    score.figures[name].reason = "images and laser were not watched for a drift";
}

void add_drift_figures(const std::vector<double>& told_s, std::optional<double> drift_s, ScenarioScore& score) {
  Figure& noticed = score.figures["drift_noticed_s"];
  noticed.reason = drift_s ? "the drift was not noticed" : "the head does not drift in this scenario";
  double false_alarms = 0;
  for (const double told : told_s) {
    if (!drift_s || told < *drift_s) {
      ++false_alarms;
    } else if (!noticed.value) {
      noticed = {told - *drift_s, {}};
    }
  }
  score.figures["drift_false_alarms"] = {false_alarms, {}};
}

}  // namespace hueline::score
