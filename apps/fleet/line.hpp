#pragma once

#include <bit>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "core/geodesy.hpp"

namespace hueline::apps {

/// A place of a line on a map: longitude and latitude in degrees.
using LinePlace = std::pair<double, double>;

/// Returns the line through these places, whose angles are in radians, without their heights. A line needs two places:
/// a single one stands in it twice. No place gives no line. Across the date line its longitudes go on beyond 180
/// degrees, because programs would draw it around the earth.
std::vector<LinePlace> line_of(const std::vector<Geodetic>& places);

/// Returns the line as well-known binary (OGC 06-103r4, 8.2), little endian.
std::string well_known_binary(const std::vector<LinePlace>& line);

/// Appends the bytes of a number, little endian.
template <class Number>
void put_number(std::string& out, Number value) {
  static_assert(std::endian::native == std::endian::little);
  char bytes[sizeof value];
  std::memcpy(bytes, &value, sizeof value);
  out.append(bytes, sizeof value);
}

}  // namespace hueline::apps
