#pragma once

#include <cstdint>
#include <string>

#include "apps/command_line.hpp"

/// Parts of `hueline calibrate`, each tool in a file of its own.
namespace hueline::apps {

void add_calibrate_lens(Command& calibrate);
void add_calibrate_mount(Command& calibrate);
void add_calibrate_boresight(Command& calibrate);
void add_calibrate_targets(Command& calibrate);
void add_calibrate_example(Command& calibrate);

/// Today, as the computer knows it: YYYY-MM-DD. Results are dated by the one who makes them; the estimations read no
/// clock.
std::string today();

}  // namespace hueline::apps
