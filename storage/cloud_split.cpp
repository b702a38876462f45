#include "storage/cloud_split.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <cstddef>
#include <string_view>
#include <system_error>

#include "core/geodesy.hpp"

namespace hueline::storage {

Result<CloudSplit> CloudSplit::parse(const std::string& text) {
  const Error wrong{ErrorCode::Invalid,
                    "'" + text + "' is no way to cut a cloud; allowed: time:60s, distance:500m, tile:100m"};
  const std::size_t colon = text.find(':');
  if (colon == std::string::npos) return wrong;
  const std::string_view word = std::string_view(text).substr(0, colon);
  CloudSplit out;
  if (word == "time")
    out.kind = Kind::Time;
  else if (word == "distance")
    out.kind = Kind::Distance;
  else if (word == "tile")
    out.kind = Kind::Tile;
  else
    return wrong;
  const char* const end = text.data() + text.size();
  const auto [next, error] = std::from_chars(text.data() + colon + 1, end, out.size);
  const std::string_view unit(next, static_cast<std::size_t>(end - next));
  if (error != std::errc{} || (!unit.empty() && unit != (out.kind == Kind::Time ? "s" : "m"))) return wrong;
  if (!(out.size >= 0.1 && out.size <= 1e6))
    return Error{ErrorCode::Invalid, "'" + text + "': the size must be from 0.1 to 1000000"};
  return out;
}

std::string CloudSplit::text() const {
  switch (kind) {
    case Kind::Time:
      return fmt::format("time:{}s", size);
    case Kind::Distance:
      return fmt::format("distance:{}m", size);
    case Kind::Tile:
      break;
  }
  return fmt::format("tile:{}m", size);
}

void PathStrips::add(const InsSolution& solution) {
  constexpr double kStep_m = 0.5;
  constexpr std::size_t kMostEnds = 100'000;  // more strips than a cloud can have
  if (!solution.is_good) return;
  const Point<Ecef> place = to_ecef(solution.position);
  if (last_) {
    const double step = (place.xyz - last_->xyz).norm();
    if (step < kStep_m) return;
    driven_m_ += step;
  }
  last_ = place;
  while (ends_.size() < kMostEnds && driven_m_ >= length_m_ * static_cast<double>(ends_.size() + 1))
    ends_.push_back(solution.time);
}

}  // namespace hueline::storage
