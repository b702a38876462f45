#pragma once

#include <cstdint>
#include <string>

#include "core/result.hpp"
#include "sim/rig_truth.hpp"
#include "sim/scenario.hpp"

/// The data that a surveyor has before a drive, made from the simulator's true rig: the inputs of `hueline calibrate
/// lens` and `calibrate mount`.
namespace hueline::apps::test {

/// Writes `views` photographs NN.png of a chessboard of 14 x 10 inner corners and 4 cm squares, seen by one lens. The
/// board is tilted by 30 to 50 degrees and fills about half of the image; the grey noise is two levels.
/// Errors: Io, Invalid (the boards do not fit).
Status write_board_images(const sim::RigTruth& rig, std::size_t lens, int views, std::uint64_t seed,
                          const std::string& folder);

/// Returns the CSV for calibrate mount: `count` points for each lens, 2 to 60 m away, with 1 px and 5 mm of noise on
/// each coordinate.
std::string mount_points(const sim::RigTruth& rig, int count, std::uint64_t seed);

/// Returns a rig before its calibration: lenses from their maker's drawing, places from a tape. The scanner's mounting
/// is wrong by what a boresight calibration leaves (0.03 degrees, 7 mm in all).
std::string nominal_rig(const sim::Scenario& scenario, std::uint32_t panorama_width);

}  // namespace hueline::apps::test
