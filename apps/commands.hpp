#pragma once

#include <array>

#include "apps/command_line.hpp"

/// The commands, each in a file of its own. add_x() declares the words of command x, its help and the work it does.
namespace hueline::apps {

/// The commands that a vehicle needs, in `hueline`.
void add_capture(Command& all);
void add_replay(Command& all);
void add_rig(Command& all);
void add_colour(Command& all);
void add_inspect(Command& all);
void add_picture(Command& all);

/// The commands that need the simulator or an adjustment, and with them Embree, Ceres and OpenCV, in `hueline-office`.
void add_simulate(Command& all);
void add_verify(Command& all);
void add_score(Command& all);
void add_calibrate(Command& all);
void add_measure(Command& all);
void add_keys(Command& all);
/// The `inspect` of a simulator's scenario, which `hueline inspect` calls for such a file.
void add_inspect_scenario(Command& all);

/// The word of a command and its line of help.
struct CommandName {
  const char* word;
  const char* help;
};
inline constexpr CommandName kSimulate{
    "simulate", "render a drive with its truth, and play it on real sockets as the vehicle's devices"};
inline constexpr CommandName kVerify{"verify",
                                     "hold coloured points against the simulator's truth: the reprojection error"};
inline constexpr CommandName kScore{
    "score", "drive a sheet of simulated scenarios and hold everything against the truth: score.json, score.html"};
inline constexpr CommandName kCalibrate{"calibrate",
                                        "find what others take for given: lenses, mountings, where static scans stood"};
inline constexpr CommandName kMeasure{
    "measure", "coordinates of objects that were picked in panorama or lens images, by the laser points there"};
inline constexpr CommandName kKeys{
    "keys", "write the tables of keys in a document anew, out of the lists that files are read by"};
inline constexpr CommandName kInspect{
    "inspect", "say what is in a file: recordings, clouds, captures, receiver and bus logs, rigs"};
/// The commands that `hueline` passes on to `hueline-office`.
inline constexpr std::array kOfficeCommands{kSimulate, kVerify, kScore, kCalibrate, kMeasure, kKeys};

}  // namespace hueline::apps
