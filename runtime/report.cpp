#include "runtime/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>
#include <vector>

#include "core/angle.hpp"
#include "core/calendar.hpp"
#include "core/geodesy.hpp"
#include "core/portable_math.hpp"
#include "core/printable.hpp"

namespace hueline::runtime {
namespace {

constexpr double kWidth = 720, kHeight = 380, kBorder = 24;  // of the map, px

struct Place {
  double x = 0, y = 0;
};

/// Converts places to pixels of the map: north is up, and both axes have one scale.
class MapFrame {
 public:
  explicit MapFrame(const std::vector<DriveMap::Second>& seconds) {
    for (const auto& second : seconds) {
      if (!second.place) continue;
      if (!T_enu_ecef_) T_enu_ecef_ = ecef_from_enu(*second.place).inverse();
      const Place at = metres(*second.place);
      west_ = std::min(west_, at.x), east_ = std::max(east_, at.x);
      south_ = std::min(south_, at.y), north_ = std::max(north_, at.y);
    }
    const double wide = std::max(east_ - west_, 10.0), high = std::max(north_ - south_, 10.0);
    scale_ = std::min((kWidth - 2 * kBorder) / wide, (kHeight - 2 * kBorder) / high);
  }
  bool is_empty() const { return !T_enu_ecef_; }
  double scale() const { return scale_; }  ///< px/m
  Place pixel(const Geodetic& place) const {
    const Place at = metres(place);
    return {kWidth / 2 + (at.x - (west_ + east_) / 2) * scale_, kHeight / 2 - (at.y - (south_ + north_) / 2) * scale_};
  }

