#include "apps/fleet/json_file.hpp"

#include <cstdint>

#include "core/input_file.hpp"

namespace hueline::apps {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::uint64_t kLargest = 100'000'000;  // bytes; the summary of a long drive takes thousands

}  // namespace

Result<Json> read_json(const std::filesystem::path& file, const char* what) {
  const auto text = read_input(file, kLargest, what);
  if (!text.ok()) return text.error();
  Json root = Json::parse(*text, nullptr, false);
  if (!root.is_object()) return Error{ErrorCode::Malformed, file.string() + ": is not an object of JSON"};
  return root;
}

std::string text_at(const Json& root, const char* pointer) {
  const Json::json_pointer place(pointer);
  return root.contains(place) && root.at(place).is_string() ? root.at(place).get<std::string>() : std::string();
}

std::optional<double> number_at(const Json& root, const char* pointer) {
  const Json::json_pointer place(pointer);
  if (!root.contains(place) || !root.at(place).is_number()) return {};
  return root.at(place).get<double>();
}

Json items_at(const Json& root, const char* pointer) {
  const Json::json_pointer place(pointer);
  return root.contains(place) && root.at(place).is_array() ? root.at(place) : Json::array();
}

}  // namespace hueline::apps
