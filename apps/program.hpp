#pragma once

#include <functional>

#include "apps/command_line.hpp"

namespace hueline::apps {

/// The main() of `hueline` and of `hueline-office`. It keeps the standard streams open, reads the words, runs the
/// chosen command and returns its exit status. An exception of a command becomes a sentence on standard error.
int run_program(int argc, char** argv, const std::function<void(Command&)>& add_commands);

}  // namespace hueline::apps
