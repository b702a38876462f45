#include "config/section.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "config/shipped.hpp"
#include "core/input_file.hpp"
#include "core/nearest_word.hpp"

namespace hueline::config {
namespace {

std::string shown(const YAML::Node& node) {
  constexpr std::size_t kMost = 60;  // a file in another form is one scalar
  if (node.IsScalar())
    return node.Scalar().size() <= kMost ? "'" + node.Scalar() + "'"
                                         : "a text of " + std::to_string(node.Scalar().size()) + " bytes";
  if (node.IsSequence()) return fmt::format("a list of {}", node.size());
  if (node.IsMap()) return "a mapping";
  return "nothing";
}

/// Returns the node that a path such as "lenses[1].width" leads to, or the last existing node on the way.
YAML::Node node_at(YAML::Node at, std::string_view path) {
  while (!path.empty()) {
    const std::size_t end = std::min(path.find_first_of(".[", path.starts_with('[') ? 1 : 0), path.size());
    const std::string step(path.substr(0, end));
    const YAML::Node next = step.starts_with('[') ? at[std::stoul(step.substr(1))] : at[step];
    if (!next.IsDefined()) break;
    at.reset(next);
    path.remove_prefix(end);
    if (path.starts_with('.')) path.remove_prefix(1);
  }
  return at;
}

}  // namespace

std::string read_configuration(const std::string& path) {
  if (path.starts_with(kShipped))
    for (const ShippedFile& file : shipped_files())
      if (file.path == std::string_view(path).substr(kShipped.size())) return std::string(file.text);
  auto text = read_input(path, kMostConfiguration, "a configuration");
  if (!text.ok())
    throw ConfigError(fmt::format("{}: cannot be read: {}; give the path of a YAML file", path, text.error().message));
  return std::move(*text);
}

Section Section::load_file(const std::string& path) { return load_text(read_configuration(path), path); }

Section Section::load_text(const std::string& text, const std::string& name) {
  std::vector<YAML::Node> documents;
  try {
    documents = YAML::LoadAll(text);
  } catch (const YAML::Exception& e) {
    throw ConfigError(fmt::format("{}:{}: not YAML: {}", name, e.mark.line + 1, e.msg));
  }
  // A line --- or ... at an end begins nothing.
  std::erase_if(documents, [](const YAML::Node& one) { return one.IsNull(); });
  if (documents.size() > 1)
    throw ConfigError(
        fmt::format("{}:{}: a second document begins here, behind a line ---, and a file has one: remove that line, or "
                    "give what follows it a file of its own",
                    name, documents[1].Mark().line + 1));
  const YAML::Node root = documents.empty() ? YAML::Node() : documents.front();
  return Section(root, std::make_shared<const std::string>(name), "");
}

Section::Section(YAML::Node node, std::shared_ptr<const std::string> file, std::string path)
    : node_(std::move(node)), file_(std::move(file)), path_(std::move(path)) {
  if (!node_.IsMap())
    throw ConfigError(fmt::format("{}: {}: expected a mapping of keys, found {}", where(node_),
                                  path_.empty() ? "the file" : "'" + path_ + "'", shown(node_)));
  std::set<std::string> seen;
  for (const auto& item : node_)
    if (!seen.insert(item.first.Scalar()).second)
      throw ConfigError(fmt::format("{}: key '{}' stands twice", where(item.first), item.first.Scalar()));
}

std::string Section::where(const YAML::Node& at) const { return fmt::format("{}:{}", *file_, at.Mark().line + 1); }

bool Section::has(const std::string& key) const {
  known_.insert(key);
  return node_[key].IsDefined();
}

YAML::Node Section::require(const std::string& key) {
  if (has(key)) return node_[key];
  // The message names what is there instead: an unknown key that looks like this one, or else all keys.
  std::vector<std::string> others, all;
  for (const auto& item : node_) {
    all.push_back(item.first.Scalar());
    if (!known_.contains(all.back())) others.push_back(all.back());
  }
  const std::string meant = nearest_word(key, others);
  throw ConfigError(fmt::format("{}: key '{}{}{}' is missing{}", where(node_), path_, path_.empty() ? "" : ".", key,
                                !meant.empty() ? fmt::format("; is '{}' meant for it?", meant)
                                               : fmt::format("; here are: {}", fmt::join(all, ", "))));
}

void Section::fail(const YAML::Node& at, const std::string& key, const std::string& allowed) const {
  throw ConfigError(fmt::format("{}: key '{}{}{}' is {}; allowed: {}", where(at), path_, path_.empty() ? "" : ".", key,
                                shown(at), allowed));
}

std::string Section::one_of(const std::vector<std::string>& keys, const std::string& otherwise) {
  std::vector<std::string> given;
  for (const std::string& key : keys)
    if (has(key)) given.push_back(key);
  if (given.size() == 1) return given.front();
  if (given.empty() && !otherwise.empty()) return otherwise;
  std::vector<std::string> unknown;
  for (const auto& item : node_)
    if (!known_.contains(item.first.Scalar())) unknown.push_back(item.first.Scalar());
  throw ConfigError(fmt::format("{}: {}: give exactly one of {}; {}", where(node_),
                                path_.empty() ? "the file" : "'" + path_ + "'", fmt::join(keys, ", "),
                                !given.empty() ? fmt::format("here are {}", fmt::join(given, " and "))
                                               : fmt::format("here are: {}", fmt::join(unknown, ", "))));
}

void Section::refuse(const std::string& key, const std::string& why) const {
  throw ConfigError(key.empty() ? fmt::format("{}: {}{}{}", where(node_), path_, path_.empty() ? "" : ": ", why)
                                : fmt::format("{}: key '{}{}{}' {}", where(node_at(node_, key)), path_,
                                              path_.empty() ? "" : ".", key, why));
}

double Section::checked(const YAML::Node& node, const std::string& key, Range range, std::string_view unit,
                        bool is_whole) const {
  double value = 0;
  std::int64_t whole = 0;
  const bool is_number = node.IsScalar() && (is_whole ? YAML::convert<std::int64_t>::decode(node, whole)
                                                      : YAML::convert<double>::decode(node, value));
  if (is_whole) value = static_cast<double>(whole);
  if (!is_number || !range.has(value)) fail(node, key, range.allowed(unit, is_whole));
  return value;
}

double Section::number(const std::string& key, Range range, std::string_view unit) {
  return checked(require(key), key, range, unit, false);
}
double Section::number(const std::string& key, Range range, double otherwise) {
  return has(key) ? number(key, range) : otherwise;
}

std::int64_t Section::integer(const std::string& key, Range range, std::string_view unit) {
  return static_cast<std::int64_t>(checked(require(key), key, range, unit, true));
}
std::int64_t Section::integer(const std::string& key, Range range, std::int64_t otherwise) {
  return has(key) ? integer(key, range) : otherwise;
}

bool Section::boolean(const std::string& key, bool otherwise) {
  if (!has(key)) return otherwise;
  bool value = false;
  if (!YAML::convert<bool>::decode(node_[key], value)) fail(node_[key], key, "true or false");
  return value;
}

std::string Section::text(const std::string& key, const TextForm& form) {
  const YAML::Node found = require(key);
  if (!found.IsScalar() || found.Scalar().empty() || (form.fits && !form.fits(found.Scalar())))
    fail(found, key, form.allowed);
  return found.Scalar();
}
std::string Section::text(const std::string& key, const std::string& otherwise) {
  return has(key) ? text(key) : otherwise;
}

std::vector<double> Section::numbers(const std::string& key, Range range, std::string_view unit, Count count,
                                     bool is_whole) {
  const YAML::Node found = require(key);
  const char* numbers = is_whole ? "whole numbers" : "numbers";
  if (!found.IsSequence()) fail(found, key, fmt::format("a list of {}", numbers));
  if (count.min == count.max && found.size() != count.min)
    fail(found, key, fmt::format("a list of {} {}", count.min, numbers));
  if (found.size() < count.min) fail(found, key, fmt::format("a list of at least {} {}", count.min, numbers));
  if (found.size() > count.max) fail(found, key, fmt::format("a list of at most {} {}", count.max, numbers));
  std::vector<double> out;
  for (const auto& item : found) out.push_back(checked(item, key, range, unit, is_whole));
  return out;
}
std::vector<std::string> Section::texts(const std::string& key, const TextForm& form) {
  const YAML::Node found = require(key);
  if (!found.IsSequence()) fail(found, key, "a list of texts");
  std::vector<std::string> out;
  for (const auto& item : found) {
    if (!item.IsScalar() || item.Scalar().empty() || (form.fits && !form.fits(item.Scalar())))
      fail(item, key, fmt::format("a list, each of its items {}", form.allowed));
    out.push_back(item.Scalar());
  }
  return out;
}

Section Section::section(const std::string& key) {
  return Section(require(key), file_, path_.empty() ? key : path_ + "." + key);
}

std::vector<Section> Section::list(const std::string& key) {
  const YAML::Node found = require(key);
  if (!found.IsSequence()) fail(found, key, "a list");
  std::vector<Section> out;
  for (std::size_t i = 0; i < found.size(); ++i)
    out.push_back(Section(found[i], file_, fmt::format("{}{}{}[{}]", path_, path_.empty() ? "" : ".", key, i)));
  return out;
}

void Section::finish() const {
  for (const auto& item : node_) {
    const std::string key = item.first.Scalar();
    if (known_.contains(key)) continue;
    std::string allowed;
    for (const auto& k : known_) allowed += (allowed.empty() ? "" : ", ") + k;
    const std::string meant = nearest_word(key, {known_.begin(), known_.end()});
    throw ConfigError(fmt::format("{}: key '{}{}{}' is not known{}; known here: {}", where(item.first), path_,
                                  path_.empty() ? "" : ".", key,
                                  meant.empty() ? "" : fmt::format(" (did you mean {}?)", meant), allowed));
  }
}

}  // namespace hueline::config
