#include "score/comparison.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "score/metric_table.hpp"

namespace hueline::score {
namespace {

Verdict judge(const Metric* metric, const Figure& before, const Figure& now) {
  if (metric == nullptr || metric->better == Better::Informative) return Verdict::Informative;
  if (!before.value && !now.value) return Verdict::Same;
  if (!before.value) return Verdict::Informative;
  if (!now.value) return Verdict::Worse;
  const double a = *before.value, b = *now.value;
  if (metric->better == Better::Target) {
    const double gain = std::abs(a - metric->target) - std::abs(b - metric->target);
    return std::abs(gain) <= metric->noise ? Verdict::Same : (gain > 0 ? Verdict::Better : Verdict::Worse);
  }
  if (!(std::abs(b - a) > noise_of(*metric, a))) return Verdict::Same;
  return (b < a) == (metric->better == Better::Lower) ? Verdict::Better : Verdict::Worse;
}

}  // namespace

const char* name(Verdict verdict) {
  switch (verdict) {
    case Verdict::Same:
      return "same";
    case Verdict::Better:
      return "better";
    case Verdict::Worse:
      return "WORSE";
    case Verdict::Informative:
      return "for information";
    case Verdict::NotRun:
      return "not run";
  }
  return "?";
}

std::vector<Change> compare(const Sheet& before, const Sheet& now) {
  std::vector<Change> out;
  const auto in = [](const Sheet& sheet, const std::string& scenario) {
    const auto found =
        std::find_if(sheet.begin(), sheet.end(), [&](const ScenarioScore& s) { return s.scenario == scenario; });
    return found == sheet.end() ? nullptr : &*found;
  };
  for (const ScenarioScore& old_score : before) {
    const ScenarioScore* score = in(now, old_score.scenario);
    for (const auto& [metric, figure] : old_score.figures) {
      Change change;
      change.scenario = old_score.scenario;
      change.metric = metric;
      change.before = figure;
      change.now.reason = "not run";
      change.verdict = Verdict::NotRun;
      if (score != nullptr) {
        const auto found = score->figures.find(metric);
        change.now = found != score->figures.end() ? found->second : Figure{{}, "no such metric any more"};
        change.verdict = judge(find_metric(metric), figure, change.now);
      }
      out.push_back(std::move(change));
    }
  }
  for (const ScenarioScore& score : now) {
    const ScenarioScore* old_score = in(before, score.scenario);
    for (const auto& [metric, figure] : score.figures) {
      if (old_score != nullptr && old_score->figures.contains(metric)) continue;
      Change change;
      change.scenario = score.scenario;
      change.metric = metric;
      change.before.reason = "new";
      change.now = figure;
      change.verdict = Verdict::Informative;
      out.push_back(std::move(change));
    }
  }
  return out;
}

}  // namespace hueline::score
