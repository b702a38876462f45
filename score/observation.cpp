#include "score/observation.hpp"

#include <algorithm>
#include <vector>

namespace hueline::score {
namespace {

constexpr std::size_t kExposuresAsked = 9;

/// How the lenses of one exposure see a place.
struct SeenFrom {
  std::uint32_t exposure = 0;
  bool is_in_image = false;  // and the own vehicle does not hide it
  bool is_visible = false;
};
SeenFrom seen_from(const Outlook& outlook, sim::Vec3 place, std::uint32_t exposure) {
  SeenFrom out{exposure, false, false};
  for (std::size_t lens = 0; lens < outlook.lens_count() && !out.is_visible; ++lens)
    if (const auto sight = outlook.sight(exposure, lens, place)) {
      const auto look = outlook.look(*sight, place);
      out.is_in_image |= look.met != Outlook::Met::Before || look.seen.surface != kOwnVehicle;
      out.is_visible = look.met == Outlook::Met::Place;
    }
  return out;
}

/// Asks exposures for one place, each once at most, because every answer costs rays.
class Asked {
 public:
  Asked(const Outlook& outlook, sim::Vec3 place) : outlook_(outlook), place_(place) {}
  const SeenFrom& operator()(std::uint32_t exposure) {
    const auto known =
        std::find_if(known_.begin(), known_.end(), [&](const SeenFrom& s) { return s.exposure == exposure; });
    return known != known_.end() ? *known : known_.emplace_back(seen_from(outlook_, place_, exposure));
  }

 private:
  const Outlook& outlook_;
  sim::Vec3 place_;
  std::vector<SeenFrom> known_;
};

bool is_in_hole(const Outlook& outlook, sim::Vec3 place, std::uint32_t exposure) {
  for (std::size_t lens = 0; lens < outlook.lens_count(); ++lens)
    if (const auto sight = outlook.sight(exposure, lens, place)) {
      const auto look = outlook.look(*sight, place);
      if (look.met != Outlook::Met::Before || look.seen.surface != kOwnVehicle) return false;
    }
  return true;
}

}  // namespace

Candidates::Candidates(const std::vector<sim::GpsNs>& mids, const std::vector<bool>& is_there, int per_side) {
  std::vector<sim::GpsNs> intervals;
  for (std::size_t i = 1; i < mids.size(); ++i) intervals.push_back(mids[i] - mids[i - 1]);
  for (std::size_t i = 0; i < mids.size(); ++i)
    if (is_there[i]) there_.emplace_back(mids[i], static_cast<std::uint32_t>(i));
  if (intervals.empty()) return;
  const auto middle = intervals.begin() + static_cast<std::ptrdiff_t>(intervals.size() / 2);
  std::nth_element(intervals.begin(), middle, intervals.end());
  reach_ = *middle * per_side + *middle / 2;
}

std::vector<std::uint32_t> Candidates::of(sim::GpsNs fired) const {
  std::vector<std::pair<sim::GpsNs, std::uint32_t>> near;
  for (auto it = std::lower_bound(there_.begin(), there_.end(), std::pair{fired - reach_, std::uint32_t{0}});
       it != there_.end() && it->first <= fired + reach_; ++it)
    near.emplace_back(std::abs(it->first - fired), it->second);
  std::sort(near.begin(), near.end());
  std::vector<std::uint32_t> out;
  for (const auto& [away, number] : near) out.push_back(number);
  return out;
}

Observation observe(const Outlook& outlook, const sim::TrueReturn& truth, const Candidates& candidates,
                    const std::optional<GivenColour>& given) {
  const sim::Vec3 place{truth.east, truth.north, truth.up};
  Observation out;
  out.surface = truth.surface;
  out.given = given;
  const auto exposures = outlook.nearest_exposures(truth.fired_gps_ns, kExposuresAsked);
  out.has_exposure = !exposures.empty();
  if (!out.has_exposure) return out;
  out.is_in_hole = is_in_hole(outlook, place, exposures.front());
  Asked asked(outlook, place);
  // The candidates come first: nearly all of them are among the nine, and the first one mostly sees the place.
  for (const std::uint32_t exposure : candidates.of(truth.fired_gps_ns)) {
    const SeenFrom& seen = asked(exposure);
    out.is_in_candidate |= seen.is_in_image;
    out.is_seen_by_candidate = seen.is_visible;
    if (seen.is_visible) break;
  }
  out.is_visible = std::any_of(exposures.begin(), exposures.end(),
                               [&](std::uint32_t exposure) { return asked(exposure).is_visible; });
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
