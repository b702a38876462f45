#pragma once

#include <functional>
#include <stop_token>
#include <string>

#include "core/result.hpp"
#include "sim/drive.hpp"
#include "sim/scenario.hpp"

namespace hueline::sim {

/// Reports which stage of the rendering is under way and which share of it is done, 0 .. 1. `generate()` calls it from
/// the thread that called `generate()`, at most about ten times a second.
using Progress = std::function<void(const std::string& stage, double share)>;

/// How to render.
struct GenerateOptions {
  unsigned threads = 0;  ///< number of threads; 0: as many as the machine has. The result does not depend on it
  std::stop_token stop;
};

/// Renders a drive into cache_dir/<fingerprint>/, or reads it from there if an earlier call rendered it. The folder
/// holds drive.bin, truth.bin (sim/truth_file.hpp), scenario.txt and images/NNNNNN.raw (Bayer bytes or JPEG planes;
/// `image_file` is the path relative to the folder). The folder is made under another name and renamed when it is
/// complete, so a folder of the final name never holds half a drive. Errors: Invalid (scenario), Io, Stopped.
Result<Drive> generate(const Scenario& scenario, const std::string& cache_dir, const Progress& progress = {},
                       const GenerateOptions& options = {});

}  // namespace hueline::sim
