#include "apps/fleet/line.hpp"

#include <cmath>
#include <cstdint>

#include "core/angle.hpp"

namespace hueline::apps {

std::vector<LinePlace> line_of(const std::vector<Geodetic>& places) {
  std::vector<LinePlace> out;
  constexpr double kTurn_deg = 360;
  for (const Geodetic& one : places) {
    const double longitude = one.longitude * kDegPerRad;
    const double turns = out.empty() ? 0 : std::round((out.back().first - longitude) / kTurn_deg);
    out.emplace_back(longitude + turns * kTurn_deg, one.latitude * kDegPerRad);
  }
  if (out.size() == 1) out.push_back(out.front());
  return out;
}

std::string well_known_binary(const std::vector<LinePlace>& line) {
  // Byte order, type 2, number of points.
  std::string out = "\1";
  put_number(out, std::uint32_t{2});
  put_number(out, static_cast<std::uint32_t>(line.size()));
  for (const auto& [x, y] : line) {
    put_number(out, x);
    put_number(out, y);
  }
  return out;
}

}  // namespace hueline::apps
