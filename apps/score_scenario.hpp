#pragma once

#include <array>
#include <functional>

#include "core/result.hpp"
#include "score/figures.hpp"
#include "sim/scenario.hpp"

namespace hueline::apps {

/// One scenario through the whole program, offline: rendered (or found in the cache), its devices' bytes through the real pipeline,
/// what comes out held against the truth.
struct ScoredRun {
  score::ScenarioScore score;
  /// Of every field of every point in the order given: two runs with the same one gave the same cloud.
  std::array<std::uint64_t, 2> cloud{};
  std::uint64_t points = 0;
};

/// What is being done and how much of it is done, 0 .. 1.
using ScoreProgress = std::function<void(const std::string& stage, double share)>;

/// `threads`: of the renderer and of the colouring; the figures do not depend on it. Errors: those of sim::generate, of the timeline
/// and of score::Scorer.
Result<ScoredRun> score_scenario(const sim::Scenario& scenario, const std::string& name, const std::string& cache, std::size_t ray_returns, int threads,
                                 const ScoreProgress& progress);

}  // namespace hueline::apps
