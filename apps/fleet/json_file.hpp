#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "core/result.hpp"

/// Reads what a replay and the tasks of a fleet leave as JSON.
namespace hueline::apps {

/// Reads a file that holds one object; `what` names it in messages: "a result". Errors: those of read_input();
/// Malformed if it is no object of JSON.
Result<nlohmann::ordered_json> read_json(const std::filesystem::path& file, const char* what);

/// Returns the text at a JSON pointer; an empty one if there is none.
std::string text_at(const nlohmann::ordered_json& root, const char* pointer);
/// Returns the number at a JSON pointer; nothing if there is none.
std::optional<double> number_at(const nlohmann::ordered_json& root, const char* pointer);
/// Returns the list at a JSON pointer; an empty one if there is none.
nlohmann::ordered_json items_at(const nlohmann::ordered_json& root, const char* pointer);

}  // namespace hueline::apps
