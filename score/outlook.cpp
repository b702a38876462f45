#include "score/outlook.hpp"

#include <algorithm>
#include <cmath>

namespace hueline::score {

using sim::Vec3;

namespace {

double reference_gain_of(const std::vector<sim::TrueExposure>& exposures) {
  return exposures.empty() || exposures.front().lens_gain.empty() ? 1.0 : exposures.front().lens_gain.front();
}

}  // namespace

LabOfRgb::Encoding encoding_of(const sim::Scenario& scenario) {
  return scenario.camera.tone_curve == sim::ToneCurve::Linear ? LabOfRgb::Encoding::Linear : LabOfRgb::Encoding::Srgb;
}

Outlook::Outlook(const sim::Scenario& scenario, const std::vector<sim::TrueExposure>& exposures)
    : motion_(scenario),
      world_(scenario, motion_),
      rig_(sim::rig_truth(scenario)),
      shutter_(scenario),
      reference_gain_(reference_gain_of(exposures)),
      tone_(scenario.camera.tone_curve, scenario.camera.gain * reference_gain_),
      lab_(encoding_of(scenario)) {
  for (const sim::TrueExposure& e : exposures)
    stations_.push_back({e.exposure_mid_gps_ns,
                         world_.moment(e.exposure_mid_gps_ns),
                         {{e.R_enu_head}, {e.p_enu_head[0], e.p_enu_head[1], e.p_enu_head[2]}},
                         e.lens_gain});
}

std::optional<Outlook::Sight> Outlook::sight(std::uint32_t exposure, std::size_t lens, Vec3 place) const {
  const sim::TrueLens& optics = rig_.lenses[lens];
  sim::GpsNs time = stations_[exposure].mid;
  sim::Pose T_enu_lens = stations_[exposure].T_enu_head * optics.T_head_lens;
  auto pixel = optics.project(inverse(T_enu_lens) * place);
  // The row gives the time, and the time moves the row. Each iteration changes the row by far less than one row.
  for (int turn = 0; turn < 3 && !shutter_.is_one_moment() && pixel; ++turn) {
    time =
        stations_[exposure].mid + shutter_.lateness(stations_[exposure].lens_gain, lens) + shutter_.row_delay(pixel->v);
    T_enu_lens = motion_.T_enu_body(time) * rig_.T_body_head_at(time) * optics.T_head_lens;
    pixel = optics.project(inverse(T_enu_lens) * place);
  }
  if (!pixel || !optics.contains(*pixel)) return std::nullopt;
  return Sight{exposure, lens, *pixel, length(place - T_enu_lens.p), time, T_enu_lens.p};
}

sim::Moment Outlook::moment_of(const Sight& sight) const {
  const Station& station = stations_[sight.exposure];
  return sight.time == station.mid ? station.moment : world_.moment(sight.time);
}

Outlook::Look Outlook::look(const Sight& sight, Vec3 place) const {
  const sim::World::Ray ray{sight.eye, normalised(place - sight.eye), 0.01, 1000};
  Look out;
  world_.look(moment_of(sight), {&ray, 1}, static_cast<float>(1 / rig_.lenses[sight.lens].focal_x), {&out.seen, 1});
  const double distance = out.seen.is_hit ? out.seen.distance_m : ray.far_m;
  if (out.seen.is_hidden_by_glass()) {
    out.met = Met::Before;
    return out;
  }
  out.met = distance < sight.distance_m - kTolerance_m
                ? Met::Before
                : (distance > sight.distance_m + kTolerance_m ? Met::Behind : Met::Place);
  return out;
}

std::vector<std::uint32_t> Outlook::nearest_exposures(sim::GpsNs t, std::size_t count) const {
  std::vector<std::uint32_t> out;
  const auto after = std::lower_bound(stations_.begin(), stations_.end(), t,
                                      [](const Station& s, sim::GpsNs time) { return s.mid < time; });
  auto right = static_cast<std::size_t>(after - stations_.begin()), left = right;
  while (out.size() < count && (left > 0 || right < stations_.size())) {
    const bool take_left =
        right == stations_.size() || (left > 0 && t - stations_[left - 1].mid <= stations_[right].mid - t);
    out.push_back(static_cast<std::uint32_t>(take_left ? --left : right++));
  }
  return out;
}

Lab Outlook::lab_of(const sim::Seen& seen) const { return lab_(tone_.perfect(seen.colour)); }

Outlook::Edges Outlook::edges_around(const Sight& sight, Vec3 place) const {
  const sim::Moment moment = moment_of(sight);
  const sim::TrueLens& optics = rig_.lenses[sight.lens];
  const Vec3 eye = sight.eye, ahead = normalised(place - eye);
  // Two directions across the ray. Their choice does not matter, because they only span the circle.
  const Vec3 across = normalised(cross(ahead, std::abs(ahead.z) < 0.9 ? Vec3{0, 0, 1} : Vec3{1, 0, 0})),
             over = cross(ahead, across);
  const auto cone = static_cast<float>(1 / optics.focal_x);
  const auto far = [](const sim::Seen& s) { return s.is_hit ? s.distance_m : 1e6; };
  std::array<sim::World::Ray, sim::World::kBatch> rays;
  std::array<sim::Seen, sim::World::kBatch> seen;
  rays[0] = {eye, ahead, 0.01, 1000};
  world_.look(moment, std::span(rays).first(1), cone, std::span(seen).first(1));
  const double distance = far(seen[0]);
  const Lab colour = lab_of(seen[0]);

  Edges edges;
  for (std::size_t r = 0; r < kRadii_px.size() && edges.outline == kRadii_px.size(); ++r) {
    const double radius = kRadii_px[r] / optics.focal_x;
    for (std::size_t k = 0; k < rays.size(); ++k) {
      const double turn = 2 * sim::kPi * static_cast<double>(k) / static_cast<double>(rays.size());
      rays[k] = {eye, normalised(ahead + (radius * std::cos(turn)) * across + (radius * std::sin(turn)) * over), 0.01,
                 1000};
    }
    world_.look(moment, rays, cone, seen);
    // A slanting plane is not an outline. The inverse distance is linear on a plane, so the inverse distances of
    // opposite rays are compared with twice that of the middle.
    for (std::size_t k = 0; k < 4; ++k) {
      const double bend = std::abs(1 / far(seen[k]) + 1 / far(seen[k + 4]) - 2 / distance) * distance * distance;
      if (bend > 0.1 + 0.05 * distance) edges.outline = std::min(edges.outline, r);
    }
    for (const sim::Seen& s : seen)
      if (edges.any == kRadii_px.size() && ciede2000(lab_of(s), colour) > 10) edges.any = r;
  }
  edges.any = std::min(edges.any, edges.outline);
  return edges;
}

}  // namespace hueline::score
