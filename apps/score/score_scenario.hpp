#pragma once

#include <functional>

#include "apps/score/cloud_print.hpp"
#include "core/result.hpp"
#include "score/figures.hpp"
#include "sim/scenario.hpp"

namespace hueline::apps {

/// One scenario through the whole program, offline: rendered (or found in the cache), its devices' bytes through the
/// real pipeline, what comes out held against the truth. If a fault concerns the computer's disk or the program itself,
/// the packets are recorded on such a computer first, and what is read back from its disk is what goes through the
/// pipeline.
struct ScoredRun {
  score::ScenarioScore score;
  CloudPrint cloud;
};

/// What is being done and how much of it is done, 0 .. 1.
using ScoreProgress = std::function<void(const std::string& stage, double share)>;

/// `threads`: of the renderer and of the colouring; the figures do not depend on it. Errors: those of sim::generate, of
/// the timeline, of score::Scorer and of the recording.
Result<ScoredRun> score_scenario(const sim::Scenario& scenario, const std::string& name, const std::string& cache,
                                 std::size_t ray_returns, int threads, const ScoreProgress& progress);

}  // namespace hueline::apps
