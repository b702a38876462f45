#pragma once

#include <functional>
#include <string>

#include "apps/score/cloud_print.hpp"
#include "core/result.hpp"
#include "score/figures.hpp"
#include "sim/scenario.hpp"

namespace hueline::apps {

/// The result of one scenario in the whole program, without real time. The drive is rendered or taken from the cache,
/// the bytes of its devices go through the real pipeline, and the products are compared with the truth. If a fault
/// concerns the disk of the computer or the program itself, a simulated capture records the packets first, and the
/// pipeline gets what is read back from that disk.
struct ScoredRun {
  score::ScenarioScore score;
  CloudPrint cloud;
};

/// Called with the running stage and the share of it that is done, 0 to 1.
using ScoreProgress = std::function<void(const std::string& stage, double share)>;

/// Runs one scenario. `threads` is the number of threads of the renderer and of the colouring; the figures do not
/// depend on it. `sights_file`: where to write the judged lines of sight beside what the lenses truly saw
/// (score::Scorer::write_sights()); empty: nowhere.
/// Errors: those of sim::generate, of the timeline, of score::Scorer and of the recording.
Result<ScoredRun> score_scenario(const sim::Scenario& scenario, const std::string& name, const std::string& cache,
                                 std::size_t ray_returns, int threads, const ScoreProgress& progress,
                                 const std::string& sights_file = {});

}  // namespace hueline::apps
