#pragma once

#include <cstdint>
#include <string>

#include "core/result.hpp"
#include "sim/rig_truth.hpp"
#include "sim/scenario.hpp"

/// What a surveyor has before a drive, made from the simulator's true rig: the inputs of `hueline calibrate lens` and
/// `calibrate mount`.
namespace hueline::apps::test {

/// `views` photographs NN.png of a chessboard of 14 x 10 inner corners, 4 cm squares, by one lens: tilted by 30 to 50
/// degrees, filling about half of the image, grey noise of two levels. Errors: Io, Invalid (the boards do not fit).
Status write_board_images(const sim::RigTruth& rig, std::size_t lens, int views, std::uint64_t seed,
                          const std::string& folder);

/// CSV for calibrate mount: `count` points a lens, 2 to 60 m away, 1 px and 5 mm of noise on each coordinate.
std::string mount_points(const sim::RigTruth& rig, int count, std::uint64_t seed);

/// A rig before its calibration: lenses as their maker draws them, places as a tape measures them. The scanner's own
/// mounting is off by what a boresight calibration leaves (0.03 degrees, 7 mm in all).
std::string nominal_rig(const sim::Scenario& scenario, std::uint32_t panorama_width);

}  // namespace hueline::apps::test
