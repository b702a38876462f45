#include "sim/visibility.hpp"

namespace hueline::sim {
namespace {
// Tolerances for two places on the same true surface. The rest is due to Embree's single precision, which matters more
// for a grazing ray.
constexpr double kSamePlace = 0.01, kSamePlacePerMetre = 5e-4;
}  // namespace

const char* name(Sight sight) {
  switch (sight) {
    case Sight::Visible:
      return "Visible";
    case Sight::Outside:
      return "Outside";
    case Sight::OwnVehicle:
      return "OwnVehicle";
    case Sight::Occluded:
      return "Occluded";
    case Sight::Moved:
      return "Moved";
  }
  return "?";
}

Visibility::Visibility(const Scenario& scenario, const Motion& motion, const World& world,
                       const std::vector<TrueExposure>& exposures)
    : motion_(motion), world_(world), rig_(rig_truth(scenario)), shutter_(scenario) {
  for (const TrueExposure& exposure : exposures) lens_gains_.push_back(exposure.lens_gain);
}

Sight Visibility::sight(const TrueReturn& point, std::size_t index, std::size_t number) const {
  const TrueLens& lens = rig_.lenses[index];
  const Vec3 p_enu{point.east, point.north, point.up};
  const std::vector<float> gains =
      number < lens_gains_.size() ? lens_gains_[number] : std::vector<float>(rig_.lenses.size(), 1.0f);
  const GpsNs middle = shutter_.mid(number, gains) + shutter_.lateness(gains, index);
  GpsNs t = middle;
  Pose T_enu_lens = motion_.T_enu_body(t) * rig_.T_body_head_at(t) * lens.T_head_lens;
  auto pixel = lens.project(inverse(T_enu_lens) * p_enu);
  // The row gives the time, and the time moves the row. Each iteration changes the row by far less than one row.
  for (int i = 0; i < 3 && shutter_.is_rolling() && pixel; ++i) {
    t = middle + shutter_.row_delay(pixel->v);
    T_enu_lens = motion_.T_enu_body(t) * rig_.T_body_head_at(t) * lens.T_head_lens;
    pixel = lens.project(inverse(T_enu_lens) * p_enu);
  }
  if (!pixel || !lens.contains(*pixel)) return Sight::Outside;
  const Vec3 to = p_enu - T_enu_lens.p;
  const double distance = length(to);
  const World::Ray ray{T_enu_lens.p, (1 / distance) * to, 0.01, distance + 1};
  const Moment moment = world_.moment(t);
  Seen seen;
  world_.look(moment, std::span(&ray, 1), 0, std::span(&seen, 1));
  const double beyond = seen.is_hit ? seen.distance_m - distance : 1.0,
               same = kSamePlace + kSamePlacePerMetre * distance;
  if (seen.is_hit && seen.is_hidden_by_glass()) return Sight::Occluded;
  if (seen.surface == point.surface && std::abs(beyond) <= same) return Sight::Visible;
  if (world_.is_moving(point.surface) && (seen.surface == point.surface || beyond > same)) return Sight::Moved;
  if (beyond >= -same) return Sight::Visible;
  return seen.surface == 1 ? Sight::OwnVehicle : Sight::Occluded;
}

}  // namespace hueline::sim
