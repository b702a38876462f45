#include "core/point_fields.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>
#include <set>
#include <sstream>

#include "tests/support/test_data.hpp"

namespace hueline {
namespace {

TEST(PointFields, NameEachMemberOnce) {
  const ColouredPoint point;
  std::set<const void*> members;
  std::set<std::string_view> names, places;
  for_each_field<kPointFields>([&](auto field) {
    const auto& entry = field.entry;
    EXPECT_TRUE(members.insert(&(point.*entry.member)).second) << entry.name << " is the member of another entry";
    EXPECT_TRUE(names.insert(entry.name).second) << entry.name;
    EXPECT_TRUE(places.insert(entry.las.name).second) << entry.name << " has another field's place in cloud.las";
    EXPECT_FALSE(entry.meaning.empty()) << entry.name;
  });
}

TEST(PointFields, FitTheExtraBytesRecord) {
  for_each_field<kPointFields>([](auto field) {
    if (!field.entry.las.is_extra) return;
    EXPECT_LE(field.entry.las.name.size(), 32u) << field.entry.name;
    EXPECT_LE(field.entry.las.description.size(), 32u) << field.entry.name << " is cut off in the file";
  });
}

TEST(PointFields, AreWhatStandsForNoneInANewPoint) {
  const ColouredPoint point;
  for_each_field<kPointFields>([&](auto field) {
    const auto& entry = field.entry;
    EXPECT_TRUE(!entry.none || point.*entry.member == *entry.none) << entry.name;
  });
}

template <class Number>
std::string type_name() {
  return fmt::format("{}{}",
                     std::is_floating_point_v<Number> ? 'f'
                     : std::is_signed_v<Number>       ? 'i'
                                                      : 'u',
                     8 * sizeof(Number));
}

TEST(PointFields, StandInTheUsersDocument) {
  std::string table =
      "| field | type | unit | what it says | without one | in cloud.las | in view.mcap "
      "|\n|---|---|---|---|---|---|---|\n";
  for_each_field<kPointFields>([&](auto field) {
    const auto& entry = field.entry;
    const std::string none = entry.none ? fmt::format("{}", stored_number(*entry.none)) : "";
    const std::string las = entry.las.is_extra
                                ? fmt::format("extra bytes `{}`{}", entry.las.name,
                                              entry.las.scale == 1 ? "" : fmt::format(", times {}", entry.las.scale))
                                : fmt::format("{}: {}", entry.las.name, entry.las.description);
    table +=
        fmt::format("| {} | {} | {} | {} | {} | {} | {} |\n", entry.name, type_name<typename decltype(field)::Number>(),
                    entry.unit, entry.meaning, none, las, entry.view.empty() ? "" : fmt::format("`{}`", entry.view));
  });
  std::ifstream in(test::source_dir() / "docs" / "formats.md");
  std::ostringstream text;
  text << in.rdbuf();
  EXPECT_NE(text.str().find(table), std::string::npos) << "docs/formats.md lacks this table:\n" << table;
}

}  // namespace
}  // namespace hueline
