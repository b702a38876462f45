#pragma once

#include <stdexcept>
#include <string>
#include <utility>

#include "core/csv_table.hpp"
#include "core/input_file.hpp"

namespace hueline::apps {

/// An input that a command needs and that is not there, or cannot be read. It is thrown before the work begins, and
/// caught once, in run_program(): exit status 3. Of a rig, a scenario or a score sheet config::ConfigError tells the
/// same, with exit status 2.
class InputError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Returns the text of a table that people wrote. Throws InputError if it cannot be read.
inline std::string read_table(const std::string& path) {
  auto text = read_input(path, kMostTable, "a table");
  if (!text.ok()) throw InputError(text.error().message);
  return *std::move(text);
}

}  // namespace hueline::apps