 private:
  Place metres(const Geodetic& place) const {
    const auto at = *T_enu_ecef_ * to_ecef(place);
    return {at.xyz.x(), at.xyz.y()};
  }
  std::optional<Transform<Enu, Ecef>> T_enu_ecef_;
  double west_ = 0, east_ = 0, south_ = 0, north_ = 0, scale_ = 1;
};

/// The classes of the map's lines, the gravest last.
enum class Line { Driven, Coloured, Colourless, Empty };
constexpr std::array<const char*, 4> kLines{"driven", "coloured", "colourless", "empty"};

Line line_of(const DriveMap::Second& second, bool measures, bool has_cameras, const config::HealthLimits& limits) {
  if (!measures) return Line::Driven;
  if (second.points == 0) return Line::Empty;
  const double share = static_cast<double>(second.coloured) / static_cast<double>(second.points);
  return has_cameras && share < limits.coloured_share ? Line::Colourless : Line::Coloured;
}

std::string map_svg(const config::Rig& rig, const Verdict& verdict, const Summary& summary, const DriveMap& map) {
  const auto& seconds = map.seconds();
  const MapFrame frame(seconds);
  if (frame.is_empty()) return "<p>There is no map: no good solution of the POS came.</p>\n";
  std::size_t begin = seconds.size(), end = 0;  // of the measuring
  for (std::size_t i = 0; i < seconds.size(); ++i)
    if (seconds[i].points > 0) begin = std::min(begin, i), end = i + 1;
  std::string out = fmt::format("<svg viewBox=\"0 0 {:.0f} {:.0f}\" role=\"img\" aria-label=\"map of the drive\">\n",
                                kWidth, kHeight);
  std::optional<Place> last;
  std::string points, weak;
  Line kind = Line::Driven;
  const auto write = [&] {
    if (!points.empty())
      out += fmt::format("<polyline class=\"{}\" points=\"{}\"/>\n", kLines[static_cast<std::size_t>(kind)], points);
    points.clear();
  };
  for (std::size_t i = 0; i < seconds.size(); ++i) {
    const auto& second = seconds[i];
    if (!second.place) {
      write();
      last.reset();
      continue;
    }
    const Place at = frame.pixel(*second.place);
    const Line now = line_of(second, i >= begin && i < end, !rig.sync.cameras.empty(), rig.health);
    if (last && now == kind && portable::hypot(at.x - last->x, at.y - last->y) < 0.7) continue;  // nothing to see
    if (now != kind && last) {
      points += fmt::format("{:.1f},{:.1f} ", at.x, at.y);
      write();
    }
    kind = now;
    points += fmt::format("{:.1f},{:.1f} ", at.x, at.y);
    const bool is_weak = (second.fix && *second.fix < rig.health.fix) ||
                         (second.sigma_m >= 0 && static_cast<double>(second.sigma_m) > rig.health.pose_sigma_m);
    if (is_weak) weak += fmt::format("<circle class=\"weak\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"5\"/>\n", at.x, at.y);
    last = at;
  }
  write();
  out += weak;
  int number = 0;
  for (const Remark& one : verdict.remarks) {
    ++number;
    if (!one.place) continue;
    const Place at = frame.pixel(*one.place);
    out += fmt::format(
        "<g class=\"place\"><circle cx=\"{0:.1f}\" cy=\"{1:.1f}\" r=\"8\"/><text x=\"{0:.1f}\" "
        "y=\"{2:.1f}\">{3}</text></g>\n",
        at.x, at.y, at.y + 4, number);
  }
  for (std::size_t i = 0; i < summary.marks().size(); ++i) {
    const OperatorCommand& mark = summary.marks()[i];
    if (!mark.place) continue;
    const Place at = frame.pixel(*mark.place);
    out += fmt::format(
        "<g class=\"mark\"><path d=\"M{0:.1f} {1:.1f}v-16\"/><rect x=\"{2:.1f}\" y=\"{3:.1f}\" width=\"26\" "
        "height=\"14\"/><text x=\"{4:.1f}\" y=\"{5:.1f}\">M{6}</text></g>\n",
        at.x, at.y, at.x - 13, at.y - 30, at.x, at.y - 19, i + 1);
  }
  // A bar of a round length.
  double bar_m = 1;
  for (const double step : {2.0, 2.5, 2.0, 2.0, 2.5, 2.0, 2.0, 2.5, 2.0, 2.0, 2.5, 2.0, 2.0, 2.5, 2.0})
    if (bar_m * step * frame.scale() < 140) bar_m *= step;
  out += fmt::format(
      "<path class=\"bar\" d=\"M{0:.0f} {1:.0f}h{2:.1f}\"/><text class=\"bar\" x=\"{0:.0f}\" "
      "y=\"{3:.0f}\">{4}</text>\n",
      kBorder / 2, kHeight - 8, bar_m * frame.scale(), kHeight - 14,
      bar_m < 1000 ? fmt::format("{:.0f} m", bar_m) : fmt::format("{:.0f} km", bar_m / 1000));
  out += fmt::format("<text class=\"bar\" x=\"{:.0f}\" y=\"18\">N &#8593;</text>\n", kWidth - 34);
  return out +
         "</svg>\n<p class=\"key\"><i class=\"coloured\"></i>coloured <i class=\"colourless\"></i>too few colours "
         "<i class=\"empty\"></i>no points <i class=\"driven\"></i>driven only <i class=\"weak\"></i>weak GNSS or pose "
         "&#9312; place of a remark; M1 mark of the operator</p>\n";
}

void row(std::string& out, const char* what, const std::string& value, const std::string& wanted = {}) {
  out += fmt::format("<tr><th>{}</th><td>{}</td><td>{}</td></tr>\n", what, as_markup(value), as_markup(wanted));
}

std::string figures(const config::Rig& rig, const Summary& summary, const DriveMap& map) {
  const auto json = summary.json();
  std::string out = "<table>\n<tr><th></th><th>measured</th><th>wanted</th></tr>\n";
  if (json.contains("drive"))
    row(out, "Drive",
        fmt::format("{} to {}, {:.0f} s, {:.0f} m", json["drive"]["begin"].get<std::string>(),
                    json["drive"]["end"].get<std::string>(), json["drive"]["duration_s"].get<double>(),
                    json["drive"]["path_m"].get<double>()));
  std::size_t measured = 0, empty = 0, begin = map.seconds().size(), end = 0;
  for (std::size_t i = 0; i < map.seconds().size(); ++i)
    if (map.seconds()[i].points > 0) begin = std::min(begin, i), end = i + 1, ++measured;
  if (end > begin) empty = end - begin - measured;
  row(out, "Coverage", fmt::format("{} points in {} s; {} s without points", summary.points(), measured, empty));
  row(out, "Placed", fmt::format("{:.2f} % of the returns", 100 * summary.placed_share()),
      fmt::format("{:.1f} %", 100 * rig.health.placed_share));
  if (!rig.sync.cameras.empty())
    row(out, "Colour", fmt::format("{:.1f} % of the points", 100 * summary.coloured_share()),
        fmt::format("{:.0f} %", 100 * rig.health.coloured_share));
  const auto& exposures = json["exposures"];
  row(out, "Time",
      fmt::format("{} exposures, {} by event mark, {} unmatched; sigma {:.1f} us rms, {:.1f} us largest",
                  exposures["total"].get<std::uint64_t>(), exposures["by_timing"]["EventMark"].get<std::uint64_t>(),
                  exposures["by_timing"]["Unmatched"].get<std::uint64_t>(),
                  exposures["time_sigma_rms_us"].get<double>(), exposures["time_sigma_largest_us"].get<double>()),
      fmt::format("{:.0f} us", to_seconds(rig.health.time_sigma) * 1e6));
  std::vector<float> sigmas;
  std::size_t weak = 0;
  for (const auto& second : map.seconds()) {
    if (second.sigma_m >= 0) sigmas.push_back(second.sigma_m);
    if (second.fix && *second.fix < rig.health.fix) ++weak;
  }
  std::ranges::sort(sigmas);
  std::string trajectory = "no good solution";
  if (json.contains("drive"))
    trajectory = fmt::format("{} of {} solutions good", json["drive"]["good_solutions"].get<std::uint64_t>(),
                             json["drive"]["solutions"].get<std::uint64_t>());
  if (!sigmas.empty())
    trajectory +=
        fmt::format("; horizontal sigma {:.3f} m median, {:.3f} m largest", sigmas[sigmas.size() / 2], sigmas.back());
  if (weak > 0) trajectory += fmt::format("; {} s with weak GNSS", weak);
  row(out, "Trajectory", trajectory, fmt::format("{:.2f} m", rig.health.pose_sigma_m));
  row(out, "Lost, all sensors",
      fmt::format("{} lost, {} by full buffers, {} missing in the order", summary.lost(FaultKind::Lost),
                  summary.lost(FaultKind::Overflow), json["journal"]["sequence_gaps"].get<std::uint64_t>()));
  return out + "</table>\n";
}

std::string marks_table(const Summary& summary) {
  constexpr std::size_t kListed = 40;
  if (summary.marks().empty()) return {};
  std::string out = "<h2>Marks of the operator</h2>\n<table>\n";
  for (std::size_t i = 0; i < summary.marks().size() && i < kListed; ++i) {
    const OperatorCommand& mark = summary.marks()[i];
    out += fmt::format("<tr><th>M{}</th><td>{}{}</td><td>{}</td></tr>\n", i + 1,
                       mark.time ? iso_utc(*mark.time) : fmt::format("{:.1f} s", mark.drive_s),
                       mark.place ? fmt::format(", {:.6f} {:.6f}", mark.place->latitude * kDegPerRad,
                                                mark.place->longitude * kDegPerRad)
                                  : "",
                       as_markup(mark.command.note));
  }
  out += "</table>\n";
  if (summary.marks().size() > kListed)
    out += fmt::format("<p>{} more are in summary.json.</p>\n", summary.marks().size() - kListed);
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

std::string drive_report(const config::Rig& rig, const Verdict& verdict, const Summary& summary, const DriveMap& map) {
  constexpr std::array<const char*, 3> kClasses{"good", "remarks", "again"};
  constexpr std::size_t kListed = 12;  // so that it stays one page
  std::string out = fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width\"><title>Drive of {0}: {1}</title>\n<style>{2}</style></head>\n<body>\n"
      "<h1>Drive of the rig {0}</h1>\n<p class=\"grade {3}\">{1}</p>\n",
      as_markup(rig.name), name(verdict.grade), kStyle, kClasses[static_cast<std::size_t>(verdict.grade)]);
  out += map_svg(rig, verdict, summary, map);
  out += "<h2>What to drive again, and remarks</h2>\n";
  if (verdict.remarks.empty()) out += "<p>Nothing: nothing was missing while the vehicle moved.</p>\n";
  if (!verdict.remarks.empty()) out += "<ol>\n";
  for (std::size_t i = 0; i < verdict.remarks.size() && i < kListed; ++i) {
    const Remark& one = verdict.remarks[i];
    std::string when;
    if (one.end_s > 0)
      when = fmt::format(" ({}{:.0f} s, {:.0f} m{})", one.begin ? iso_utc(*one.begin) + ", " : "",
                         one.end_s - one.begin_s, one.length_m,
                         one.place ? fmt::format(", {:.6f} {:.6f}", one.place->latitude * kDegPerRad,
                                                 one.place->longitude * kDegPerRad)
                                   : "");
    out +=
        fmt::format("<li class=\"{}\"><b>{}{}</b>: {}{}</li>\n", kClasses[static_cast<std::size_t>(one.grade)],
                    one.grade == Grade::Again ? "drive again: " : "", as_markup(one.sensor), as_markup(one.text), when);
  }
  if (!verdict.remarks.empty()) out += "</ol>\n";
  if (verdict.remarks.size() > kListed)
    out += fmt::format("<p>{} more are in summary.json.</p>\n", verdict.remarks.size() - kListed);
  out += marks_table(summary);
  out += "<h2>Figures</h2>\n" + figures(rig, summary, map);
  return out +
         "<footer>hueline; the thresholds are the keys <code>health</code> of the rig.</footer>\n</body></html>\n";
}

}  // namespace hueline::runtime
