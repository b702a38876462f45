#pragma once

#include <string>
#include <vector>

#include "score/figures.hpp"

namespace hueline::score {

/// What a change of a figure means. Informative: neither better nor worse. NotRun: the newer sheet lacks the scenario.
enum class Verdict { Same, Better, Worse, Informative, NotRun };
const char* name(Verdict verdict);

/// One figure of two sheets.
struct Change {
  std::string scenario, metric;
  Figure before, now;
  Verdict verdict = Verdict::Same;
};

/// Compares two sheets and returns a change for every metric of every scenario of `before` and for what only `now` has.
/// Worse: the figure moved in the wrong direction by more than the metric's noise, or it has no value any more. NotRun:
/// the scenario is not in `now`, so a smaller sheet may be compared with a larger one. Metrics and scenarios that only
/// `now` has are Informative.
std::vector<Change> compare(const Sheet& before, const Sheet& now);

}  // namespace hueline::score
