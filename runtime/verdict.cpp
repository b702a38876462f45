#include "runtime/verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/angle.hpp"
#include "core/calendar.hpp"
#include "runtime/summary.hpp"

namespace hueline::runtime {
namespace {

constexpr double kStands_m = 3;  // a shorter way is noise of the POS

/// Returns whether an episode is a reason against the drive.
bool counts(const HealthEpisode& one, const Health& health, const config::HealthLimits& limits) {
  // How much room a disk has says nothing about what was driven.
  if (one.level < HealthLevel::Warning || one.trouble == Trouble::Disk) return false;
  if (one.end_m < kStands_m && health.path_m() >= kStands_m) return false;
  if (!one.lasts) return true;
  const bool ends_with_it = one.begin_s >= health.last_packet_s() - to_seconds(limits.end);
  const bool stands = one.end_m - one.begin_m < kStands_m && health.path_m() >= kStands_m;
  return !ends_with_it && !stands;
}

/// Returns the share of the path for which an alarm held, or of the time if the vehicle stood.
double alarm_share(const std::vector<const HealthEpisode*>& episodes, const Health& health) {
  const bool moved = health.path_m() >= kStands_m;
  std::vector<std::pair<double, double>> parts;
  for (const HealthEpisode* one : episodes)
    if (one->level == HealthLevel::Alarm)
      parts.emplace_back(moved ? one->begin_m : one->begin_s, moved ? one->end_m : one->end_s);
  std::ranges::sort(parts);
  double sum = 0, up_to = 0;
  for (const auto& [begin, end] : parts) {
    sum += std::max(0.0, end - std::max(begin, up_to));
    up_to = std::max(up_to, end);
  }
  const double whole = moved ? health.path_m() : health.drive_s();
  return whole > 0 ? sum / whole : 0;
}

Remark of_drive(Grade grade, std::string text) { return {grade, "drive", std::move(text), 0, 0, {}, {}, {}, 0}; }

}  // namespace

const char* name(Grade grade) {
  switch (grade) {
    case Grade::Good:
      return "good";
    case Grade::Remarks:
      return "usable with remarks";
    case Grade::Again:
      return "drive again";
  }
  return "?";
}

double percent_below(double share) { return std::floor(1000 * share + 1e-9) / 10; }

Verdict judge_drive(const config::Rig& rig, const Health& health, const Summary& summary) {
  const config::HealthLimits& limits = rig.health;
  Verdict out;
  std::vector<const HealthEpisode*> episodes;
  for (const HealthEpisode& one : health.episodes())
    if (counts(one, health, limits)) episodes.push_back(&one);
  out.alarm_share = alarm_share(episodes, health);

  const auto remark = [&](Grade grade, std::string text) { out.remarks.push_back(of_drive(grade, std::move(text))); };
  for (const std::string& one : rig.not_known)
    remark(Grade::Remarks, "the rig has a guess for what is not known: " + one);
  if (summary.lost(FaultKind::DiskFull) > 0) remark(Grade::Again, "the recording ended before the drive did");
  if (summary.points() == 0) {
    remark(Grade::Again, "no point was placed");
  } else {
    const double placed = summary.placed_share(), coloured = summary.coloured_share();
    if (placed < limits.placed_share)
      remark(placed < 0.5 ? Grade::Again : Grade::Remarks,
             fmt::format("{:.1f} % of the returns became points (wanted: {:.1f} %)", percent_below(placed),
                         100 * limits.placed_share));
    if (!rig.sync.cameras.empty() && coloured < limits.coloured_share)
      remark(coloured < limits.coloured_share_alarm ? Grade::Again : Grade::Remarks,
             fmt::format("{:.1f} % of the points are coloured (wanted: {:.1f} %; drive again below {:.1f} %)",
                         percent_below(coloured), 100 * limits.coloured_share, 100 * limits.coloured_share_alarm));
  }
  if (out.alarm_share > limits.again_share)
    remark(Grade::Again, fmt::format("alarms for {:.1f} % of the way (allowed: {:.1f} %)", 100 * out.alarm_share,
                                     100 * limits.again_share));
  for (const HealthEpisode* one : episodes)
    out.remarks.push_back({Grade::Remarks, one->sensor == kSystemSensor ? "drive" : rig.sensor_names().at(one->sensor),
                           one->cause, one->begin_s, one->end_s, one->begin, one->end, one->place,
                           one->end_m - one->begin_m});
  if (health.episodes_not_kept() > 0)
    remark(Grade::Remarks, fmt::format("{} further troubles are not listed", health.episodes_not_kept()));
  std::ranges::stable_sort(out.remarks, [](const Remark& a, const Remark& b) { return a.grade > b.grade; });
  for (const Remark& one : out.remarks) out.grade = std::max(out.grade, one.grade);
  return out;
}

std::string Verdict::text() const {
  std::string reasons, places;
  for (std::size_t i = 0; i < remarks.size() && i < 3; ++i)
    reasons += fmt::format("{}{}: {}", i == 0 ? "" : "; ", remarks[i].sensor, remarks[i].text);
  if (remarks.size() > 3) reasons += fmt::format("; and {} more", remarks.size() - 3);
  std::vector<const Remark*> told;
  for (const Remark& one : remarks) {
    // Two sensors may have been in trouble on the same stretch, which is driven once.
    const bool is_within =
        std::ranges::any_of(told, [&](const Remark* t) { return t->begin_s <= one.begin_s && one.end_s <= t->end_s; });
    if (!one.place || is_within || told.size() == 3) continue;
    told.push_back(&one);
    places += fmt::format("{}{:.0f} s for {:.0f} s and {:.0f} m at {:.6f} {:.6f}", places.empty() ? "" : "; ",
                          one.begin_s, one.end_s - one.begin_s, one.length_m, one.place->latitude * kDegPerRad,
                          one.place->longitude * kDegPerRad);
  }
  return fmt::format("verdict    {}\n           {}\n           {}\n", name(grade),
                     reasons.empty() ? "nothing was missing while the vehicle moved" : reasons,
                     places.empty() ? "report.html has the map and the figures" : "where: " + places);
}

nlohmann::ordered_json Verdict::json() const {
  nlohmann::ordered_json out = {{"grade", name(grade)}, {"alarm_share", alarm_share}};
  auto& list = out["remarks"] = nlohmann::ordered_json::array();
  for (const Remark& one : remarks) {
    nlohmann::ordered_json entry = {{"grade", name(one.grade)}, {"sensor", one.sensor}, {"text", one.text}};
    if (one.end_s > 0) {
      entry["begin_s"] = one.begin_s;
      entry["end_s"] = one.end_s;
      entry["length_m"] = one.length_m;
    }
    if (one.begin) entry["begin"] = iso_utc(*one.begin);
    if (one.end) entry["end"] = iso_utc(*one.end);
    if (one.place)
      entry["place"] = {{"latitude_deg", one.place->latitude * kDegPerRad},
                        {"longitude_deg", one.place->longitude * kDegPerRad}};
    list.push_back(std::move(entry));
  }
  return out;
}

}  // namespace hueline::runtime
