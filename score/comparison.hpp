#pragma once

#include <string>
#include <vector>

#include "score/figures.hpp"

namespace hueline::score {

enum class Verdict { Same, Better, Worse, Informative, NotRun };
const char* name(Verdict verdict);

struct Change {
  std::string scenario, metric;
  Figure before, now;
  Verdict verdict = Verdict::Same;
};

/// Every metric of every scenario of `before`, and what is new. Worse: beyond the metric's noise in the wrong
/// direction, or a value that is none any more. NotRun: the scenario is not in `now`; a smaller sheet may be held
/// against a larger one. Metrics and scenarios that only `now` has are Informative.
std::vector<Change> compare(const Sheet& before, const Sheet& now);

}  // namespace hueline::score
