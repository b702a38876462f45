#include "score/page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/printable.hpp"
#include "score/metric_table.hpp"
#include "score/plot.hpp"
#include "score/sheet_text.hpp"

namespace hueline::score {
namespace {

constexpr const char* kStyle = R"(
:root{--ink:#1d2733;--soft:#5b6875;--line:#d9dfe5;--paper:#fff;--field:#f4f6f8;--bar:#cfe3f1;--good:#00714f;--bad:#b3261e}
@media(prefers-color-scheme:dark){:root{--ink:#e4e9ee;--soft:#9aa7b4;--line:#3a444e;--paper:#161b20;--field:#1f262d;--bar:#1f4258;--good:#4cc79b;--bad:#ff8a80}}
*{box-sizing:border-box}body{margin:0 auto;max-width:1640px;padding:24px 20px 60px;background:var(--paper);color:var(--ink);font:14px/1.45 system-ui,sans-serif}
h1{font-size:24px;margin:0}h2{font-size:19px;margin:38px 0 8px;border-top:1px solid var(--line);padding-top:18px}p{margin:4px 0}
.soft{color:var(--soft)}.good{color:var(--good)}.bad{color:var(--bad);font-weight:600}
.facts{display:flex;flex-wrap:wrap;gap:8px 26px;margin:6px 0 12px}.facts b{display:block;font-size:19px;font-variant-numeric:tabular-nums}
.facts span{color:var(--soft);font-size:12px}
.pictures{display:grid;grid-template-columns:repeat(auto-fit,minmax(380px,1fr));gap:10px}figure{margin:0}img{width:100%;display:block;border-radius:4px}
figcaption{color:var(--soft);font-size:12px;margin-top:3px}.charts{display:grid;grid-template-columns:repeat(auto-fill,minmax(300px,1fr));gap:12px;margin-top:14px}
svg{background:var(--field);border-radius:4px;width:100%}svg text{font:10.5px system-ui,sans-serif;fill:var(--soft)}svg .title{font-size:12px;font-weight:600;fill:var(--ink)}
svg .grid{stroke:var(--line)}.scroll{overflow-x:auto}table{border-collapse:collapse;font-variant-numeric:tabular-nums;width:100%}
th,td{padding:3px 8px;border-bottom:1px solid var(--line);text-align:right;white-space:nowrap}th:first-child,td:first-child{text-align:left}th{font-weight:600}
td.none{color:var(--soft)}.overview{margin-top:16px}.overview th{white-space:normal;font-weight:400;color:var(--soft);vertical-align:bottom;max-width:110px}a{color:inherit}details{margin-top:10px}summary{cursor:pointer;color:var(--soft)})";

struct Fact {
  const char* metric;
  const char* words;
  double factor;
  const char* unit;
};
// The figures that are of most interest for a coloured cloud.
constexpr std::array kFacts{Fact{"visible_coloured_share", "of what was seen is coloured", 100, "%"},
                            Fact{"wrong_surface_share", "coloured from a wrong surface", 100, "%"},
                            Fact{"colour_de00_median", "median colour error, dE00", 1, ""},
                            Fact{"colour_de00_over20_share", "another colour altogether", 100, "%"},
                            Fact{"reprojection_rms_px", "px reprojection error, rms", 1, ""},
                            Fact{"exposure_time_rms_us", "us exposure time error, rms", 1, ""},
                            Fact{"exposure_seam_de00", "dE00 step at exposure seams", 1, ""},
                            Fact{"latency_p99_ms", "s latency, 99 %", 1e-3, ""},
                            Fact{"unexplained_bytes", "bytes unexplained", 1, ""}};

std::string shown(const ScenarioScore& score, const Fact& fact) {
  const auto found = score.figures.find(fact.metric);
  if (found == score.figures.end() || !found->second.value) return "-";
  return fmt::format("{:.3g}{}{}", *found->second.value * fact.factor, *fact.unit ? " " : "", fact.unit);
}

std::string facts(const ScenarioScore& score) {
  std::string out = "<div class=\"facts\">";
  for (const Fact& fact : kFacts)
    out += fmt::format("<div><b>{}</b><span>{}</span></div>", shown(score, fact), fact.words);
  return out + "</div>";
}

/// Returns a table with a row for each scenario, in which an unusual scenario is easy to see.
std::string overview(const Sheet& sheet) {
  std::string out = "<div class=\"scroll\"><table class=\"overview\"><tr><th></th>";
  for (const Fact& fact : kFacts) out += fmt::format("<th>{}</th>", fact.words);
  out += "</tr>";
  for (const ScenarioScore& score : sheet) {
    out += fmt::format("<tr><td><a href=\"#{0}\">{0}</a></td>", as_markup(score.scenario));
    for (const Fact& fact : kFacts) {
      double largest = 0;
      const auto value = [&](const ScenarioScore& one) {
        const auto found = one.figures.find(fact.metric);
        return found == one.figures.end() ? 0.0 : std::abs(found->second.value.value_or(0));
      };
      for (const ScenarioScore& one : sheet) largest = std::max(largest, value(one));
      out += fmt::format(
          "<td style=\"background:linear-gradient(to right,var(--bar) {0:.0f}%,transparent {0:.0f}%)\">{1}</td>",
          largest > 0 ? 100 * value(score) / largest : 0.0, shown(score, fact));
    }
    out += "</tr>";
  }
  return out + "</table></div>";
}

std::string scenario_part(const ScenarioScore& score, const std::vector<std::string>& pictures) {
  std::string out =
      fmt::format("<h2 id=\"{0}\">{0}</h2>", as_markup(score.scenario)) + facts(score) + "<div class=\"pictures\">";
  for (std::size_t i = 0; i < score.pictures.size() && i < pictures.size(); ++i)
    out += fmt::format("<figure><img alt=\"\" src=\"{}\"><figcaption>{}</figcaption></figure>", pictures[i],
                       as_markup(score.pictures[i].caption));
  out += "</div><div class=\"charts\">";
  for (const Chart& chart : score.charts) out += svg(chart);
  out += "</div><details><summary>what was counted</summary>";
  for (const std::string& note : score.notes) out += "<p class=\"soft\">" + as_markup(note) + "</p>";
  for (const auto& [metric, figure] : score.figures)
    if (!figure.value)
      out += fmt::format("<p class=\"soft\">{}: none, because {}</p>", metric, as_markup(figure.reason));
  return out + "</details>";
}

std::string table(const Sheet& sheet) {
  std::string out = "<div class=\"scroll\"><table><tr><th>metric</th>";
  for (const ScenarioScore& score : sheet) out += "<th>" + as_markup(score.scenario) + "</th>";
  out += "</tr>";
  for (const Metric& metric : metrics()) {
    double largest = 0;
    const auto value = [&](const ScenarioScore& score) {
      const auto found = score.figures.find(metric.name);
      return found == score.figures.end() ? Figure{{}, "not made"} : found->second;
    };
    for (const ScenarioScore& score : sheet) largest = std::max(largest, std::abs(value(score).value.value_or(0)));
    out += fmt::format("<tr><td title=\"{}\">{} <span class=\"soft\">{}{}</span></td>", as_markup(metric.meaning),
                       metric.name, metric.unit, metric.is_wall_clock ? ", this machine" : "");
    for (const ScenarioScore& score : sheet) {
      const Figure figure = value(score);
      if (!figure.value) {
        out += fmt::format("<td class=\"none\" title=\"{}\">-</td>", as_markup(figure.reason));
        continue;
      }
      const double share = largest > 0 ? 100 * std::abs(*figure.value) / largest : 0;
      out += fmt::format(
          "<td style=\"background:linear-gradient(to right,var(--bar) {0:.0f}%,transparent {0:.0f}%)\">{1}</td>", share,
          digits(metric, figure));
    }
    out += "</tr>";
  }
  return out + "</table></div>";
}

std::string changes_part(const std::vector<Change>& changes) {
  std::string rows;
  std::size_t same = 0;
  for (const Change& c : changes) {
    const Metric* metric = find_metric(c.metric);
    if (c.verdict == Verdict::Same) ++same;
    if (metric == nullptr || (c.verdict != Verdict::Better && c.verdict != Verdict::Worse)) continue;
    rows += fmt::format("<tr><td class=\"{}\">{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
                        c.verdict == Verdict::Worse ? "bad" : "good", name(c.verdict), as_markup(c.scenario), c.metric,
                        digits(*metric, c.before), digits(*metric, c.now));
  }
  std::string out =
      fmt::format("<h2>Against the older sheet</h2><p>{} figures are the same within their noise.</p>", same);
  if (!rows.empty())
    out +=
        "<div class=\"scroll\"><table><tr><th></th><th>scenario</th><th>metric</th><th>before</th><th>now</th></tr>" +
        rows + "</table></div>";
  return out;
}

}  // namespace

std::string page(const Sheet& sheet, const std::vector<std::vector<std::string>>& pictures, const RunNotes& notes,
                 const std::vector<Change>& changes) {
  std::string out =
      "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width\"><title>hueline score</title><style>";
  out += kStyle;
  out += "</style><h1>hueline score</h1>";
  out += fmt::format("<p class=\"soft\">{} · {} · {} · {:.0f} s</p>", as_markup(notes.command),
                     as_markup(notes.revision), as_markup(notes.machine), notes.wall_s);
  out += fmt::format("<p class=\"{}\">{}</p>", notes.is_deterministic ? "good" : "bad", as_markup(notes.determinism));
  if (!changes.empty()) out += changes_part(changes);
  out += overview(sheet);
  for (std::size_t i = 0; i < sheet.size(); ++i)
    out += scenario_part(sheet[i], i < pictures.size() ? pictures[i] : std::vector<std::string>{});
  out +=
      "<h2>All figures</h2><p class=\"soft\">Bars: share of the row's largest. What each metric counts stands in its "
      "tooltip and in docs/score.md.</p>" +
      table(sheet);
  return out + "</html>\n";
}

}  // namespace hueline::score
