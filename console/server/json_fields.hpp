#pragma once

#include <initializer_list>
#include <nlohmann/json.hpp>
#include <string>

/// Fields of JSON that others have written: what is not there, or of another type, is as good as not given.
/// Thread safety: pure functions.
namespace hueline::console {

/// Returns the text of a field; empty if there is none.
std::string text_in(const nlohmann::ordered_json& json, const char* key);
/// Returns the number of a field, or `otherwise`.
double number_in(const nlohmann::ordered_json& json, const char* key, double otherwise);
/// Returns the list of a field, as long as `json` lives; an empty one if there is none.
const nlohmann::ordered_json& list_in(const nlohmann::ordered_json& json, const char* key);
/// Returns the value at a path of keys, or null.
nlohmann::ordered_json value_at(const nlohmann::ordered_json& json, std::initializer_list<const char*> path);

}  // namespace hueline::console
