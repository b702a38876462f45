#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calibration/targets/targets_report.hpp"
#include "core/printable.hpp"

namespace hueline::calibration {
namespace {

constexpr const char* kStyle = R"(
:root{--ink:#1d2733;--soft:#5b6875;--line:#d9dfe5;--paper:#fff;--field:#f4f6f8;--ring:#9fc4df;--good:#00714f;--check:#7a4fb5;--bad:#b3261e}
@media(prefers-color-scheme:dark){:root{--ink:#e4e9ee;--soft:#9aa7b4;--line:#3a444e;--paper:#161b20;--field:#1f262d;--ring:#2f5a78;--good:#4cc79b;--check:#b79ae8;--bad:#ff8a80}}
*{box-sizing:border-box}body{margin:0 auto;max-width:1400px;padding:24px 20px 60px;background:var(--paper);color:var(--ink);font:14px/1.45 system-ui,sans-serif}
h1{font-size:24px;margin:0}h2{font-size:19px;margin:34px 0 8px;border-top:1px solid var(--line);padding-top:16px}p{margin:4px 0}
.soft{color:var(--soft)}.good{color:var(--good)}.check{color:var(--check)}.bad{color:var(--bad)}
.station{display:grid;grid-template-columns:minmax(320px,520px) 1fr;gap:20px;align-items:start}@media(max-width:900px){.station{grid-template-columns:1fr}}
.facts{display:flex;flex-wrap:wrap;gap:8px 26px;margin:0 0 12px}.facts b{display:block;font-size:18px;font-variant-numeric:tabular-nums}.facts span{color:var(--soft);font-size:12px}
svg{background:var(--field);border-radius:4px;width:100%;display:block}svg text{font:11px system-ui,sans-serif;fill:var(--ink)}svg .soft{fill:var(--soft)}
.scroll{overflow-x:auto}table{border-collapse:collapse;font-variant-numeric:tabular-nums;width:100%}
th,td{padding:3px 8px;border-bottom:1px solid var(--line);text-align:right;white-space:nowrap}th:first-child,td:first-child{text-align:left}th{font-weight:600}td.words{text-align:left;white-space:normal})";

const char* colour_of(TargetState state) {
  switch (state) {
    case TargetState::Used:
      return "good";
    case TargetState::Check:
      return "check";
    default:
      return "bad";
  }
}

/// Returns the largest length of 1, 2 or 5 times a power of ten that is at most `most`.
double round_length(double most) {
  double out = std::pow(10, std::floor(std::log10(most)));
  for (const double factor : {5.0, 2.0})
    if (factor * out <= most) return factor * out;
  return out;
}

/// Draws a station from above, north up: rings, targets, other round objects, and enlarged residuals.
std::string plan(const StationResult& result, const SurveyedStation& station, std::span<const SurveyedTarget> targets) {
  constexpr double kSize = 520, kMiddle = kSize / 2;
  double reach = 1, largest = 1e-4;
  for (const TargetOutcome& outcome : result.targets) {
    reach = std::max(reach, (targets[outcome.target].position.xyz - station.position.xyz).head<2>().norm());
    if (outcome.is_found()) largest = std::max(largest, outcome.residual_survey.head<2>().norm());
  }
  const double scale = 0.42 * kSize / reach, arrow = round_length(40 / (largest * scale));
  const auto x = [&](double east) { return kMiddle + scale * east; };
  const auto y = [&](double north) { return kMiddle - scale * north; };
  std::string out = fmt::format("<svg viewBox=\"0 0 {0:.0f} {0:.0f}\" role=\"img\" aria-label=\"plan of station {1}\">",
                                kSize, as_markup(station.name));
  for (const TargetOutcome& outcome : result.targets)
    out += fmt::format("<circle cx=\"{0}\" cy=\"{0}\" r=\"{1:.1f}\" fill=\"none\" stroke=\"var(--ring)\"/>", kMiddle,
                       scale * (targets[outcome.target].position.xyz - station.position.xyz).head<2>().norm());
  for (const Eigen::Vector3d& other : result.others_scanner) {
    const Eigen::Vector3d p = result.adjusted.orientation.survey_from_scanner(other) - station.position.xyz;
    out += fmt::format(
        "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3.5\" fill=\"none\" stroke=\"var(--soft)\" stroke-dasharray=\"2 2\"/>",
        x(p.x()), y(p.y()));
  }
  out += fmt::format("<path d=\"M{0} {1}l7 12h-14z\" fill=\"var(--ink)\"/>", kMiddle, kMiddle - 7);
  for (const TargetOutcome& outcome : result.targets) {
    const SurveyedTarget& target = targets[outcome.target];
    const Eigen::Vector3d p = target.position.xyz - station.position.xyz;
    const double px = x(p.x()), py = y(p.y());
    const char* colour = colour_of(outcome.state);
    if (outcome.is_found()) {
      out += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"5\" fill=\"var(--{})\"/>", px, py, colour);
      out += fmt::format(
          "<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"var(--{})\" stroke-width=\"2\"/>", px,
          py, px + arrow * scale * outcome.residual_survey.x(), py - arrow * scale * outcome.residual_survey.y(),
          colour);
    } else {
      out += fmt::format("<path d=\"M{:.1f} {:.1f}l10 10m0 -10l-10 10\" stroke=\"var(--bad)\" stroke-width=\"2\"/>",
                         px - 5, py - 5);
    }
    const bool is_right = px > 0.75 * kSize;
    out += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\">{}</text>", px + (is_right ? -9 : 9), py - 7,
                       is_right ? "end" : "start", as_markup(target.name));
  }
  const double bar = round_length(reach / 2);
  out += fmt::format(
      "<path d=\"M16 {0}h{1:.1f}\" stroke=\"var(--ink)\" stroke-width=\"2\"/><text x=\"16\" y=\"{2}\">{3:g} m</text>",
      kSize - 16, bar * scale, kSize - 22, bar);
  out += fmt::format("<text x=\"{0}\" y=\"{1}\" text-anchor=\"end\" class=\"soft\">residuals {2:g} times larger</text>",
                     kSize - 16, kSize - 16, arrow);
  return out + fmt::format(
                   "<path d=\"M{0} 40v-22m-4 7l4 -8l4 8\" fill=\"none\" stroke=\"var(--ink)\"/><text x=\"{1}\" "
                   "y=\"52\">N</text></svg>",
                   kSize - 22, kSize - 26);
}

std::string table(const StationResult& result, const SurveyedStation& station,
                  std::span<const SurveyedTarget> targets) {
  std::string out =
      "<div class=\"scroll\"><table><tr><th>target</th><th></th><th>distance m</th><th>in "
      "ring</th><th>round</th><th>points</th><th>roundness</th><th>east mm</th><th>north mm</th><th>up mm</th>"
      "<th>expected mm</th></tr>";
  for (const TargetOutcome& outcome : result.targets) {
    const SurveyedTarget& target = targets[outcome.target];
    out += fmt::format("<tr><td>{}</td><td class=\"{}\">{}</td><td>{:.2f}</td><td>{}</td><td>{}</td>",
                       as_markup(target.name), colour_of(outcome.state), name(outcome.state),
                       (target.position.xyz - station.position.xyz).norm(), outcome.counts.points,
                       outcome.counts.candidates);
    if (outcome.is_found()) {
      const Eigen::Vector3d r = 1000 * outcome.residual_survey, s = 1000 * outcome.residual_sigma;
      out += fmt::format(
          "<td>{}</td><td>{:.1f} %</td><td>{:+.1f}</td><td>{:+.1f}</td><td>{:+.1f}</td><td>{:.1f} {:.1f} "
          "{:.1f}</td></tr>",
          outcome.points, 100 * outcome.roundness, r.x(), r.y(), r.z(), s.x(), s.y(), s.z());
    } else {
      out += fmt::format("<td class=\"words\" colspan=\"6\">{}</td></tr>", as_markup(outcome.reason));
    }
  }
  return out + "</table></div>";
}

std::string fact(const std::string& value, const char* words) {
  return fmt::format("<div><b>{}</b><span>{}</span></div>", value, words);
}

std::string station_part(const StationResult& result, const SurveyedStation& station,
                         std::span<const SurveyedTarget> targets, const std::string& scan) {
  const auto& o = result.adjusted.orientation;
  const Eigen::Vector3d& t = o.T_survey_scanner.translation;
  std::size_t used = 0;
  double plane = 0, height = 0;
  for (const TargetOutcome& outcome : result.targets) {
    if (outcome.state != TargetState::Used) continue;
    ++used;
    plane += outcome.residual_survey.head<2>().squaredNorm();
    height += outcome.residual_survey.z() * outcome.residual_survey.z();
  }
  const auto rms = [&](double sum) {
    return 1000 * std::sqrt(sum / static_cast<double>(std::max<std::size_t>(used, 1)));
  };
  const auto sigma = [&](int k, double factor) { return factor * std::sqrt(result.adjusted.covariance(k, k)); };
  std::string out = fmt::format("<h2>{}</h2><div class=\"station\"><div>{}</div><div><div class=\"facts\">",
                                as_markup(station.name), plan(result, station, targets));
  out += fact(fmt::format("{} of {}", used, result.targets.size()), "targets used");
  out += fact(fmt::format("{:.1f} / {:.1f} / {:.1f} mm", rms(plane), rms(plane + height), rms(height)),
              "residuals: plane / space / height, rms");
  out += fact(fmt::format("{:.1f} {:.1f} {:.1f} mm", sigma(3, 1000), sigma(4, 1000), sigma(5, 1000)),
              "sigma of the scanner's place: east, north, up");
  out += fact(fmt::format("{:.4f} {:.4f} {:.4f} deg", sigma(0, 57.29578), sigma(1, 57.29578), sigma(2, 57.29578)),
              "sigma of rotation about east, north, up");
  out += fact(fmt::format("{:.1f} / {}", result.chi_squared, result.freedom), "chi-squared / degrees of freedom");
  out += fact(fmt::format("{}", result.others_scanner.size()), "other spheres in the rings, not targets");
  out += fmt::format(
      "</div>{}<p class=\"soft\">scanner at {:.4f} E, {:.4f} N, {:.4f}; {} points read, {} in the rings; "
      "{}</p></div></div>",
      table(result, station, targets), t.x(), t.y(), t.z(), result.points_read, result.ring_points, as_markup(scan));
  return out;
}

}  // namespace

std::string targets_page(std::span<const StationResult> results, std::span<const SurveyedStation> stations,
                         std::span<const SurveyedTarget> targets, const TargetsConfig& config,
                         const TargetsRunNotes& notes) {
  std::string out =
      "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width\"><title>sphere targets</title><style>";
  out += kStyle;
  out += fmt::format(
      "</style><h1>Scans oriented from sphere targets</h1><p class=\"soft\">{} · {} · {} · range {:.1f} mm (accuracy "
      "{:.1f} mm), angles {:.1f} urad</p>",
      as_markup(notes.date), as_markup(notes.program),
      config.method == CentreMethod::KnownRadius ? "known radius, weighted" : "as published",
      1000 * config.noise.range_precision_m, 1000 * config.noise.range_accuracy_m, 1e6 * config.noise.angle_rad);
  for (const std::string& refused : notes.refused) out += "<p class=\"bad\">refused: " + as_markup(refused) + "</p>";
  out +=
      "<p class=\"soft\">Plan, north up: rings of the targets' distances; <span class=\"good\">used</span>, <span "
      "class=\"check\">check</span>, <span class=\"bad\">not found or "
      "rejected</span>; dashed: other spheres of the right size. Lines: scan minus survey.</p>";
  for (std::size_t i = 0; i < results.size(); ++i)
    out +=
        station_part(results[i], stations[results[i].station], targets, i < notes.scans.size() ? notes.scans[i] : "");
  return out + "</html>\n";
}

}  // namespace hueline::calibration
