#include "score/reprojection_figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace hueline::score {
namespace {
// A point is near a seam if its angles to the two nearest axes differ by less than this, rad.
constexpr double kSeam = 4.0 * sim::kPi / 180;
}  // namespace

ReprojectionFigures::ReprojectionFigures(const sim::RigTruth& rig) : by_lens_(rig.lenses.size()) {
  for (const sim::TrueLens& lens : rig.lenses) axes_.push_back(lens.T_head_lens.R * sim::Vec3{0, 0, 1});
}

void ReprojectionFigures::add(double error_px, double distance_m, std::uint8_t lens, sim::Vec3 direction_head) {
  all_.add(error_px);
  const auto bin = std::upper_bound(kDistances_m.begin(), kDistances_m.end(), distance_m) - kDistances_m.begin();
  by_distance_[std::min<std::size_t>(static_cast<std::size_t>(bin), kDistances_m.size() - 1)].add(error_px);
  if (lens < by_lens_.size()) by_lens_[lens].add(error_px);
  double nearest = sim::kPi, second = sim::kPi;
  for (const sim::Vec3& axis : axes_) {
    const double angle = sim::angle_between(axis, direction_head);
    second = std::min(second, std::max(nearest, angle));
    nearest = std::min(nearest, angle);
  }
  if (second - nearest < kSeam) seam_.add(error_px);
}

void ReprojectionFigures::report(ScenarioScore& score) const {
  Figures& f = score.figures;
  const auto rms = [](const sim::Spread& s, const char* none) {
    return s.count() ? Figure{s.rms(), {}} : Figure{{}, none};
  };
  f["reprojection_rms_px"] = rms(all_, "no coloured point has a true pixel");
  f["reprojection_p95_px"] = all_.count() ? Figure{all_.quantile(0.95), {}} : f["reprojection_rms_px"];
  f["reprojection_near_rms_px"] = rms(by_distance_[1], "no coloured point is 2 to 5 m from the head");
  f["reprojection_seam_rms_px"] = rms(seam_, "no coloured point lies between two lenses");
  Chart distances{"Reprojection error by distance",
                  "m",
                  "px rms of 8000 x 4000",
                  Chart::Kind::Bars,
                  false,
                  {"< 2", "2-5", "5-10", "10-20", "20-40", "> 40"},
                  {}};
  Chart lenses{"Reprojection error by lens", "", "px rms of 8000 x 4000", Chart::Kind::Bars, false, {}, {}};
  Chart::Curve by_distance{"", {}, {}}, by_lens{"", {}, {}};
  for (std::size_t i = 0; i < by_distance_.size(); ++i)
    if (by_distance_[i].count()) by_distance.points.emplace_back(static_cast<double>(i), by_distance_[i].rms());
  for (std::size_t i = 0; i < by_lens_.size(); ++i) {
    lenses.bar_names.push_back(fmt::format("lens {}", i));
    if (by_lens_[i].count()) by_lens.points.emplace_back(static_cast<double>(i), by_lens_[i].rms());
  }
  lenses.bar_names.push_back("seams");
  if (seam_.count()) by_lens.points.emplace_back(static_cast<double>(by_lens_.size()), seam_.rms());
  distances.curves.push_back(std::move(by_distance));
  lenses.curves.push_back(std::move(by_lens));
  score.charts.push_back(std::move(distances));
  score.charts.push_back(std::move(lenses));
}

}  // namespace hueline::score
