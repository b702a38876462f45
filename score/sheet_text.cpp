#include "score/sheet_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

namespace hueline::score {
namespace {

Figure figure_of(const ScenarioScore& score, const Metric& metric) {
  const auto found = score.figures.find(metric.name);
  return found == score.figures.end() ? Figure{{}, "not made"} : found->second;
}

}  // namespace

std::string digits(const Metric& metric, const Figure& figure) {
  if (!figure.value) return "-";
  const double x = *figure.value;
  const std::string_view unit = metric.unit;
  if (unit == "bytes") return fmt::format("{:.0f}", x);
  if (unit == "1/s") return fmt::format("{:.2f} M", x * 1e-6);
  if (unit == "ms") return fmt::format("{:.0f}", x);
  const std::string_view name = metric.name;
  if (name.find("share") != name.npos || name.ends_with("accuracy")) return fmt::format("{:.4f}", x);
  if (x == 0) return "0";
  return fmt::format("{:.{}f}", x, std::clamp(2 - static_cast<int>(std::floor(std::log10(std::abs(x)))), 0, 5));
}

std::string terminal_table(const Sheet& sheet) {
  std::size_t wide = 0;
  std::vector<std::size_t> columns;
  for (const Metric& m : metrics()) wide = std::max(wide, std::string_view(m.name).size());
  std::string out = fmt::format("{:{}}", "", wide);
  for (const ScenarioScore& score : sheet) {
    columns.push_back(std::max<std::size_t>(9, score.scenario.size()));
    out += fmt::format("  {:>{}}", score.scenario, columns.back());
  }
  out += '\n';
  for (const Metric& m : metrics()) {
    if (std::none_of(sheet.begin(), sheet.end(),
                     [&](const ScenarioScore& s) { return figure_of(s, m).value.has_value(); }))
      continue;
    out += fmt::format("{:{}}", m.name, wide);
    for (std::size_t i = 0; i < sheet.size(); ++i)
      out += fmt::format("  {:>{}}", digits(m, figure_of(sheet[i], m)), columns[i]);
    out += m.is_wall_clock ? "  (this machine)\n" : "\n";
  }
  return out;
}

std::string markdown_table(const Sheet& sheet) {
  std::string out = "| metric |", rule = "|---|";
  for (const ScenarioScore& score : sheet) {
    out += fmt::format(" {} |", score.scenario);
    rule += "---|";
  }
  out += "\n" + rule + "\n";
  for (const Metric& m : metrics()) {
    out += fmt::format("| `{}` |", m.name);
    for (const ScenarioScore& score : sheet) out += fmt::format(" {} |", digits(m, figure_of(score, m)));
    out += "\n";
  }
  return out;
}

std::string terminal_changes(const std::vector<Change>& changes) {
  std::array<std::size_t, 5> counts{};
  std::string out;
  for (const Change& c : changes) {
    ++counts[static_cast<std::size_t>(c.verdict)];
    const Metric* metric = find_metric(c.metric);
    if (metric == nullptr || (c.verdict != Verdict::Better && c.verdict != Verdict::Worse)) continue;
    out += fmt::format("{:6}  {:24} {:28} {:>10} -> {:>10} {}{}\n", name(c.verdict), c.scenario, c.metric,
                       digits(*metric, c.before), digits(*metric, c.now), metric->unit,
                       c.now.value ? std::string() : fmt::format(" ({})", c.now.reason));
  }
  out += fmt::format(
      "{} figures the same within their noise, {} better, {} worse, {} of scenarios not run, {} for information\n",
      counts[0], counts[1], counts[2], counts[4], counts[3]);
  return out;
}

}  // namespace hueline::score
