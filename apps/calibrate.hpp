#pragma once

#include <filesystem>
#include <string>

#include "apps/command_line.hpp"
#include "core/result.hpp"

/// Parts of `hueline calibrate`, each tool in a file of its own.
namespace hueline::apps {

void add_calibrate_lens(Command& calibrate);
void add_calibrate_mount(Command& calibrate);
void add_calibrate_boresight(Command& calibrate);
void add_calibrate_targets(Command& calibrate);
void add_calibrate_example(Command& calibrate);

/// Today, as the computer knows it: YYYY-MM-DD. Results are dated by the one who makes them; the estimations read no clock.
std::string today();

/// The whole file at once; nothing is left half written without being said.
Status write_text(const std::filesystem::path& path, const std::string& text);

}  // namespace hueline::apps
