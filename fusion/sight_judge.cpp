#include "fusion/sight_judge.hpp"

#include "fusion/sight_trees.hpp"

namespace hueline::fusion {

float log_odds_of_sight(const SightEvidence& evidence) {
  float sum = 0;
  for (const SightTree& tree : kSightTrees) {
    std::size_t answer = 0;
    for (const SightTree::Question& question : tree.questions)
      answer = 2 * answer + (evidence[static_cast<std::size_t>(question.about)] >= question.least ? 1U : 0U);
    sum += tree.values[answer];
  }
  return sum;
}

}  // namespace hueline::fusion
