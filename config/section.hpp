#pragma once

#include <yaml-cpp/yaml.h>

#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "core/keys.hpp"

namespace hueline::config {

/// A configuration that cannot be taken: file, line, key, what was found, what is allowed. Start-up only; caught once
/// in main.
class ConfigError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The text of a configuration: at most 1 MB. ConfigError says why it cannot be read.
std::string read_configuration(const std::string& path);

/// One mapping of a YAML file, read strictly: a key that is missing, of the wrong type or out of range is an error
/// where it stands; so is, on finish(), every key that nobody asked for. Duplicate keys are errors too. Thread-bound.
class Section {
 public:
  /// Reads a whole file or text. `name` stands for the file in messages.
  static Section load_file(const std::string& path);
  static Section load_text(const std::string& text, const std::string& name);

  bool has(const std::string& key) const;
  double number(const std::string& key, Range range, std::string_view unit = {});
  double number(const std::string& key, Range range, double otherwise);
  std::int64_t integer(const std::string& key, Range range, std::string_view unit = {});
  std::int64_t integer(const std::string& key, Range range, std::int64_t otherwise);
  bool boolean(const std::string& key, bool otherwise);
  std::string text(const std::string& key, const TextForm& form = kAnyText);
  std::string text(const std::string& key, const std::string& otherwise);
  std::vector<double> numbers(const std::string& key, Range range, std::string_view unit = {}, Count count = {},
                              bool is_whole = false);
  /// Any number of texts.
  std::vector<std::string> texts(const std::string& key, const TextForm& form = kAnyText);

  /// One of a fixed set of words.
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

  /// The one of `keys` that is there: they exclude each other. None of them is `otherwise`, or an error if that is
  /// empty.
  std::string one_of(const std::vector<std::string>& keys, const std::string& otherwise = {});

  Section section(const std::string& key);
  std::vector<Section> list(const std::string& key);
  std::vector<Section> list_or_empty(const std::string& key) { return has(key) ? list(key) : std::vector<Section>(); }

  /// Every key of this mapping has been asked for; otherwise ConfigError naming the first unknown one and those known
  /// here.
  void finish() const;
  /// For checks over several keys: an error at `key`, which may lie in a mapping of this one ("lenses[1].width"). `why`
  /// is the rest of a sentence whose subject is the key.
  [[noreturn]] void refuse(const std::string& key, const std::string& why) const;
  /// Path of this mapping inside the file, "sensors[2].transport".
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
