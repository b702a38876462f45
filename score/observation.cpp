#include "score/observation.hpp"

#include <vector>

namespace hueline::score {
namespace {

constexpr std::size_t kExposuresAsked = 9;
constexpr std::uint16_t kOwnVehicle = 1;

bool is_visible(const Outlook& outlook, sim::Vec3 place, const std::vector<std::uint32_t>& exposures) {
  for (const std::uint32_t exposure : exposures)
    for (std::size_t lens = 0; lens < outlook.lens_count(); ++lens)
      if (const auto sight = outlook.sight(exposure, lens, place);
          sight && outlook.look(*sight, place).met == Outlook::Met::Place)
        return true;
  return false;
}

bool is_in_hole(const Outlook& outlook, sim::Vec3 place, std::uint32_t exposure) {
  for (std::size_t lens = 0; lens < outlook.lens_count(); ++lens)
    if (const auto sight = outlook.sight(exposure, lens, place)) {
      const auto look = outlook.look(*sight, place);
      if (look.met != Outlook::Met::Before || look.seen.surface != kOwnVehicle) return false;
    }
  return true;
}

}  // namespace

Observation observe(const Outlook& outlook, const sim::TrueReturn& truth, const std::optional<GivenColour>& given) {
  const sim::Vec3 place{truth.east, truth.north, truth.up};
  Observation out;
  out.surface = truth.surface;
  out.given = given;
  const auto exposures = outlook.nearest_exposures(truth.fired_gps_ns, kExposuresAsked);
  out.has_exposure = !exposures.empty();
  if (!out.has_exposure) return out;
  out.is_in_hole = is_in_hole(outlook, place, exposures.front());
  out.is_visible = is_visible(outlook, place, exposures);
  out.is_moving = outlook.world().is_moving(truth.surface);
  if (!given) return out;
  const auto sight = outlook.sight(given->exposure, given->lens, place);
  out.is_in_lens = sight.has_value();
  if (!sight) return out;
  const auto look = outlook.look(*sight, place);
  out.met = look.met;
  out.meets_moving = look.seen.is_hit && outlook.world().is_moving(look.seen.surface);
  out.edges = outlook.edges_around(*sight, place);
  return out;
}

}  // namespace hueline::score
