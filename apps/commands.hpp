#pragma once

#include <array>

#include "apps/command_line.hpp"

/// The commands, each in a file of its own. add_x() declares the words of command x, its help and the work it does.
namespace hueline::apps {

/// The commands that a vehicle needs, in `hueline`.
void add_capture(Command& all);
void add_replay(Command& all);
void add_check(Command& all);
void add_doctor(Command& all);
void add_rig(Command& all);
void add_colour(Command& all);
void add_inspect(Command& all);
void add_extract(Command& all);
void add_cut(Command& all);
void add_recover(Command& all);
void add_merge(Command& all);
void add_export(Command& all);
void add_decode(Command& all);
void add_import(Command& all);
void add_picture(Command& all);
/// The `verify` of a recording; that of a simulator's scenario is in `hueline-office`.
void add_verify_recording(Command& all);

/// The commands that need the simulator or an adjustment, and with them Embree, Ceres and OpenCV, in `hueline-office`.
void add_simulate(Command& all);
void add_verify(Command& all);
void add_score(Command& all);
void add_calibrate(Command& all);
void add_measure(Command& all);
void add_panorama(Command& all);
void add_fleet(Command& all);
void add_keys(Command& all);
/// The `inspect` of a simulator's scenario, which `hueline inspect` calls for such a file.
void add_inspect_scenario(Command& all);

/// The word of a command and its line of help.
struct CommandName {
  const char* word;
  const char* help;
};
inline constexpr CommandName kSimulate{
    "simulate", "simulate a drive with its truth, and play it on real sockets as the devices of the vehicle"};
inline constexpr CommandName kVerify{
    "verify", "compare coloured points with the truth of the simulator; prints the reprojection error"};
inline constexpr CommandName kScore{
    "score",
    "run a sheet of simulated scenarios and compare the results with the truth; writes score.json and score.html"};
inline constexpr CommandName kCalibrate{"calibrate",
                                        "calibrate lenses and mountings, and find the poses of static scans"};
inline constexpr CommandName kMeasure{
    "measure",
    "compute coordinates of objects that were picked in panorama or lens images, from the laser points there"};
inline constexpr CommandName kPanorama{
    "panorama", "join the lens images of exposures to panoramas, by the distances of the laser points"};
inline constexpr CommandName kFleet{
    "fleet", "fuse many drives again, on this computer or on a cluster, and catalogue the results"};
inline constexpr CommandName kKeys{"keys", "update the tables of keys in a document from the key lists of the program"};
inline constexpr CommandName kInspect{
    "inspect", "show what is in a file: a recording, cloud, capture file, receiver or bus log, rig or scenario"};
/// The commands that `hueline` passes on to `hueline-office`. It passes on kVerify too if a scenario is named.
inline constexpr std::array kOfficeCommands{kSimulate, kScore, kCalibrate, kMeasure, kPanorama, kFleet, kKeys};

}  // namespace hueline::apps
