#include "core/json_text.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace hueline {
namespace {

TEST(JsonText, KeepsTheOrderAndIndentsIfAsked) {
  const nlohmann::ordered_json json{{"z", 1}, {"a", {1.5, "Straße"}}};
  EXPECT_EQ(json_text(json), R"({"z":1,"a":[1.5,"Straße"]})");
  EXPECT_EQ(json_text(json, 1), "{\n \"z\": 1,\n \"a\": [\n  1.5,\n  \"Straße\"\n ]\n}");
}

TEST(JsonText, BytesOfAnotherEncodingAreReplaced) {
  EXPECT_EQ(json_text(nlohmann::ordered_json{{"name", "Stra\xDF\x65"}}), "{\"name\":\"Stra\xEF\xBF\xBD\x65\"}");
}

}  // namespace
}  // namespace hueline
