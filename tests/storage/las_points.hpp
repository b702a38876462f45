#pragma once

#include <gtest/gtest.h>

#include <cmath>

#include "storage/las_fields.hpp"
#include "storage/las_reader.hpp"

namespace hueline::test {

/// Reads the extra bytes of one point into the members that the list names, as the file describes them.
template <const auto& Fields, class Point>
void read_extra(const storage::LasReader& reader, const storage::LasPoint& record, Point& point) {
  for_each_field<Fields>([&](auto field) {
    if constexpr (const auto& entry = decltype(field)::entry; decltype(field)::entry.las.is_extra) {
      const storage::LasExtraField* found = reader.extra_field(entry.las.name);
      ASSERT_NE(found, nullptr) << entry.las.name;
      using Number = typename decltype(field)::Number;
      const double stored = storage::LasReader::extra(record, *found) / entry.las.scale;
      const auto number = static_cast<Number>(std::is_integral_v<Number> ? std::nearbyint(stored) : stored);
      point.*entry.member = static_cast<typename std::remove_cvref_t<decltype(entry)>::value_type>(number);
    }
  });
}

}  // namespace hueline::test
