#pragma once

#include <map>
#include <string>
#include <vector>

#include "apps/command_line.hpp"
#include "core/keys.hpp"

namespace hueline::apps {

/// The keys of a configuration as options of a command: the key `around_s` is the option `--around-s`. Keys may be
/// numbers, texts and words of a set. It must live until the command has run.
class KeyOptions {
 public:
  /// Declares an option for each key that `command` does not have yet. `before`: begins their help, such as "images: ".
  void declare(Command& command, const KeyGroup& group, const std::string& before = {});
  /// Puts what the user gave into the members. For the command's work. Throws ConfigError with the option, what was
  /// given and what is allowed.
  void read(const KeyGroup& group) const;

 private:
  std::map<std::string, std::string> given_;  // by option; what it holds before is the key's default
};

/// Returns the options with which a command gets the values of `group` instead of those of `defaults`, which has the
/// same keys: "--size", "8192x4096", ...
std::vector<std::string> option_words(const KeyGroup& group, const KeyGroup& defaults);

}  // namespace hueline::apps
