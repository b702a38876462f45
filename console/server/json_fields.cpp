#include "console/server/json_fields.hpp"

namespace hueline::console {

using nlohmann::ordered_json;

std::string text_in(const ordered_json& json, const char* key) {
  return json.contains(key) && json[key].is_string() ? json[key].get<std::string>() : std::string();
}

double number_in(const ordered_json& json, const char* key, double otherwise) {
  return json.contains(key) && json[key].is_number() ? json[key].get<double>() : otherwise;
}

const ordered_json& list_in(const ordered_json& json, const char* key) {
  static const ordered_json kNone = ordered_json::array();
  return json.contains(key) && json[key].is_array() ? json[key] : kNone;
}

ordered_json value_at(const ordered_json& json, std::initializer_list<const char*> path) {
  const ordered_json* at = &json;
  for (const char* key : path) {
    if (!at->is_object() || !at->contains(key)) return {};
    at = &(*at)[key];
  }
  return *at;
}

}  // namespace hueline::console
