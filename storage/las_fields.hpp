#pragma once

#include <cstring>
#include <string>
#include <vector>

#include "core/point_fields.hpp"
#include "storage/las_format.hpp"

/// Derives the extra bytes of a LAS file from a list of point fields (core/point_fields.hpp).
namespace hueline::storage {

template <class Number>
constexpr LasType las_type() {
  if constexpr (std::is_floating_point_v<Number>) {
    return sizeof(Number) == 4 ? LasType::F32 : LasType::F64;
  } else {
    constexpr LasType kTypes[] = {LasType::U8, LasType::U16, LasType::U32, LasType::U64};
    constexpr LasType kSigned[] = {LasType::I8, LasType::I16, LasType::I32, LasType::I64};
    return (std::is_signed_v<Number> ? kSigned : kTypes)[std::countr_zero(sizeof(Number))];
  }
}

/// Returns the descriptions of the extra bytes, in the order of the list.
template <const auto& Fields>
std::vector<LasExtraField> las_extra_fields() {
  std::vector<LasExtraField> out;
  for_each_field<Fields>([&](auto field) {
    if (const LasPlace& las = field.entry.las; las.is_extra)
      out.push_back({std::string(las.name), std::string(las.description), las_type<typename decltype(field)::Number>(),
                     0, las.scale != 1, las.scale});
  });
  return out;
}

/// Returns the number of extra bytes of one point.
template <const auto& Fields>
constexpr std::size_t las_extra_size() {
  std::size_t size = 0;
  for_each_field<Fields>([&](auto field) {
    if (field.entry.las.is_extra) size += sizeof(typename decltype(field)::Number);
  });
  return size;
}

/// Writes the extra bytes of one point to `at`, which must have room for them.
template <const auto& Fields, class Point>
void put_las_extra(const Point& point, std::byte* at) {
  for_each_field<Fields>([&](auto field) {
    if constexpr (decltype(field)::entry.las.is_extra) {
      const auto number = field.number(point);
      std::memcpy(at, &number, sizeof number);
      at += sizeof number;
    }
  });
}

/// Returns the name of the extra bytes that hold a member of ColouredPoint.
template <auto Member>
consteval std::string_view las_extra_name() {
  std::string_view name;
  for_each_field<kPointFields>([&](auto field) {
    if constexpr (std::is_same_v<std::remove_cvref_t<decltype(field.entry.member)>, decltype(Member)>)
      if (field.entry.member == Member && field.entry.las.is_extra) name = field.entry.las.name;
  });
  if (name.empty()) throw "this member is not in the extra bytes";
  return name;
}

}  // namespace hueline::storage
