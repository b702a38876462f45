#pragma once

#include <functional>
#include <stop_token>
#include <string>

#include "core/result.hpp"
#include "sim/drive.hpp"
#include "sim/scenario.hpp"

namespace hueline::sim {

/// What is being made and how much of it is done, 0 .. 1. Called from the calling thread, about ten times a second at
/// most.
using Progress = std::function<void(const std::string& stage, double share)>;

struct GenerateOptions {
  unsigned threads = 0;  ///< 0: as many as the machine has; the result does not depend on it
  std::stop_token stop;
};

/// Renders a drive into cache_dir/<fingerprint>/, or finds it there from an earlier call. The folder holds drive.bin,
/// truth.bin (sim/truth_file.hpp), scenario.txt and images/NNNNNN.raw (Bayer bytes or JPEG planes, image_file is the
/// path relative to the folder). It is made under another name and renamed when whole, so a folder of that name is
/// never half a drive. Errors: Invalid (scenario), Io, Stopped.
Result<Drive> generate(const Scenario& scenario, const std::string& cache_dir, const Progress& progress = {},
                       const GenerateOptions& options = {});

}  // namespace hueline::sim
