#include "apps/fleet/catalogue_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "apps/fleet/coverage_map.hpp"
#include "core/printable.hpp"
#include "core/remote_store.hpp"
#include "score/plot.hpp"

namespace hueline::apps {
namespace {

constexpr std::size_t kMostMaps = 12, kMostTroubles = 40, kMostNames = 5;

constexpr const char* kPageStyle = R"(
body{font:14px/1.4 system-ui,sans-serif;color:#111;background:#fff;max-width:1500px;margin:16px auto;padding:0 16px}
h1{font-size:20px;margin:0 0 4px}h2{font-size:16px;margin:24px 0 6px;border-top:1px solid #ddd;padding-top:12px}h3{font-size:14px;margin:10px 0 4px}
.facts{display:flex;flex-wrap:wrap;gap:6px 28px;margin:8px 0}.facts b{display:block;font-size:20px}.facts span{color:#555;font-size:12px}
.maps{display:grid;grid-template-columns:repeat(auto-fit,minmax(420px,1fr));gap:12px}figure{margin:0}figcaption{font-size:12px;color:#555}
.charts{display:grid;grid-template-columns:repeat(auto-fill,minmax(340px,1fr));gap:12px}
svg{width:100%;border:1px solid #bbb;background:#fafafa}svg text{font:12px sans-serif}
polyline{fill:none;stroke-width:2.5;stroke-linejoin:round;stroke-linecap:round}
polyline.good{stroke:#12813f}polyline.remarks{stroke:#d98200;stroke-dasharray:9 4}polyline.again{stroke:#c0001c;stroke-dasharray:3 4}polyline.none{stroke:#888}
.grid{stroke:#ddd}.charts{margin-top:6px}path.bar{stroke:#111;stroke-width:3}.key{font-size:12px}.key i{display:inline-block;width:26px;border-top:3px solid;vertical-align:middle;margin:0 4px 0 10px}
i.good{color:#12813f}i.remarks{color:#d98200;border-top-style:dashed}i.again{color:#c0001c;border-top-style:dotted}i.none{color:#888}
.scroll{overflow-x:auto}table{border-collapse:collapse;font-size:13px;font-variant-numeric:tabular-nums}
th,td{text-align:left;padding:3px 10px 3px 0;border-bottom:1px solid #ddd;vertical-align:top;white-space:nowrap}td.n,th.n{text-align:right}td.w{white-space:normal;min-width:260px;max-width:560px;overflow-wrap:anywhere}
td.good{color:#0a5c2b}td.remarks{color:#7a4b00}td.again{color:#a10018;font-weight:600}
@page{size:A4 landscape;margin:10mm}
)";

std::string count_of(std::size_t count, const char* one, const char* many) {
  return fmt::format("{} {}", count, count == 1 ? one : many);
}

std::string marked(const std::string& text) { return as_markup(printable(text)); }

template <class Number>
std::string number(const std::optional<Number>& value, double factor, int digits) {
  return value ? fmt::format("{:.{}f}", static_cast<double>(*value) * factor, digits) : "";
}

std::string short_digest(const std::string& sha256) { return sha256.substr(0, 8); }

/// Returns an ISO 8601 time as people write it: "2026-11-28 12:34".
std::string minute(const std::string& iso) {
  if (iso.size() < 16) return {};
  return iso.substr(0, 10) + " " + iso.substr(11, 5);
}

/// Returns an ISO 8601 time in days since 1970.
std::optional<double> days_of(const std::string& iso) {
  int year = 0, month = 0, day = 0, hour = 0, minute = 0;
  if (std::sscanf(iso.c_str(), "%4d-%2d-%2dT%2d:%2d", &year, &month, &day, &hour, &minute) != 5) return {};
  const std::chrono::year_month_day date(std::chrono::year(year), std::chrono::month(static_cast<unsigned>(month)),
                                         std::chrono::day(static_cast<unsigned>(day)));
  if (!date.ok()) return {};
  return static_cast<double>(std::chrono::sys_days(date).time_since_epoch().count()) + (hour + minute / 60.0) / 24;
}

std::int64_t product_bytes(const CatalogueEntry& entry) {
  std::int64_t out = 0;
  for (const auto& [file, product] : entry.products) out += static_cast<std::int64_t>(product.bytes);
  return out;
}

/// Sums over drives of which all values are known.
struct Totals {
  std::size_t drives = 0;
  double path_m = 0, duration_s = 0, recorded = 0, products = 0, fusion_s = 0;
};

Totals totals_of(const std::vector<CatalogueEntry>& entries, bool with_fusion) {
  Totals out;
  for (const CatalogueEntry& one : entries) {
    if (!one.path_m || !one.duration_s || !one.recording_bytes || (with_fusion && !one.fusion_s)) continue;
    ++out.drives;
    out.path_m += *one.path_m;
    out.duration_s += *one.duration_s;
    out.recorded += static_cast<double>(*one.recording_bytes);
    out.products += static_cast<double>(product_bytes(one));
    out.fusion_s += one.fusion_s.value_or(0);
  }
  return out;
}

std::string facts(const std::vector<CatalogueEntry>& entries) {
  std::map<std::string, std::size_t> grades;
  std::set<std::string> rigs;
  double path_m = 0, duration_s = 0, points = 0;
  for (const CatalogueEntry& one : entries) {
    if (!one.verdict.empty()) ++grades[one.verdict];
    if (!one.rig.empty()) rigs.insert(one.rig);
    path_m += one.path_m.value_or(0);
    duration_s += one.duration_s.value_or(0);
    points += static_cast<double>(one.points.value_or(0));
  }
  std::string out = "<div class=\"facts\">";
  const auto fact = [&](const std::string& value, const std::string& words) {
    out += fmt::format("<div><b>{}</b><span>{}</span></div>", value, marked(words));
  };
  fact(fmt::format("{}", entries.size()), entries.size() == 1 ? "drive" : "drives");
  for (const auto& [grade, count] : grades) fact(fmt::format("{}", count), grade);
  fact(fmt::format("{}", rigs.size()), rigs.size() == 1 ? "rig" : "rigs");
  fact(fmt::format("{:.1f} km", path_m / 1000), "driven");
  fact(fmt::format("{:.1f} h", duration_s / 3600), "recorded");
  fact(fmt::format("{:.1f} M", points / 1e6), "points");
  return out + "</div>\n";
}

std::string maps(const std::vector<CatalogueEntry>& entries) {
  const std::vector<CoverageArea> areas = coverage_areas(entries);
  if (areas.empty()) return "<p>No drive has a place.</p>\n";
  std::string out = "<div class=\"maps\">\n";
  for (std::size_t i = 0; i < areas.size() && i < kMostMaps; ++i)
    out += fmt::format("<figure>{}<figcaption>{}, {:.1f} km, around {:.3f} {:.3f}</figcaption></figure>\n",
                       coverage_map(areas[i], entries), count_of(areas[i].drives.size(), "drive", "drives"),
                       areas[i].path_m / 1000, areas[i].latitude_deg, areas[i].longitude_deg);
  out +=
      "</div>\n<p class=\"key\"><i class=\"good\"></i>good <i class=\"remarks\"></i>usable with remarks "
      "<i class=\"again\"></i>drive again <i class=\"none\"></i>no verdict</p>\n";
  if (areas.size() > kMostMaps)
    out += fmt::format("<p>{} are not shown, the smallest.</p>\n", count_of(areas.size() - kMostMaps, "area", "areas"));
  return out;
}

/// Names some of the drives.
std::string some(const std::vector<std::string>& names) {
  std::string out;
  for (std::size_t i = 0; i < names.size() && i < kMostNames; ++i) out += (i > 0 ? ", " : "") + marked(names[i]);
  if (names.size() > kMostNames) out += fmt::format(" and {} more", names.size() - kMostNames);
  return out;
}

std::string failures(const std::vector<CatalogueEntry>& entries) {
  std::map<std::string, std::vector<const CatalogueEntry*>> by_status;
  for (const CatalogueEntry& one : entries)
    if (one.status != "done" && (one.status != "driven" || !one.text.empty())) by_status[one.status].push_back(&one);
  struct Wrong {
    std::vector<std::string> drives;
    double lasted_s = 0;
    std::string example;
  };
  std::map<std::pair<std::string, std::string>, Wrong> by_trouble;
  for (const CatalogueEntry& one : entries)
    for (const CatalogueTrouble& trouble : one.troubles) {
      Wrong& wrong = by_trouble[{trouble.sensor, trouble.trouble}];
      if (wrong.drives.empty()) wrong.example = trouble.cause;
      if (wrong.drives.empty() || wrong.drives.back() != one.name) wrong.drives.push_back(one.name);
      wrong.lasted_s += trouble.lasted_s;
    }
  if (by_status.empty() && by_trouble.empty()) return "<p>Nothing.</p>\n";
  std::string out;
  if (!by_status.empty()) {
    out +=
        "<h3>Drives without whole results</h3>\n<div class=\"scroll\"><table>\n<tr><th>status</th><th "
        "class=\"n\">drives</th>"
        "<th>which</th><th>for example</th></tr>\n";
    for (const auto& [status, drives] : by_status) {
      std::vector<std::string> names;
      for (const CatalogueEntry* one : drives) names.push_back(one->name);
      out += fmt::format("<tr><td>{}</td><td class=\"n\">{}</td><td class=\"w\">{}</td><td class=\"w\">{}</td></tr>\n",
                         marked(status), drives.size(), some(names), marked(drives.front()->text));
    }
    out += "</table></div>\n";
  }
  if (by_trouble.empty()) return out;
  std::vector<std::pair<std::pair<std::string, std::string>, Wrong>> sorted(by_trouble.begin(), by_trouble.end());
  std::ranges::stable_sort(sorted, [](const auto& a, const auto& b) {
    return std::pair(a.second.drives.size(), a.second.lasted_s) > std::pair(b.second.drives.size(), b.second.lasted_s);
  });
  out +=
      "<h3>Warnings and alarms</h3>\n<div class=\"scroll\"><table>\n<tr><th>sensor</th><th>trouble</th><th "
      "class=\"n\">drives</th>"
      "<th class=\"n\">s</th><th>which</th><th>for example</th></tr>\n";
  for (std::size_t i = 0; i < sorted.size() && i < kMostTroubles; ++i) {
    const auto& [what, wrong] = sorted[i];
    out += fmt::format(
        "<tr><td>{}</td><td>{}</td><td class=\"n\">{}</td><td class=\"n\">{:.0f}</td><td class=\"w\">{}</td>"
        "<td class=\"w\">{}</td></tr>\n",
        marked(what.first), marked(what.second), wrong.drives.size(), wrong.lasted_s, some(wrong.drives),
        marked(wrong.example));
  }
  out += "</table></div>\n";
  if (sorted.size() > kMostTroubles)
    out +=
        fmt::format("<p>{} are not shown, the rarest.</p>\n", count_of(sorted.size() - kMostTroubles, "kind", "kinds"));
  return out;
}

/// Charts of what the watch found in the drives of a rig, by date.
std::string watch_charts(const std::vector<const CatalogueEntry*>& drives) {
  score::Chart turn{.title = "Head turned against the rig",
                    .x_label = {},
                    .y_label = "deg",
                    .kind = score::Chart::Kind::Points,
                    .bar_names = {},
                    .curves = {{"about x", {}, {}}, {"about y", {}, {}}, {"about z", {}, {}}}};
  score::Chart late = turn;
  late.title = "Images late against the rig";
  late.y_label = "ms";
  late.curves = {{"late", {}, {}}};
  std::optional<double> begin;
  for (const CatalogueEntry* one : drives) {
    const auto day = days_of(one->begin);
    if (!one->watch || !day) continue;
    if (!begin) {
      begin = std::floor(*day);
      turn.x_label = late.x_label = "days after " + one->begin.substr(0, 10);
    }
    for (std::size_t i = 0; i < turn.curves.size(); ++i) {
      turn.curves[i].points.emplace_back(*day - *begin, one->watch->turn_deg[i]);
      turn.curves[i].plus_minus.push_back(one->watch->turn_sigma_deg);
    }
    late.curves[0].points.emplace_back(*day - *begin, one->watch->late_ms);
    late.curves[0].plus_minus.push_back(one->watch->late_sigma_ms);
  }
  if (!begin) return "<p>No drive was watched for long enough (key <code>watch.images_per_s</code> of the rig).</p>\n";
  return "<div class=\"charts\">" + score::svg(turn) + score::svg(late) + "</div>\n";
}

std::string calibration(const std::vector<const CatalogueEntry*>& by_time) {
  std::map<std::string, std::vector<const CatalogueEntry*>> by_rig;
  for (const CatalogueEntry* one : by_time)
    if (!one->rig.empty()) by_rig[one->rig].push_back(one);
  if (by_rig.empty()) return "<p>No rig could be read.</p>\n";
  std::string out;
  for (const auto& [rig, drives] : by_rig) {
    struct Used {
      std::string first, last;
      std::size_t drives = 0;
    };
    std::vector<std::pair<std::string, Used>> texts;  // in the order of their first use
    for (const CatalogueEntry* one : drives) {
      auto found = std::ranges::find(texts, one->rig_sha256, &std::pair<std::string, Used>::first);
      if (found == texts.end()) found = texts.insert(texts.end(), {one->rig_sha256, {one->begin, one->begin, 0}});
      if (found->second.first.empty()) found->second.first = one->begin;
      if (!one->begin.empty()) found->second.last = one->begin;
      ++found->second.drives;
    }
    out += fmt::format(
        "<h3>{}</h3>\n<table>\n<tr><th>rig file (SHA-256)</th><th>first drive, UTC</th><th>last</th><th class=\"n\">"
        "drives</th></tr>\n",
        marked(rig));
    for (const auto& [sha256, used] : texts)
      out += fmt::format("<tr><td title=\"{}\">{}</td><td>{}</td><td>{}</td><td class=\"n\">{}</td></tr>\n", sha256,
                         short_digest(sha256), minute(used.first), minute(used.last), used.drives);
    out += "</table>\n" + watch_charts(drives);
  }
  return out;
}

std::string costs(const std::vector<CatalogueEntry>& entries) {
  const Totals recorded = totals_of(entries, false), fused = totals_of(entries, true);
  if (recorded.drives == 0 || recorded.path_m <= 0) return "<p>No drive has a path and a known size.</p>\n";
  const double km = recorded.path_m / 1000;
  std::string out = fmt::format(
      "<table>\n<tr><th></th><th class=\"n\">drives</th><th class=\"n\">in all</th><th class=\"n\">a kilometre</th>"
      "<th class=\"n\">an hour driven</th></tr>\n");
  const auto row = [&](const char* what, std::size_t drives, double all, const char* unit, double kms, double hours) {
    out += fmt::format(
        "<tr><th>{0}</th><td class=\"n\">{1}</td><td class=\"n\">{2:.2f} {3}</td><td class=\"n\">{4:.3f} {3}</td>"
        "<td class=\"n\">{5:.2f} {3}</td></tr>\n",
        what, drives, all, unit, all / kms, all / hours);
  };
  const double hours = std::max(recorded.duration_s / 3600, 1e-9);
  row("recordings", recorded.drives, recorded.recorded / 1e9, "GB", km, hours);
  row("results", recorded.drives, recorded.products / 1e9, "GB", km, hours);
  if (fused.drives > 0 && fused.path_m > 0)
    row("fusion, time of one task after another", fused.drives, fused.fusion_s / 3600, "h", fused.path_m / 1000,
        std::max(fused.duration_s / 3600, 1e-9));
  return out + "</table>\n";
}

std::string table(const std::vector<const CatalogueEntry*>& by_time, const std::filesystem::path& folder) {
  std::string out =
      "<div class=\"scroll\"><table>\n<tr><th>drive</th><th>status</th><th>verdict</th><th>begin, UTC</th><th "
      "class=\"n\">min</th>"
      "<th class=\"n\">km</th><th class=\"n\">M points</th><th class=\"n\">coloured, %</th><th class=\"n\">recorded, "
      "GB</th><th class=\"n\">"
      "results, GB</th><th class=\"n\">fusion, s</th><th>rig</th><th>rig file</th><th>why</th></tr>\n";
  for (const CatalogueEntry* one : by_time) {
    std::string name = marked(one->name.empty() ? one->recording : one->name);
    if (one->products.contains("report.html") && !is_address(one->results)) {
      const std::string link = (std::filesystem::path(one->results) / "report.html").lexically_proximate(folder);
      name = fmt::format("<a href=\"{}\">{}</a>", percent_encoded(link, true), name);
    }
    std::string why = one->text;
    if (!one->reasons.empty()) why += (why.empty() ? "" : "; ") + one->reasons.front();
    if (one->reasons.size() > 1) why += fmt::format("; and {} more", one->reasons.size() - 1);
    const std::int64_t bytes = product_bytes(*one);
    out += fmt::format("<tr><td title=\"{}\">{}</td><td>{}</td><td class=\"{}\">{}</td><td>{}</td>", marked(one->key),
                       name, marked(one->status), drive_class(*one), marked(one->verdict), minute(one->begin));
    for (const std::string& value :
         {number(one->duration_s, 1.0 / 60, 1), number(one->path_m, 1e-3, 2), number(one->points, 1e-6, 2),
          number(one->coloured_share, 100, 1), number(one->recording_bytes, 1e-9, 2),
          bytes > 0 ? fmt::format("{:.2f}", static_cast<double>(bytes) * 1e-9) : std::string(),
          number(one->fusion_s, 1, 0)})
      out += fmt::format("<td class=\"n\">{}</td>", value);
    out += fmt::format("<td>{}</td><td title=\"{}\">{}</td><td class=\"w\">{}</td></tr>\n", marked(one->rig),
                       one->rig_sha256, short_digest(one->rig_sha256), marked(why));
  }
  return out + "</table></div>\n";
}

}  // namespace

std::string catalogue_page(const std::vector<CatalogueEntry>& entries, const std::filesystem::path& folder) {
  std::vector<const CatalogueEntry*> by_time;
  for (const CatalogueEntry& one : entries) by_time.push_back(&one);
  std::ranges::stable_sort(by_time, {}, [](const CatalogueEntry* one) { return std::pair(one->begin, one->name); });
  std::string out = fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width\"><title>{0}</title>\n<style>{1}</style></head>\n<body>\n<h1>{0}</h1>\n",
      count_of(entries.size(), "drive", "drives"), kPageStyle);
  const auto part = [&](const char* title, const std::string& content) {
    out += fmt::format("<h2>{}</h2>\n{}", title, content);
  };
  out += facts(entries);
  part("Where", maps(entries));
  part("Verdicts", table(by_time, folder));
  part("What was wrong", failures(entries));
  part("Calibration over time", calibration(by_time));
  part("Costs", costs(entries));
  return out + "</body></html>\n";
}

}  // namespace hueline::apps
