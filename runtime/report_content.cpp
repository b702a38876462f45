#include "runtime/report_content.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/angle.hpp"
#include "core/calendar.hpp"
#include "core/geodesy.hpp"
#include "core/portable_math.hpp"

namespace hueline::runtime {
namespace {

using Map = ReportContent::Map;
using Line = ReportContent::Line;
using Place = ReportMap::Place;

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
    scale_ = std::min((Map::kWidth - 2 * Map::kBorder) / wide, (Map::kHeight - 2 * Map::kBorder) / high);
  }
  bool is_empty() const { return !T_enu_ecef_; }
  double scale() const { return scale_; }  ///< px/m
  Place pixel(const Geodetic& place) const {
    const Place at = metres(place);
    return {Map::kWidth / 2 + (at.x - (west_ + east_) / 2) * scale_,
            Map::kHeight / 2 - (at.y - (south_ + north_) / 2) * scale_};
  }

 private:
  Place metres(const Geodetic& place) const {
    const auto at = *T_enu_ecef_ * to_ecef(place);
    return {at.xyz.x(), at.xyz.y()};
  }
  std::optional<Transform<Enu, Ecef>> T_enu_ecef_;
  double west_ = 0, east_ = 0, south_ = 0, north_ = 0, scale_ = 1;
};

Line line_of(const DriveMap::Second& second, bool measures, bool has_cameras, const config::HealthLimits& limits) {
  if (!measures) return Line::Driven;
  if (second.points == 0) return Line::Empty;
  const double share = static_cast<double>(second.coloured) / static_cast<double>(second.points);
  return has_cameras && share < limits.coloured_share ? Line::Colourless : Line::Coloured;
}

bool has_points(const DriveMap::Second& second) { return second.points > 0; }

/// Returns the first second with points and the one after the last; twice 0 if none has any.
std::pair<std::size_t, std::size_t> measuring(const std::vector<DriveMap::Second>& seconds) {
  const auto first = std::ranges::find_if(seconds, has_points);
  if (first == seconds.end()) return {0, 0};
  const auto last = std::find_if(seconds.rbegin(), seconds.rend(), has_points);
  return {static_cast<std::size_t>(first - seconds.begin()), static_cast<std::size_t>(last.base() - seconds.begin())};
}

std::string degrees(const Geodetic& place) {
  return fmt::format(", {:.6f} {:.6f}", place.latitude * kDegPerRad, place.longitude * kDegPerRad);
}

std::optional<Map> drive_map(const config::Rig& rig, const Verdict& verdict, const Summary& summary,
                             const DriveMap& map) {
  const auto& seconds = map.seconds();
  const MapFrame frame(seconds);
  if (frame.is_empty()) return {};
  const auto [begin, end] = measuring(seconds);
  Map out;
  out.px_per_m = frame.scale();
  std::optional<Place> last;
  Map::Path path;
  const auto write = [&] {
    if (!path.places.empty()) out.paths.push_back(path);
    path.places.clear();
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
    if (last && now == path.line && portable::hypot(at.x - last->x, at.y - last->y) < 0.7) continue;  // nothing to see
    if (now != path.line && last) {
      path.places.push_back(at);
      write();
    }
    path.line = now;
    path.places.push_back(at);
    const bool is_weak = (second.fix && *second.fix < rig.health.fix) ||
                         (second.sigma_m >= 0 && static_cast<double>(second.sigma_m) > rig.health.pose_sigma_m);
    if (is_weak) out.weak.push_back(at);
    last = at;
  }
  write();
  for (std::size_t i = 0; i < verdict.remarks.size(); ++i)
    if (const auto& place = verdict.remarks[i].place) out.remarks.push_back({frame.pixel(*place), i + 1});
  for (std::size_t i = 0; i < summary.marks().size(); ++i)
    if (const auto& place = summary.marks()[i].place) out.marks.push_back({frame.pixel(*place), i + 1});
  return out;
}

