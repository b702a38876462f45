#pragma once

#include <functional>

#include "apps/command_line.hpp"

namespace hueline::apps {

/// The main() of `hueline` and of `hueline-office`: holds the standard streams, reads the words, runs the chosen
/// command, and gives its exit status. Whatever a command throws ends as a sentence on standard error.
int run_program(int argc, char** argv, const std::function<void(Command&)>& add_commands);

}  // namespace hueline::apps
