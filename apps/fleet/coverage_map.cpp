#include "apps/fleet/coverage_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "core/angle.hpp"
#include "core/printable.hpp"
#include "runtime/report_content.hpp"

namespace hueline::apps {
namespace {

constexpr double kEarthRadius = 6'371'000;  // m; a map of a page is no better than this
constexpr double kApart = 20'000;           // m
constexpr double kMapWidth = 760, kMapHeight = 460, kMapBorder = 24, kMostScale = 140;
constexpr double kTurn = 360;

/// The bounds of a drive, rad. The longitude does not jump at the date line: it is that of the first place plus less
/// than half a turn.
struct Bounds {
  double west = 1e9, east = -1e9, south = 1e9, north = -1e9;
  void take(double longitude, double latitude) {
    west = std::min(west, longitude), east = std::max(east, longitude);
    south = std::min(south, latitude), north = std::max(north, latitude);
  }
};

/// Returns the longitude plus whole turns, so that it is near the other one.
double near_to(double longitude, double other) {
  return longitude + std::round((other - longitude) * kDegPerRad / kTurn) * kTurn / kDegPerRad;
}

Bounds bounds_of(const CatalogueEntry& entry) {
  Bounds out;
  for (const Geodetic& place : entry.places)
    out.take(near_to(place.longitude, entry.places.front().longitude), place.latitude);
  return out;
}

/// Returns how many whole turns, rad, bring `moved` next to the bounds `near`.
double turns_to(const Bounds& moved, const Bounds& near) { return near_to(moved.west, near.west) - moved.west; }

bool are_neighbours(const Bounds& a, const Bounds& b) {
  const double latitude = std::max(std::abs(a.south), std::abs(a.north));
  const double margin = kApart / kEarthRadius, wide = margin / std::max(0.01, std::cos(latitude));
  const double shift = turns_to(b, a);
  return b.west + shift - wide <= a.east && a.west - wide <= b.east + shift && b.south - margin <= a.north &&
         a.south - margin <= b.north;
}

}  // namespace

const char* drive_class(const CatalogueEntry& entry) {
  for (const auto& [grade, word] : {std::pair{runtime::Grade::Good, "good"},
                                    {runtime::Grade::Remarks, "remarks"},
                                    {runtime::Grade::Again, "again"}})
    if (entry.verdict == runtime::name(grade)) return word;
  return "none";
}

std::vector<CoverageArea> coverage_areas(const std::vector<CatalogueEntry>& entries) {
  std::vector<Bounds> bounds(entries.size());
  std::vector<std::size_t> first(entries.size());  // a drive of the same area; at the end the first one
  std::iota(first.begin(), first.end(), std::size_t{0});
  const auto root = [&](std::size_t i) {
    while (first[i] != i) i = first[i] = first[first[i]];
    return i;
  };
  for (std::size_t i = 0; i < entries.size(); ++i) {
    if (entries[i].places.empty()) continue;
    bounds[i] = bounds_of(entries[i]);
    for (std::size_t k = 0; k < i; ++k)
      if (!entries[k].places.empty() && root(k) != root(i) && are_neighbours(bounds[k], bounds[i])) {
        const std::size_t one = root(i), other = root(k);
        first[std::max(one, other)] = std::min(one, other);
      }
  }
  std::vector<CoverageArea> out;
  std::vector<std::size_t> number(entries.size());
  for (std::size_t i = 0; i < entries.size(); ++i) {
    if (entries[i].places.empty()) continue;
    if (root(i) == i) {
      number[i] = out.size();
      out.emplace_back();
    }
    CoverageArea& area = out[number[root(i)]];
    area.drives.push_back(i);
    area.path_m += entries[i].path_m.value_or(0);
  }
  for (CoverageArea& area : out) {
    const Bounds& first_one = bounds[area.drives.front()];
    Bounds all;
    for (const std::size_t i : area.drives) {
      const double shift = turns_to(bounds[i], first_one);
      all.take(bounds[i].west + shift, bounds[i].south);
      all.take(bounds[i].east + shift, bounds[i].north);
    }
    area.latitude_deg = (all.south + all.north) / 2 * kDegPerRad;
    area.longitude_deg = std::remainder((all.west + all.east) / 2 * kDegPerRad, kTurn);
  }
  std::ranges::stable_sort(out, std::ranges::greater(), &CoverageArea::path_m);
  return out;
}

std::string coverage_map(const CoverageArea& area, const std::vector<CatalogueEntry>& entries) {
  const double middle = area.longitude_deg / kDegPerRad;
  const double shrink = std::cos(area.latitude_deg / kDegPerRad);
  Bounds all;  // m
  const auto metres = [&](const Geodetic& place) {
    return std::pair((near_to(place.longitude, middle) - middle) * shrink * kEarthRadius,
                     (place.latitude - area.latitude_deg / kDegPerRad) * kEarthRadius);
  };
  for (const std::size_t i : area.drives)
    for (const Geodetic& place : entries[i].places) {
      const auto [east, north] = metres(place);
      all.take(east, north);
    }
  const double scale = std::min((kMapWidth - 2 * kMapBorder) / std::max(all.east - all.west, 100.0),
                                (kMapHeight - 2 * kMapBorder) / std::max(all.north - all.south, 100.0));
  std::string out = fmt::format("<svg viewBox=\"0 0 {:.0f} {:.0f}\" role=\"img\" aria-label=\"map of the drives\">\n",
                                kMapWidth, kMapHeight);
  for (const std::size_t i : area.drives) {
    const CatalogueEntry& entry = entries[i];
    out += fmt::format("<polyline class=\"{}\" points=\"", drive_class(entry));
    std::optional<std::pair<double, double>> last;
    for (const Geodetic& place : entry.places) {
      const auto [east, north] = metres(place);
      const double x = kMapWidth / 2 + (east - (all.west + all.east) / 2) * scale,
                   y = kMapHeight / 2 - (north - (all.south + all.north) / 2) * scale;
      const bool is_last = &place == &entry.places.back();
      if (last && !is_last && std::hypot(x - last->first, y - last->second) < 0.7) continue;  // nothing to see
      out += fmt::format("{:.1f},{:.1f} ", x, y);
      last = {x, y};
    }
    out += fmt::format("\"><title>{}</title></polyline>\n", as_markup(printable(entry.name)));
  }
  const runtime::ScaleBar bar = runtime::scale_bar(scale, kMostScale);
  return out + fmt::format(
                   "<path class=\"bar\" d=\"M{0:.0f} {1:.0f}h{2:.1f}\"/><text x=\"{0:.0f}\" y=\"{3:.0f}\">{4}</text>"
                   "<text x=\"{5:.0f}\" y=\"18\">N &#8593;</text></svg>\n",
                   kMapBorder / 2, kMapHeight - 8, bar.length_m * scale, kMapHeight - 14, bar.words, kMapWidth - 34);
}

}  // namespace hueline::apps
