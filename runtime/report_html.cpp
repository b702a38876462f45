#include <fmt/format.h>

#include <array>
#include <string>
#include <string_view>

#include "core/printable.hpp"
#include "runtime/report_content.hpp"

namespace hueline::runtime {
namespace {

using Map = ReportContent::Map;

constexpr std::array<const char*, 4> kLines{"driven", "coloured", "colourless", "empty"};
constexpr std::array<const char*, 3> kClasses{"good", "remarks", "again"};

std::string map_svg(const Map& map) {
  std::string out = fmt::format("<svg viewBox=\"0 0 {:.0f} {:.0f}\" role=\"img\" aria-label=\"map of the drive\">\n",
                                Map::kWidth, Map::kHeight);
  for (const Map::Path& path : map.paths) {
    out += fmt::format("<polyline class=\"{}\" points=\"", kLines[static_cast<std::size_t>(path.line)]);
    for (const auto& at : path.places) out += fmt::format("{:.1f},{:.1f} ", at.x, at.y);
    out += "\"/>\n";
  }
  for (const auto& at : map.weak)
    out += fmt::format("<circle class=\"weak\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"5\"/>\n", at.x, at.y);
  for (const auto& [at, number] : map.remarks)
    out += fmt::format(
        "<g class=\"place\"><circle cx=\"{0:.1f}\" cy=\"{1:.1f}\" r=\"8\"/><text x=\"{0:.1f}\" "
        "y=\"{2:.1f}\">{3}</text></g>\n",
        at.x, at.y, at.y + 4, number);
  for (const auto& [at, number] : map.marks)
    out += fmt::format(
        "<g class=\"mark\"><path d=\"M{0:.1f} {1:.1f}v-16\"/><rect x=\"{2:.1f}\" y=\"{3:.1f}\" width=\"26\" "
        "height=\"14\"/><text x=\"{4:.1f}\" y=\"{5:.1f}\">M{6}</text></g>\n",
        at.x, at.y, at.x - 13, at.y - 30, at.x, at.y - 19, number);
  const ScaleBar bar = scale_bar(map.px_per_m, 140);
  out += fmt::format(
      "<path class=\"bar\" d=\"M{0:.0f} {1:.0f}h{2:.1f}\"/><text class=\"bar\" x=\"{0:.0f}\" "
      "y=\"{3:.0f}\">{4}</text>\n",
      Map::kBorder / 2, Map::kHeight - 8, bar.length_m * map.px_per_m, Map::kHeight - 14, bar.words);
  out += fmt::format("<text class=\"bar\" x=\"{:.0f}\" y=\"18\">N &#8593;</text>\n", Map::kWidth - 34);
  return out +
         "</svg>\n<p class=\"key\"><i class=\"coloured\"></i>coloured <i class=\"colourless\"></i>too few colours "
         "<i class=\"empty\"></i>no points <i class=\"driven\"></i>driven only <i class=\"weak\"></i>weak GNSS or pose "
         "&#9312; place of a remark; M1 mark of the operator</p>\n";
}

std::string marks_table(const ReportContent& content) {
  if (content.marks.empty()) return {};
  std::string out = fmt::format("<h2>{}</h2>\n<table>\n", kMarksTitle);
  for (std::size_t i = 0; i < content.marks.size() && i < content.kMarks; ++i) {
    const auto& [label, where, note] = content.marks[i];
    out += fmt::format("<tr><th>{}</th><td>{}</td><td>{}</td></tr>\n", label, where, as_markup(note));
  }
  out += "</table>\n";
  if (content.marks.size() > content.kMarks)
    out += fmt::format("<p>{} more are in summary.json.</p>\n", content.marks.size() - content.kMarks);
  return out;
}

constexpr const char* kStyle = R"(
body{font:14px/1.35 system-ui,sans-serif;color:#111;background:#fff;max-width:760px;margin:16px auto;padding:0 16px}
h1{font-size:20px;margin:0 0 4px}h2{font-size:15px;margin:12px 0 4px}
.grade{font-size:28px;font-weight:700;padding:6px 12px;margin:8px 0;border:3px solid;border-radius:6px}
.good{color:#0a5c2b}.remarks{color:#7a4b00}.again{color:#a10018}
svg{width:100%;border:1px solid #bbb;background:#fafafa}
polyline{fill:none;stroke-width:4;stroke-linejoin:round;stroke-linecap:round}
polyline.driven{stroke:#999;stroke-width:2}polyline.coloured{stroke:#12813f}
polyline.colourless{stroke:#d98200;stroke-dasharray:7 5}polyline.empty{stroke:#c0001c;stroke-dasharray:2 6}
circle.weak{fill:none;stroke:#1a4fc4;stroke-width:1.2}
g.place circle{fill:#fff;stroke:#111;stroke-width:1.5}g.place text{font:bold 11px sans-serif;text-anchor:middle}
g.mark path{stroke:#6a1b9a;stroke-width:2}g.mark rect{fill:#6a1b9a}g.mark text{font:bold 11px sans-serif;fill:#fff;text-anchor:middle}
path.bar{stroke:#111;stroke-width:3}text.bar{font:12px sans-serif}
.key i{display:inline-block;width:26px;height:0;border-top:4px solid;vertical-align:middle;margin:0 4px 0 10px}
.key{font-size:12px;margin:2px 0}
i.coloured{color:#12813f}i.colourless{color:#d98200;border-top-style:dashed}i.empty{color:#c0001c;border-top-style:dotted}
i.driven{color:#999;border-top-width:2px}i.weak{width:9px!important;height:9px!important;border:1.5px solid #1a4fc4;border-radius:50%}
table{border-collapse:collapse;width:100%;font-size:13px}th,td{text-align:left;padding:2px 8px 2px 0;border-bottom:1px solid #ddd;vertical-align:top}
ol{margin:4px 0;padding-left:24px;font-size:13px}footer{font-size:11px;color:#555;margin-top:10px}
@page{size:A4;margin:12mm}@media print{body{margin:0;padding:0;font-size:12px}.grade{font-size:22px}svg{max-height:95mm}}
)";

}  // namespace

std::string report_html(const ReportContent& content) {
  std::string out = fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width\"><title>Drive of {0}: {1}</title>\n<style>{2}</style></head>\n<body>\n"
      "<h1>Drive of the rig {0}</h1>\n<p class=\"grade {3}\">{1}</p>\n",
      as_markup(content.rig), name(content.grade), kStyle, kClasses[static_cast<std::size_t>(content.grade)]);
  out += content.map ? map_svg(*content.map) : fmt::format("<p>{}</p>\n", kNoMap);
  out += fmt::format("<h2>{}</h2>\n", kReasonsTitle);
  if (content.reasons.empty()) out += fmt::format("<p>{}</p>\n", kNoReason);
  if (!content.reasons.empty()) out += "<ol>\n";
  for (std::size_t i = 0; i < content.reasons.size() && i < content.kReasons; ++i) {
    const auto& [grade, sensor, text, when] = content.reasons[i];
    out += fmt::format("<li class=\"{}\"><b>{}{}</b>: {}{}</li>\n", kClasses[static_cast<std::size_t>(grade)],
                       grade == Grade::Again ? "drive again: " : "", as_markup(sensor), as_markup(text), when);
  }
  if (!content.reasons.empty()) out += "</ol>\n";
  if (content.reasons.size() > content.kReasons)
    out += fmt::format("<p>{} more are in summary.json.</p>\n", content.reasons.size() - content.kReasons);
  out += marks_table(content);
  out += "<h2>Figures</h2>\n<table>\n<tr><th></th><th>measured</th><th>wanted</th></tr>\n";
  for (const auto& [what, measured, wanted] : content.figures)
    out += fmt::format("<tr><th>{}</th><td>{}</td><td>{}</td></tr>\n", what, as_markup(measured), as_markup(wanted));
  return out +
         "</table>\n<footer>hueline; the thresholds are the keys <code>health</code> of the rig.</footer>\n"
         "</body></html>\n";
}

}  // namespace hueline::runtime
