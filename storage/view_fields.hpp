#pragma once

#include <string>

#include "core/point_fields.hpp"
#include "storage_proto/foxglove/PointCloud.pb.h"

/// Derives the fields of the cloud in view.mcap from a list of point fields (core/point_fields.hpp). Floating-point
/// numbers become float32, integers keep their type. Foxglove expects a colour as four fields, so an alpha of 255
/// follows the field "blue".
namespace hueline::storage {

template <class Number>
using ViewNumber = std::conditional_t<std::is_floating_point_v<Number>, float, Number>;

/// Appends the values of one point's view fields to `out`.
template <const auto& Fields, class Point>
void pack_view(const Point& point, std::string& out) {
  const auto pack = [&out](auto value) { out.append(reinterpret_cast<const char*>(&value), sizeof value); };
  for_each_field<Fields>([&](auto field) {
    if constexpr (!decltype(field)::entry.view.empty())
      pack(static_cast<ViewNumber<typename decltype(field)::Number>>(field.number(point)));
    if constexpr (decltype(field)::entry.view == "blue") pack(std::uint8_t{255});
  });
}

/// Describes in the message what pack_view() appends for each point.
template <const auto& Fields>
void describe_view(foxglove::PointCloud& cloud) {
  using Field = foxglove::PackedElementField;
  std::size_t offset = 0;
  const auto add = [&]<class Number>(std::string_view name, Number) {
    Field& field = *cloud.add_fields();
    field.set_name(std::string(name));
    field.set_offset(static_cast<std::uint32_t>(offset));
    if constexpr (std::is_floating_point_v<Number>) {
      field.set_type(Field::FLOAT32);
    } else {
      static_assert(std::is_unsigned_v<Number> && sizeof(Number) <= 4, "a PackedElementField has no such type");
      field.set_type(sizeof(Number) == 1 ? Field::UINT8 : sizeof(Number) == 2 ? Field::UINT16 : Field::UINT32);
    }
    offset += sizeof(Number);
  };
  for_each_field<Fields>([&](auto field) {
    if constexpr (!decltype(field)::entry.view.empty())
      add(field.entry.view, ViewNumber<typename decltype(field)::Number>{});
    if constexpr (decltype(field)::entry.view == "blue") add("alpha", std::uint8_t{255});
  });
  cloud.set_point_stride(static_cast<std::uint32_t>(offset));
}

}  // namespace hueline::storage
