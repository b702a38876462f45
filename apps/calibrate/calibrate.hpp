#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <string>

#include "apps/command_line.hpp"

/// The tools of `hueline calibrate`. Each tool is in a file of its own.
namespace hueline::apps {

/// Each function adds the command of one tool to `calibrate`.
void add_calibrate_lens(Command& calibrate);
void add_calibrate_mask(Command& calibrate);
void add_calibrate_mount(Command& calibrate);
void add_calibrate_boresight(Command& calibrate);
void add_calibrate_targets(Command& calibrate);
void add_calibrate_example(Command& calibrate);

/// Returns today's date by the computer's clock, YYYY-MM-DD. The commands date their results; the estimations
/// themselves read no clock.
std::string today();

/// Returns a rotation by `off_deg` about axis `number` of `count`, which are spread evenly over the sphere (Fibonacci
/// lattice), to try an estimation from wrong starts. A single axis is not one of the frame's axes.
Eigen::Quaterniond off_start(double off_deg, int number, int count);

}  // namespace hueline::apps
