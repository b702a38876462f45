#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

/// Each command of `hueline` in a file of its own: add_x() declares its words and help; what it runs comes back through `chosen`
/// and gives the exit status (apps/exit_code.hpp).
namespace hueline::apps {

using Chosen = std::function<int()>;

void add_capture(CLI::App& app, Chosen& chosen);
void add_replay(CLI::App& app, Chosen& chosen);
void add_score(CLI::App& app, Chosen& chosen);
void add_simulate(CLI::App& app, Chosen& chosen);
void add_verify(CLI::App& app, Chosen& chosen);
void add_colour(CLI::App& app, Chosen& chosen);
void add_inspect(CLI::App& app, Chosen& chosen);
void add_picture(CLI::App& app, Chosen& chosen);

}  // namespace hueline::apps