std::vector<ReportContent::Figure> figures(const config::Rig& rig, const Summary& summary, const DriveMap& map) {
  const auto json = summary.json();
  std::vector<ReportContent::Figure> out;
  const auto row = [&](const char* what, std::string measured, std::string wanted = {}) {
    out.push_back({what, std::move(measured), std::move(wanted)});
  };
  if (json.contains("drive"))
    row("Drive", fmt::format("{} to {}, {:.0f} s, {:.0f} m", json["drive"]["begin"].get<std::string>(),
                             json["drive"]["end"].get<std::string>(), json["drive"]["duration_s"].get<double>(),
                             json["drive"]["path_m"].get<double>()));
  const auto [begin, end] = measuring(map.seconds());
  const auto measured = static_cast<std::size_t>(std::ranges::count_if(map.seconds(), has_points));
  row("Coverage",
      fmt::format("{} points in {} s; {} s without points", summary.points(), measured, end - begin - measured));
  if (const auto& parts = summary.parts())
    row("Parts of the cloud", fmt::format("{} files of {}, {} points{}", parts->files, parts->split, parts->points,
                                          parts->missing > 0 ? fmt::format("; {} are missing", parts->missing) : ""));
  row("Placed", fmt::format("{:.2f} % of the returns", 100 * summary.placed_share()),
      fmt::format("{:.1f} %", 100 * rig.health.placed_share));
  if (!rig.sync.cameras.empty())
    row("Colour", fmt::format("{:.1f} % of the points", 100 * summary.coloured_share()),
        fmt::format("{:.0f} %", 100 * rig.health.coloured_share));
  const auto& exposures = json["exposures"];
  row("Time",
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
  row("Trajectory", trajectory, fmt::format("{:.2f} m", rig.health.pose_sigma_m));
  row("Lost, all sensors",
      fmt::format("{} lost, {} by full buffers, {} missing in the order", summary.lost(FaultKind::Lost),
                  summary.lost(FaultKind::Overflow), json["journal"]["sequence_gaps"].get<std::uint64_t>()));
  return out;
}

}  // namespace

ScaleBar scale_bar(double px_per_m, double most_px) {
  ScaleBar out;
  for (const double step : {2.0, 2.5, 2.0, 2.0, 2.5, 2.0, 2.0, 2.5, 2.0, 2.0, 2.5, 2.0, 2.0, 2.5, 2.0})
    if (out.length_m * step * px_per_m < most_px) out.length_m *= step;
  out.words =
      out.length_m < 1000 ? fmt::format("{:.0f} m", out.length_m) : fmt::format("{:.0f} km", out.length_m / 1000);
  return out;
}

ReportContent report_content(const config::Rig& rig, const Verdict& verdict, const Summary& summary,
                             const DriveMap& map) {
  ReportContent out;
  out.rig = rig.name;
  out.grade = verdict.grade;
  out.map = drive_map(rig, verdict, summary, map);
  for (const Remark& one : verdict.remarks) {
    std::string when;
    if (one.end_s > 0)
      when = fmt::format(" ({}{:.0f} s, {:.0f} m{})", one.begin ? iso_utc(*one.begin) + ", " : "",
                         one.end_s - one.begin_s, one.length_m, one.place ? degrees(*one.place) : "");
    out.reasons.push_back({one.grade, one.sensor, one.text, std::move(when)});
  }
  for (std::size_t i = 0; i < summary.marks().size(); ++i) {
    const OperatorCommand& mark = summary.marks()[i];
    out.marks.push_back({fmt::format("M{}", i + 1),
                         (mark.time ? iso_utc(*mark.time) : fmt::format("{:.1f} s", mark.drive_s)) +
                             (mark.place ? degrees(*mark.place) : ""),
                         mark.command.note});
  }
  out.figures = figures(rig, summary, map);
  return out;
}

}  // namespace hueline::runtime
