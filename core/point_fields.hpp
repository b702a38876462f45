#pragma once

#include <optional>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>

#include "core/coloured_point.hpp"

/// The one list of a coloured point's fields. The extra bytes of cloud.las, the fields of view.mcap's cloud, the
/// comparison of clouds, the tests' readers and the table in docs/formats.md are made from it. A new field is a member
/// of ColouredPoint and one entry here; a member without an entry does not compile.
namespace hueline {

/// Where LAS keeps a field.
struct LasPlace {
  bool is_extra = false;  ///< in extra bytes of our own; else in a field that the format has itself
  std::string_view name;  ///< of that field
  /// Of extra bytes: what the file itself says of them, at most 32 bytes. Of LAS's own fields: how they hold the value.
  std::string_view description;
  double scale = 1;  ///< of extra bytes: the value is the stored number times this
};
constexpr LasPlace las_own(std::string_view name, std::string_view how) { return {false, name, how}; }
constexpr LasPlace las_extra(std::string_view name, std::string_view description, double scale = 1) {
  return {true, name, description, scale};
}

/// One field of points of the type Point.
template <class Point, class Value>
struct PointField {
  using value_type = Value;
  Value Point::*member;
  std::string_view name;     ///< in sentences and tables
  std::string_view unit;     ///< empty: a number without a unit
  std::string_view meaning;  ///< one sentence, or more
  LasPlace las;
  std::string_view view{};      ///< its name in view.mcap's cloud; empty: it is not shown
  std::optional<Value> none{};  ///< what stands there in a point that has none; empty: every point has one
};
template <class Point, class Value, class... Rest>
PointField(Value Point::*, Rest...) -> PointField<Point, Value>;

/// In the order of cloud.las's extra bytes and of view.mcap's fields.
inline constexpr auto kPointFields = std::tuple{
    PointField{&ColouredPoint::east, "east", "m", "Place east of the cloud's origin, in the local level there.",
               las_own("x", "easting in the map, steps of 1 mm"), "x"},
    PointField{&ColouredPoint::north, "north", "m", "Place north of it.",
               las_own("y", "northing in the map, steps of 1 mm"), "y"},
    PointField{&ColouredPoint::up, "up", "m", "Place above it.",
               las_own("z", "height above the WGS84 ellipsoid, steps of 1 mm; no geoid is applied"), "z"},
    PointField{&ColouredPoint::time, "time", "ns", "When the laser fired: GPS time since 1980-01-06.",
               las_own("GPS time", "GPS seconds - 1e9, which LAS calls adjusted standard GPS time")},
    PointField{&ColouredPoint::red, "red", "", "Red part of the sampled colour.", las_own("red", "times 257"), "red",
               std::uint8_t{0}},
    PointField{&ColouredPoint::green, "green", "", "Green part of it.", las_own("green", "times 257"), "green",
               std::uint8_t{0}},
    PointField{&ColouredPoint::blue, "blue", "", "Blue part of it.", las_own("blue", "times 257"), "blue",
               std::uint8_t{0}},
    PointField{&ColouredPoint::reflectivity, "reflectivity", "",
               "Strength of the echo, as the scanner gives it in 0 .. 255.", las_own("intensity", "times 257"),
               "intensity"},
    PointField{&ColouredPoint::return_number, "return number", "", "Which echo of its pulse it is; 1 is the nearest.",
               las_own("return number", "as it is, at most the number of returns")},
    PointField{&ColouredPoint::return_count, "return count", "", "How many echoes the pulse had.",
               las_own("number of returns", "as it is, at most 15")},
    PointField{&ColouredPoint::sensor, "sensor", "", "The scanner, by its number in the rig.",
               las_own("point source id", "as it is")},
    PointField{&ColouredPoint::exposure, "exposure", "",
               "Index in the drive, by time, of the exposure that gave the colour.",
               las_extra("exposure", "exposure that gave the colour"), "", kNoExposure},
    PointField{&ColouredPoint::channel, "channel", "", "Ring of the laser, from the lowest elevation.",
               las_extra("channel", "laser channel")},
    PointField{&ColouredPoint::lens, "lens", "", "The lens that was sampled: its place in `head.lenses`.",
               las_extra("lens", "lens that was sampled"), "", kNoLens},
    PointField{&ColouredPoint::quality, "quality", "",
               "How good the colour is, 1 to 255 best: by the pixel's distance from the border, the exposure's in "
               "time, and the clock's state.",
               las_extra("quality", "0 uncoloured ... 255 best"), "quality", std::uint8_t{0}},
    PointField{&ColouredPoint::state, "colour state", "",
               "0 Direct: coloured by the exposure that owns its time. 1 Neighbour: by one nearby, for the owner sees "
               "the vehicle or nothing there. 2 NoExposure: without "
               "a colour, for no usable exposure owns its time. 3 Outside: without a colour, for no exposure near "
               "enough sees it.",
               las_extra("colour_state", "0 own 1 neighbour 2.. uncoloured")},
    PointField{&ColouredPoint::sigma_m, "sigma", "m", "One sigma of the place, from pose, time and range.",
               las_extra("sigma", "1-sigma position uncertainty, m")},
    PointField{&ColouredPoint::u, "u", "px",
               "Column of the pixel that was sampled, of the lens image or, with `method: panorama`, of the panorama; "
               "centres at whole numbers.",
               las_extra("image_u", "column that was sampled, px")},
    PointField{&ColouredPoint::v, "v", "px", "Row of that pixel.", las_extra("image_v", "row that was sampled, px")},
};

/// A field's value as a number to store: codes as their whole number, times in ns.
template <class Value>
constexpr auto stored_number(Value value) {
  if constexpr (std::is_same_v<Value, GpsTime>) {
    return count_ns(value);
  } else if constexpr (std::is_enum_v<Value>) {
    return static_cast<std::underlying_type_t<Value>>(value);
  } else {
    return value;
  }
}

/// One entry of a list as a type, so that what depends on the entry is decided by the compiler.
template <const auto& Fields, std::size_t Index>
struct FieldOf {
  static constexpr const auto& entry = std::get<Index>(Fields);
  using Number = decltype(stored_number(typename std::remove_cvref_t<decltype(entry)>::value_type{}));
  template <class Point>
  static constexpr Number number(const Point& point) {
    return stored_number(point.*entry.member);
  }
};

/// Calls `visit` with a FieldOf for each entry, in the list's order.
template <const auto& Fields, class Visit>
constexpr void for_each_field(Visit&& visit) {
  [&]<std::size_t... Index>(std::index_sequence<Index...>) { (visit(FieldOf<Fields, Index>{}), ...); }
  (std::make_index_sequence<std::tuple_size_v<std::remove_cvref_t<decltype(Fields)>>>{});
}

/// Stands for a member of any type.
struct AnyMember {
  template <class T>
  operator T() const;
};
/// Number of an aggregate's members.
template <class Aggregate, class... Given>
consteval std::size_t count_members() {
  if constexpr (requires { Aggregate{Given{}..., AnyMember{}}; }) {
    return count_members<Aggregate, Given..., AnyMember>();
  } else {
    return sizeof...(Given);
  }
}
static_assert(std::tuple_size_v<decltype(kPointFields)> == count_members<ColouredPoint>(),
              "each member of ColouredPoint needs its entry in kPointFields");

}  // namespace hueline
