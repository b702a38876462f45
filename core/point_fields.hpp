#pragma once

#include <optional>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>

#include "core/coloured_point.hpp"

/// The one list of a coloured point's fields. The extra bytes of cloud.las, the fields of the cloud in view.mcap, the
/// comparison of clouds, the readers of the tests and the table in docs/formats.md are made from it. To add a field,
/// add a member to ColouredPoint and an entry here; a member without an entry does not compile.
namespace hueline {

/// The place of a field in LAS.
struct LasPlace {
  bool is_extra = false;  ///< in extra bytes of this project; otherwise in a field of the LAS format
  std::string_view name;  ///< name of that field
  /// For extra bytes: the description inside the file, at most 32 bytes. For a field of the format: how it holds the
  /// value.
  std::string_view description;
  double scale = 1;  ///< for extra bytes: the value is the stored number times `scale`
};
constexpr LasPlace las_own(std::string_view name, std::string_view how) { return {false, name, how}; }
constexpr LasPlace las_extra(std::string_view name, std::string_view description, double scale = 1) {
  return {true, name, description, scale};
}

/// One field of points of type Point.
template <class Point, class Value>
struct PointField {
  using value_type = Value;
  Value Point::*member;
  std::string_view name;     ///< as sentences and tables use it
  std::string_view unit;     ///< empty for a number without a unit
  std::string_view meaning;  ///< one or more sentences
  LasPlace las;
  std::string_view view{};      ///< name in the cloud of view.mcap; empty if the field is not there
  std::optional<Value> none{};  ///< the value of points that have none; nothing if every point has a value
};
template <class Point, class Value, class... Rest>
PointField(Value Point::*, Rest...) -> PointField<Point, Value>;

/// The fields in the order of cloud.las's extra bytes and of view.mcap's fields.
inline constexpr auto kPointFields = std::tuple{
    PointField{&ColouredPoint::east, "east", "m",
               "Place east of the cloud's origin, in the local level at that origin.",
               las_own("x", "easting in the map, steps of 0.001 of its unit"), "x"},
    PointField{&ColouredPoint::north, "north", "m", "Place north of the cloud's origin.",
               las_own("y", "northing in the map, steps of 0.001 of its unit"), "y"},
    PointField{&ColouredPoint::up, "up", "m", "Place above the cloud's origin.",
               las_own("z", "height in the file's CRS, steps of 0.001 of its unit"), "z"},
    PointField{&ColouredPoint::time, "time", "ns", "When the laser fired: GPS time since 1980-01-06.",
               las_own("GPS time", "GPS seconds - 1e9, which LAS calls adjusted standard GPS time")},
    PointField{&ColouredPoint::red, "red", "", "Red part of the sampled colour.", las_own("red", "times 257"), "red",
               std::uint8_t{0}},
    PointField{&ColouredPoint::green, "green", "", "Green part of the sampled colour.", las_own("green", "times 257"),
               "green", std::uint8_t{0}},
    PointField{&ColouredPoint::blue, "blue", "", "Blue part of the sampled colour.", las_own("blue", "times 257"),
               "blue", std::uint8_t{0}},
    PointField{&ColouredPoint::reflectivity, "reflectivity", "",
               "Strength of the echo as the scanner gives it, 0 to 255.", las_own("intensity", "times 257"),
               "intensity"},
    PointField{&ColouredPoint::return_number, "return number", "",
               "Number of the echo among those of its firing; 1 is the nearest.",
               las_own("return number", "as it is, at most the number of returns")},
    PointField{&ColouredPoint::return_count, "return count", "", "Number of echoes of the firing.",
               las_own("number of returns", "as it is, at most 15")},
    PointField{&ColouredPoint::sensor, "sensor", "", "The scanner: its number in the rig.",
               las_own("point source id", "as it is")},
    PointField{&ColouredPoint::exposure, "exposure", "",
               "Index of the exposure that gave the colour; the exposures of a drive are numbered by time.",
               las_extra("exposure", "exposure that gave the colour"), "", kNoExposure},
    PointField{&ColouredPoint::channel, "channel", "", "Ring of the laser, from the lowest elevation.",
               las_extra("channel", "laser channel")},
    PointField{&ColouredPoint::lens, "lens", "", "The lens that was sampled: its index in `head.lenses`.",
               las_extra("lens", "lens that was sampled"), "", kNoLens},
    PointField{
        &ColouredPoint::quality, "quality", "",
        "Quality of the colour, from 1 to 255 (best). It depends on the pixel's distance from the border, the "
        "exposure's distance in time, the clock's state, and on how far laser points vouch for the line of sight.",
        las_extra("quality", "0 uncoloured ... 255 best"), "quality", std::uint8_t{0}},
    PointField{
        &ColouredPoint::moving, "moving", "",
        "Confidence that the point lies on something that moves by itself, from 0 (no evidence that it moves) to "
        "255 (certain); from 128 on it is more likely than not.",
        las_extra("moving", "0 no evidence ... 255 moves"), "moving"},
    PointField{
        &ColouredPoint::state, "colour state", "",
        "0 Direct: coloured by the exposure that owns its time. 1 Neighbour: coloured by another exposure that "
        "is near enough. 2 NoExposure: no colour, because there is no usable exposure near enough. 3 Outside: no "
        "colour, because no exposure that is near enough has it in its image. 5 Hidden: no colour, because "
        "something hides it in each of these exposures.",
        las_extra("colour_state", "0 own 1 neighbour 2.. uncoloured")},
    PointField{&ColouredPoint::sigma_m, "sigma", "m", "One sigma of the place, from pose, time and range.",
               las_extra("sigma", "1-sigma position uncertainty, m")},
    PointField{&ColouredPoint::u, "u", "px",
               "Column of the pixel that was sampled, in the lens image or, with `method: panorama`, in the panorama. "
               "Pixel centres have whole numbers.",
               las_extra("image_u", "column that was sampled, px")},
    PointField{&ColouredPoint::v, "v", "px", "Row of the pixel that was sampled.",
               las_extra("image_v", "row that was sampled, px")},
};

/// Returns the number that is stored for a field's value: the whole number of a code, the nanoseconds of a time.
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

/// One entry of a list as a type, so that the compiler decides what depends on the entry.
template <const auto& Fields, std::size_t Index>
struct FieldOf {
  static constexpr const auto& entry = std::get<Index>(Fields);
  using Number = decltype(stored_number(typename std::remove_cvref_t<decltype(entry)>::value_type{}));
  template <class Point>
  static constexpr Number number(const Point& point) {
    return stored_number(point.*entry.member);
  }
};

/// Calls `visit` with a FieldOf for each entry, in the order of the list.
template <const auto& Fields, class Visit>
constexpr void for_each_field(Visit&& visit) {
  [&]<std::size_t... Index>(std::index_sequence<Index...>) { (visit(FieldOf<Fields, Index>{}), ...); }
  (std::make_index_sequence<std::tuple_size_v<std::remove_cvref_t<decltype(Fields)>>>{});
}

/// Converts to a member of any type; used to count members.
struct AnyMember {
  template <class T>
  operator T() const;
};
/// Returns the number of an aggregate's members.
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
