#include "score/sheet_file.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/input_file.hpp"
#include "score/metric_table.hpp"

namespace hueline::score {
namespace {

/// Writes seven digits. A figure has no more, and its text does then not depend on the last bit, which differs between
/// compilers.
double rounded(double x) { return std::stod(fmt::format("{:.7g}", x)); }

}  // namespace

std::string score_json(const Sheet& sheet) {
  nlohmann::ordered_json out = nlohmann::ordered_json::object();
  for (const ScenarioScore& score : sheet) {
    auto& one = out[score.scenario] = nlohmann::ordered_json::object();
    for (const Metric& metric : metrics()) {
      const auto found = score.figures.find(metric.name);
      if (found == score.figures.end()) continue;
      if (found->second.value)
        one[metric.name] = rounded(*found->second.value);
      else
        one[metric.name] = nullptr;
    }
  }
  return out.dump(2) + "\n";
}

std::string notes_json(const Sheet& sheet, const RunNotes& notes) {
  nlohmann::ordered_json out;
  out["command"] = notes.command;
  out["revision"] = notes.revision;
  out["machine"] = notes.machine;
  out["wall_s"] = rounded(notes.wall_s);
  out["is_deterministic"] = notes.is_deterministic;
  out["determinism"] = notes.determinism;
  auto& measured = out["measured_on_this_machine"] = nlohmann::ordered_json::array();
  for (const Metric& metric : metrics())
    if (metric.is_wall_clock) measured.push_back(metric.name);
  for (const ScenarioScore& score : sheet) {
    auto& one = out["scenarios"][score.scenario];
    one["notes"] = score.notes;
    one["null_because"] = nlohmann::ordered_json::object();
    for (const auto& [metric, figure] : score.figures)
      if (!figure.value) one["null_because"][metric] = figure.reason;
  }
  for (const Metric& metric : metrics())
    out["metrics"][metric.name] = {{"unit", metric.unit},
                                   {"meaning", metric.meaning},
                                   {"better", name(metric.better)},
                                   {"noise", metric.noise},
                                   {"relative_noise", metric.relative_noise}};
  return out.dump(2) + "\n";
}

Result<Sheet> read_score_json(const std::filesystem::path& path) {
  const auto text = read_input(path, 100'000'000, "a score");
  if (!text.ok()) return text.error();
  const auto json = nlohmann::ordered_json::parse(*text, nullptr, false);
  const auto malformed = [&](const std::string& what) {
    return Error{ErrorCode::Malformed, path.string() + ": " + what};
  };
  if (!json.is_object()) return malformed("not {scenario: {metric: value}}");
  Sheet sheet;
  for (const auto& [scenario, figures] : json.items()) {
    if (!figures.is_object()) return malformed("'" + scenario + "' is not {metric: value}");
    ScenarioScore score;
    score.scenario = scenario;
    for (const auto& [metric, value] : figures.items()) {
      if (!value.is_number() && !value.is_null())
        return malformed("'" + scenario + "." + metric + "' is neither a number nor null");
      score.figures[metric] =
          value.is_null() ? Figure{{}, "none in " + path.filename().string()} : Figure{value.get<double>(), {}};
    }
    sheet.push_back(std::move(score));
  }
  return sheet;
}

}  // namespace hueline::score
