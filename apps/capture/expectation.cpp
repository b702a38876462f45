#include "apps/capture/expectation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "apps/sha256.hpp"
#include "core/json_text.hpp"
#include "core/output_file.hpp"
#include "core/printable.hpp"

namespace hueline::apps {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

constexpr const char* kSummary = "summary.json";
constexpr std::array kHashed{"cloud.las", "cloud.laz", "cloud.copc.laz", "view.mcap"};
constexpr std::array kHeld{"/verdict/grade", "/journal/packets", "/journal/sequence_gaps", "/points/total"};

/// Reads a JSON file. nlohmann::json's parser has its own stack: a deep file does not exhaust the program's.
Result<Json> read_json(const fs::path& file) {
  std::ifstream in(file);
  if (!in) return Error{ErrorCode::Io, file.string() + ": cannot be opened"};
  Json root = Json::parse(in, nullptr, false);
  if (root.is_discarded()) return Error{ErrorCode::Invalid, file.string() + ": is not JSON"};
  return root;
}

/// Returns why the object is not a pair of bounds; empty if it is.
std::string wrong_bounds(const Json& bounds) {
  if (bounds.empty()) return "has no bound; allowed: least, most or both";
  for (const auto& [word, value] : bounds.items()) {
    if (word != "least" && word != "most") return fmt::format("has '{}'; allowed: least, most or both", word);
    if (!value.is_number()) return fmt::format("{} is {}; allowed: a number", word, json_text(value));
  }
  return {};
}

/// Returns what is wrong with the expectation; empty if nothing is.
std::string wrong_form(const Json& root) {
  if (!root.is_object()) return "is not an object with sha256 and summary";
  for (const auto& [word, part] : root.items()) {
    if (word != "sha256" && word != "summary") return fmt::format("has '{}'; allowed: sha256 and summary", word);
    if (!part.is_object()) return fmt::format("{} is not an object", word);
    for (const auto& [name, value] : part.items()) {
      if (word == "sha256") {
        // A name of a product, not a path to somewhere else.
        if (name.empty() || fs::path(name).filename() != name)
          return fmt::format("sha256: '{}' is not the name of a file in the folder of --out", name);
        if (!value.is_string()) return fmt::format("sha256: {} is {}; allowed: a text", name, json_text(value));
        continue;
      }
      if (!name.starts_with('/'))
        return fmt::format("summary: '{}' is no JSON pointer; allowed: such as /points/total", name);
      if (value.is_array()) return fmt::format("summary: {} is a list; allowed: a value or its bounds", name);
      if (!value.is_object()) continue;
      if (const std::string wrong = wrong_bounds(value); !wrong.empty())
        return fmt::format("summary: {} {}", name, wrong);
    }
  }
  return {};
}

Result<Json> read_expectation(const fs::path& file) {
  auto root = read_json(file);
  if (!root.ok()) return root;
  if (const std::string wrong = wrong_form(*root); !wrong.empty())
    return Error{ErrorCode::Invalid, file.string() + ": " + wrong};
  return root;
}

/// Returns the value at the pointer; null if there is none or the pointer is wrong.
const Json* at(const Json& root, const std::string& pointer) {
  try {
    const Json::json_pointer place(pointer);
    return root.contains(place) ? &root.at(place) : nullptr;
  } catch (const nlohmann::json::exception&) {
    return nullptr;
  }
}

/// Returns what is wrong with the value; empty if it is as wanted.
std::string difference(const Json* found, const Json& wanted) {
  if (found == nullptr) return fmt::format("expected {}, and summary.json has no such value", json_text(wanted));
  if (!wanted.is_object())
    return *found == wanted ? "" : fmt::format("expected {}, found {}", json_text(wanted), json_text(*found));
  const bool holds = found->is_number() &&
                     (!wanted.contains("least") || found->get<double>() >= wanted["least"].get<double>()) &&
                     (!wanted.contains("most") || found->get<double>() <= wanted["most"].get<double>());
  return holds ? "" : fmt::format("expected {}, found {}", json_text(wanted), json_text(*found));
}

/// Returns the text with the signs of XML written out.
std::string xml(const std::string& text) { return as_markup(printable(text, LineEnds::Escape)); }

}  // namespace

Status check_expectation(const fs::path& file) {
  const auto root = read_expectation(file);
  return root.ok() ? Status() : Status(root.error());
}

Result<std::vector<Expected>> compare_with_expectation(const fs::path& file, const fs::path& folder) {
  const auto root = read_expectation(file);
  if (!root.ok()) return root.error();
  std::vector<Expected> out;
  if (const auto hashes = root->find("sha256"); hashes != root->end())
    for (const auto& [name, wanted] : hashes->items()) {
      const auto found = sha256_of(folder / name);
      std::string problem;
      if (!found.ok())
        problem = found.error().message;
      else if (*found != wanted.get<std::string>())
        problem = fmt::format("expected {}, found {}", wanted.get<std::string>(), *found);
      out.push_back({"sha256 " + name, std::move(problem)});
    }
  if (const auto values = root->find("summary"); values != root->end()) {
    const auto summary = read_json(folder / kSummary);
    if (!summary.ok()) return summary.error();
    for (const auto& [pointer, wanted] : values->items())
      out.push_back({"summary " + pointer, difference(at(*summary, pointer), wanted)});
  }
  return out;
}

Status write_expectation(const fs::path& file, const fs::path& folder) {
  Json root = Json::object();
  for (const char* name : kHashed) {
    std::error_code unknown;
    if (!fs::exists(folder / name, unknown)) continue;
    const auto hash = sha256_of(folder / name);
    if (!hash.ok()) return hash.error();
    root["sha256"][name] = *hash;
  }
  const auto summary = read_json(folder / kSummary);
  if (!summary.ok()) return summary.error();
  for (const char* pointer : kHeld)
    if (const Json* value = at(*summary, pointer); value != nullptr) root["summary"][pointer] = *value;
  return write_output(file, root.dump(2) + "\n");
}

std::string junit_of(const std::vector<Expected>& results, const std::string& recording) {
  const auto failures =
      std::count_if(results.begin(), results.end(), [](const auto& one) { return !one.problem.empty(); });
  std::string out = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites>\n<testsuite name=\"hueline replay {}\" tests=\"{}\" "
      "failures=\"{}\">\n",
      xml(recording), results.size(), failures);
  for (const Expected& one : results) {
    out += fmt::format("<testcase classname=\"hueline.replay\" name=\"{}\"", xml(one.name));
    out += one.problem.empty() ? "/>\n" : fmt::format("><failure message=\"{}\"/></testcase>\n", xml(one.problem));
  }
  return out + "</testsuite>\n</testsuites>\n";
}

}  // namespace hueline::apps
