#pragma once

#include <yaml-cpp/yaml.h>

#include <cstdint>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "core/keys.hpp"

namespace hueline::config {

/// An error in a configuration: file, line, key, what was found and what is allowed. It is thrown at start-up only, and
/// caught once, in main.
class ConfigError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The greatest size of a configuration, bytes. The files that people write have some thousand.
constexpr std::uint64_t kMostConfiguration = 1'000'000;
/// Returns the text of a configuration of at most that size. Throws ConfigError if it cannot be read.
std::string read_configuration(const std::string& path);

/// One mapping of a YAML file, read strictly. A key that is missing, has the wrong type or is out of range is an error
/// at its line. Duplicate keys are errors too, and finish() refuses every key that was not asked for.
/// Thread safety: none; one thread calls all functions.
class Section {
 public:
  /// Reads a whole file or text. `name` stands for the file in messages.
  static Section load_file(const std::string& path);
  static Section load_text(const std::string& text, const std::string& name);

  /// Returns whether the key is present. From now on it counts as known.
  bool has(const std::string& key) const;
  /// The functions without `otherwise` require the key. The others return `otherwise` if it is absent. All throw
  /// ConfigError for a value of the wrong type or outside the range. `unit` is named in that message.
  double number(const std::string& key, Range range, std::string_view unit = {});
  double number(const std::string& key, Range range, double otherwise);
  std::int64_t integer(const std::string& key, Range range, std::string_view unit = {});
  std::int64_t integer(const std::string& key, Range range, std::int64_t otherwise);
  bool boolean(const std::string& key, bool otherwise);
  std::string text(const std::string& key, const TextForm& form = kAnyText);
  std::string text(const std::string& key, const std::string& otherwise);
  std::vector<double> numbers(const std::string& key, Range range, std::string_view unit = {}, Count count = {},
                              bool is_whole = false);
  /// Reads a list of texts of any length.
  std::vector<std::string> texts(const std::string& key, const TextForm& form = kAnyText);

  /// Reads one of a fixed set of words.
  template <class T>
  T choice(const std::string& key, const std::vector<std::pair<std::string, T>>& words) {
    const YAML::Node found = require(key);
    std::string allowed;
    for (const auto& [word, value] : words) {
      if (found.IsScalar() && found.Scalar() == word) return value;
      allowed += (allowed.empty() ? "" : ", ") + word;
    }
    fail(found, key, "one of: " + allowed);
  }
  template <class T>
  T choice(const std::string& key, const std::vector<std::pair<std::string, T>>& words, T otherwise) {
    return has(key) ? choice(key, words) : otherwise;
  }

  /// Returns the one of `keys` that is present; they exclude each other. If none is present, returns `otherwise`; an
  /// empty `otherwise` makes that an error.
  std::string one_of(const std::vector<std::string>& keys, const std::string& otherwise = {});

  Section section(const std::string& key);
  std::vector<Section> list(const std::string& key);
  std::vector<Section> list_or_empty(const std::string& key) { return has(key) ? list(key) : std::vector<Section>(); }

  /// Checks that every key of this mapping was asked for. Otherwise throws ConfigError with the first unknown key and
  /// the keys that are known here.
  void finish() const;
  /// Throws ConfigError at `key`, for checks of several keys together. The key may lie in a mapping below this one
  /// ("lenses[1].width"). `why` is the rest of a sentence whose subject is the key.
  [[noreturn]] void refuse(const std::string& key, const std::string& why) const;
  /// Returns the path of this mapping in the file, e.g. "sensors[2].transport".
  const std::string& path() const { return path_; }

 private:
  Section(YAML::Node node, std::shared_ptr<const std::string> file, std::string path);
  YAML::Node require(const std::string& key);
  double checked(const YAML::Node& node, const std::string& key, Range range, std::string_view unit,
                 bool is_whole) const;
  [[noreturn]] void fail(const YAML::Node& at, const std::string& key, const std::string& allowed) const;
  std::string where(const YAML::Node& at) const;

  YAML::Node node_;
  std::shared_ptr<const std::string> file_;
  std::string path_;
  mutable std::set<std::string> known_;
};

}  // namespace hueline::config
