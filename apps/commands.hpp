#pragma once

#include "apps/command_line.hpp"

/// Each command of `hueline` in a file of its own: add_x() declares its words, its help and what it runs.
namespace hueline::apps {

void add_calibrate(Command& all);
void add_capture(Command& all);
void add_replay(Command& all);
void add_rig(Command& all);
void add_score(Command& all);
void add_simulate(Command& all);
void add_verify(Command& all);
void add_colour(Command& all);
void add_inspect(Command& all);
void add_measure(Command& all);
void add_picture(Command& all);

}  // namespace hueline::apps
