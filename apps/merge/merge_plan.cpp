#include "apps/merge/merge_plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "apps/merge/sensor_choice.hpp"
#include "core/calendar.hpp"
#include "core/json_text.hpp"
#include "storage/journal_segments.hpp"

namespace hueline::apps {
namespace {

using Json = nlohmann::ordered_json;

constexpr nanoseconds kClocksAgree =
    std::chrono::milliseconds(1);  // beside five sigma: less is no proof of another clock
constexpr nanoseconds kWideSigma = std::chrono::milliseconds(1);  // more is told
constexpr std::uint64_t kTellEvery = 4096;                        // packets

std::string seconds_text(nanoseconds time) {
  const auto ns = static_cast<unsigned long long>(std::abs(time.count()));
  return fmt::format("{}{}.{:09} s", time.count() < 0 ? "-" : "+", ns / 1'000'000'000, ns % 1'000'000'000);
}

/// Returns in words what a recording knows of GPS time.
std::string seconds_of(const SurveyedJournal& journal) {
  const auto& seconds = journal.clock.seconds();
  if (seconds.empty()) return fmt::format("{} has none: {}", journal.name, journal.clock.why_none());
  const auto text = [](const sync::SecondSeen& one) { return iso_utc(gps_time_ns(one.second * 1'000'000'000)); };
  return fmt::format("{} has {} from {} to {}", journal.name, seconds.size(), text(seconds.front()),
                     text(seconds.back()));
}

bool is_by_pulses(const SurveyedJournal& one) { return one.clock.by_pulses() == one.clock.seconds().size(); }

std::string how(const SurveyedJournal& a, const SurveyedJournal& b) {
  return is_by_pulses(a) && is_by_pulses(b) ? "pulses" : "arrivals of messages";
}

/// Finds how the clock of a recording is related to that of the first.
Result<sync::ClockRelation> relate(const MergeWish& wish, const SurveyedJournal& first, const SurveyedJournal& other) {
  const std::string both = fmt::format("{} and {}", first.name, other.name);
  const bool is_self_timed = first.recording.rig.sync.self_timed || other.recording.rig.sync.self_timed;
  if (is_self_timed && !wish.is_same_clock)
    return Error{ErrorCode::Invalid,
                 fmt::format("{}: one of them was read from files, whose times are those that the devices name, not "
                             "those of a computer: give --same-clock if that holds for both",
                             both)};
  if (is_self_timed) return sync::ClockRelation();
  auto relation = sync::ClockRelation::fit(first.clock.seconds(), other.clock.seconds());
  if (!wish.is_same_clock) {
    if (relation.ok()) return relation;
    return Error{ErrorCode::Unsupported,
                 fmt::format("{}: {}. Of the seconds of GPS time, {}; {}. {}", both, relation.error().message,
                             seconds_of(first), seconds_of(other),
                             relation.error().code == ErrorCode::Invalid
                                 ? "Both computers must record the receiver's pulses and messages during one drive; "
                                   "--same-clock joins recordings of one computer without them"
                                 : "They cannot be joined")};
  }
  if (!relation.ok()) return sync::ClockRelation();
  const sync::ClockRelation::Knot& knot = relation->knots().front();
  const nanoseconds most = kClocksAgree + nanoseconds(std::llround(5 * knot.sigma_ns));
  if (std::chrono::abs(knot.offset) <= most) return sync::ClockRelation();
  return Error{ErrorCode::Invalid,
               fmt::format("{}: --same-clock is wrong, their clocks differ by {}", both, seconds_text(knot.offset))};
}

/// Returns what merge.json says of a clock.
Json clock_json(const SurveyedJournal& first, const SurveyedJournal& journal, const sync::ClockRelation& relation) {
  if (&first == &journal) return {{"is_first", true}};
  if (relation.knots().empty()) return {{"is_same_clock", true}};
  Json knots = Json::array();
  for (const auto& knot : relation.knots())
    knots.push_back({{"at_ns", count_ns(knot.at)},
                     {"offset_ns", knot.offset.count()},
                     {"rate_ppm", knot.rate * 1e6},
                     {"sigma_ns", knot.sigma_ns},
                     {"rate_sigma_ppm", knot.rate_sigma * 1e6},
                     {"seconds", knot.seconds},
                     {"left_out", knot.left_out}});
  return {{"by", how(first, journal)},
          {"common_seconds", relation.common_seconds()},
          {"left_out", relation.left_out()},
          {"rate_ppm", relation.rate() * 1e6},
          {"knots", knots}};
}

/// Describes the relation of a clock in a sentence.
std::string clock_text(const SurveyedJournal& first, const SurveyedJournal& journal,
                       const sync::ClockRelation& relation) {
  if (&first == &journal) return "its clock is kept";
  if (relation.knots().empty()) return "the same clock";
  const auto& knot = relation.knots().front();
  double sigma = 0;
  for (const auto& one : relation.knots()) sigma = std::max(sigma, one.sigma_ns);
  std::string out = fmt::format(
      "its clock is restated by {} at its first common second, rate {:+.4f} ppm, sigma at most {:.3f} us, by "
      "{} of {} common seconds",
      seconds_text(knot.offset), relation.rate() * 1e6, sigma * 1e-3, how(first, journal), relation.common_seconds());
  if (relation.left_out() > 0) out += fmt::format(" ({} fit nothing and are left out)", relation.left_out());
  return out;
}

bool has_rings_gaps_only(const SurveyedJournal& journal) {
  return journal.recording.journal->removed().packets > 0 && journal.check.missing() == 0;
}

/// Returns which recordings keep their ticks: the first, and those that its computer made before or after all others.
std::vector<bool> with_ticks(const MergeWish& wish, const std::vector<SurveyedJournal>& journals) {
  std::vector<bool> out;
  for (const SurveyedJournal& one : journals)
    out.push_back(&one == journals.data() ||
                  (wish.is_same_clock && std::ranges::all_of(journals, [&](const SurveyedJournal& other) {
                     return &other == &one || other.span.is_apart_from(one.span);
                   })));
  return out;
}

}  // namespace

void TimeSpan::add(HostTime time, bool is_first) {
  first = is_first ? time : std::min(first, time);
  last = is_first ? time : std::max(last, time);
}

SurveyedJournal::SurveyedJournal(std::string named, runtime::Recording opened)
    : name(std::move(named)),
      recording(std::move(opened)),
      clock(recording.rig),
      check(storage::SegmentPlace::of(recording.journal->header()).number > 1),
      wire(recording.rig.sensors.size() + 1),
      spans(wire.size()),
      begins_late(storage::SegmentPlace::of(recording.journal->header()).number > 1) {}

Result<SurveyedJournal> survey_journal(const std::string& name, const std::stop_token& stop,
                                       const std::function<void(double)>& progress) {
  auto recording = runtime::Recording::open(name);
  if (!recording.ok()) return recording.error();
  SurveyedJournal out(name, std::move(*recording));
  bool is_stopped = false;
  storage::JournalReader& journal = *out.recording.journal;
  const Status read = out.recording.for_each([&](const Packet& packet) {
    is_stopped = stop.stop_requested();
    if (progress && out.packets % kTellEvery == 0)
      progress(static_cast<double>(journal.position()) /
               static_cast<double>(std::max<std::uint64_t>(1, journal.file_size())));
    out.span.add(packet.received, out.packets++ == 0);
    if (packet.kind == PacketKind::Wire && packet.sensor < out.wire.size())
      out.spans[packet.sensor].add(packet.received, out.wire[packet.sensor]++ == 0);
    out.check.take(packet);
    out.clock.take(packet);
    return !is_stopped;
  });
  if (is_stopped) return Error{ErrorCode::Stopped, "stopped"};
  if (!read.ok() && read.error().code == ErrorCode::Io) return read.error();
  out.check.finish(journal.removed().packets);
  return out;
}

Result<MergePlan> plan_merge(const MergeWish& wish, std::vector<SurveyedJournal> journals) {
  auto choice = choose_sensors(wish, journals);
  if (!choice.ok()) return choice.error();
  MergePlan out;
  out.warnings = std::move(choice->warnings);
  out.header = runtime::journal_header(wish.rig);
  Json told = Json::array();
  std::string merged_from;
  const std::vector<bool> ticks = with_ticks(wish, journals);
  for (std::size_t i = 0; i < journals.size(); ++i) {
    SurveyedJournal& journal = journals[i];
    auto relation = i == 0 ? Result<sync::ClockRelation>(sync::ClockRelation()) : relate(wish, journals[0], journal);
    if (!relation.ok()) return relation.error();
    const std::vector<std::optional<SensorId>>& sensors = choice->sensors[i];
    std::vector<std::string> kept, left_out;
    for (const auto& sensor : journal.recording.rig.sensors)
      (sensors[sensor.id] ? kept : left_out).push_back(sensor.name);
    const std::string names = kept.empty() ? "no sensor" : fmt::format("{}", fmt::join(kept, ", "));
    merged_from += fmt::format("{}{} ({})", i > 0 ? "; " : "", journal.name, names);
    out.remarks.push_back(
        fmt::format("{}: {}{}; {}", journal.name, names,
                    left_out.empty() ? std::string() : fmt::format(" (left out: {})", fmt::join(left_out, ", ")),
                    clock_text(journals[0], journal, *relation)));
    const auto sigma_at = [&](HostTime t) { return relation->sigma(sync::OtherTime(t.time_since_epoch())); };
    if (const nanoseconds sigma = std::max(sigma_at(journal.span.first), sigma_at(journal.span.last));
        sigma > kWideSigma)
      out.warnings.push_back(fmt::format(
          "{}: the sigma of its restated times reaches {:.1f} ms, {}", journal.name, to_seconds(sigma) * 1e3,
          is_by_pulses(journals[0]) && is_by_pulses(journal) ? "where no common second is near"
                                                             : "because not both have recorded pulses"));
    told.push_back({{"name", journal.name},
                    {"rig", journal.recording.rig.name},
                    {"rig_file", fmt::format("rig_{}.yaml", i + 1)},
                    {"about", journal.recording.journal->header().about},
                    {"sensors", kept},
                    {"left_out", left_out},
                    {"clock", clock_json(journals[0], journal, *relation)}});
    out.header.has_packed_images |= journal.recording.journal->header().has_packed_images;
    out.header.files.push_back({fmt::format("rig_{}.yaml", i + 1), "application/yaml", journal.recording.rig.text});
    const bool is_ring = has_rings_gaps_only(journal);
    if (is_ring)
      out.warnings.push_back(fmt::format("{}: a ring has removed {} packets of it, which are not missing here by name",
                                         journal.name, journal.recording.journal->removed().packets));
    out.inputs.push_back({journal.name, std::move(journal.recording.journal), sensors, std::move(*relation),
                          journal.begins_late, is_ring, ticks[i]});
  }
  out.header.about[kMergedFrom] = merged_from;
  out.header.files.push_back({"merge.json", "application/json", json_text(Json{{"recordings", told}}, 2) + "\n"});
  return out;
}

}  // namespace hueline::apps
