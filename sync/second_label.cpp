#include "sync/second_label.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>

#include "core/calendar.hpp"

namespace hueline::sync {
namespace {

constexpr std::int64_t kNs = 1'000'000'000;
constexpr std::size_t kCandidates = 16;

std::int64_t ceil_seconds(std::int64_t ns) { return ns >= 0 ? (ns + kNs - 1) / kNs : -(-ns / kNs); }

}  // namespace

std::string describe_offset(std::int64_t s) {
  const std::int64_t a = std::abs(s), rollover = 1024 * kSecondsPerWeek;
  const char* reason = "";
  // Some limits allow one or two seconds more or less, because a measured conflict contains whole seconds of latency.
  if (a == 0)
    reason = "agrees";
  else if (a == 1)
    reason = "label off by one";
  else if (a >= 17 && a <= 18)
    reason = "UTC taken for GPS time, or the reverse";
  else if (a == 19)
    reason = "TAI taken for GPS time";
  else if (a >= 36 && a <= 37)
    reason = "TAI taken for UTC";
  else if (a > rollover - 100 && a < rollover + 100)
    reason = "week number rolled over at 1024";
  else if (a % kSecondsPerWeek < 3)
    reason = "wrong week";
  else if (a % 3600 < 3)
    reason = "whole hours: local time taken for UTC";
  return *reason ? fmt::format("{} s ({})", s, reason) : fmt::format("{} s", s);
}

std::string SecondLabel::Config::validate() const {
  if (agreeing < 1 || agreeing > 1000) return "agreeing must be 1 to 1000";
  if (agreeing_alone < 1 || agreeing_alone > 1000) return "agreeing_alone must be 1 to 1000";
  if (window < std::chrono::seconds(10) || window > std::chrono::seconds(3600)) return "window must be 10 s to 3600 s";
  if (early_tolerance < nanoseconds(0) || early_tolerance > std::chrono::milliseconds(100))
    return "early_tolerance must be 0 to 100 ms";
  if (decisive_latency < std::chrono::milliseconds(1) || decisive_latency > std::chrono::milliseconds(900))
    return "decisive_latency must be 1 to 900 ms";
  if (late_seconds < 1 || late_seconds > 10) return "late_seconds must be 1 to 10";
  return {};
}

void SecondLabel::add(SensorId sensor, Evidence kind, GpsTime time, HostTime received, std::int64_t pulse_ns) {
  ++evidence_;
  const std::int64_t bound_ns = count_ns(time) - pulse_ns;
  const std::int64_t N = ceil_seconds(bound_ns - config_.early_tolerance.count());
  const std::int64_t latency = N * kNs - bound_ns;
  auto source = std::find_if(sources_.begin(), sources_.end(),
                             [&](const Source& s) { return s.sensor == sensor && s.kind == kind; });
  if (source == sources_.end()) {
    sources_.push_back({sensor, kind, received, {}});
    source = sources_.end() - 1;
  }
  auto& candidates = source->candidates;
  const nanoseconds half = config_.window / 2;
  if (received - source->half_began >= half) {
    const bool all_old = received - source->half_began >= 2 * half;
    for (Candidate& c : candidates) {
      c.older = all_old ? 0 : c.newer;
      c.newer = 0;
    }
    std::erase_if(candidates, [](const Candidate& c) { return c.older == 0; });
    source->half_began = received;
  }
  auto found = std::find_if(candidates.begin(), candidates.end(), [&](const Candidate& c) { return c.N == N; });
  if (found == candidates.end()) {
    if (candidates.size() >= kCandidates)
      candidates.erase(std::min_element(
          candidates.begin(), candidates.end(),
          [](const Candidate& a, const Candidate& b) { return a.older + a.newer < b.older + b.newer; }));
    candidates.push_back({N, 0, 0, latency, received});
    found = candidates.end() - 1;
  }
  ++found->newer;
  found->min_latency_ns = std::min(found->min_latency_ns, latency);
  found->seen = received;
}

const SecondLabel::Candidate* SecondLabel::settled(const Source& source, HostTime now) const {
  std::uint64_t total = 0;
  for (const Candidate& c : source.candidates) total += c.older + c.newer;
  const Candidate* best = nullptr;
  for (const Candidate& c : source.candidates) {
    const std::uint64_t support = c.older + c.newer;
    // A few messages among thousands are errors. But a source whose labels are mostly late is still on time now and
    // then.
    if (support < static_cast<std::uint64_t>(config_.agreeing) || support * 20 < total) continue;
    // Labels come once a second at most. For messages that come all the time, a few seconds without one are enough.
    if (now - c.seen >
        (source.kind == Evidence::Label ? nanoseconds(config_.window) / 3 : nanoseconds(config_.window) / 20))
      continue;
    if (!best || c.N > best->N) best = &c;
  }
  return best;
}

std::string SecondLabel::explain(SensorId sensor, std::int64_t difference) const {
  return fmt::format("sensor {} labels the seconds differently by {}; check its UTC and week settings", sensor,
                     describe_offset(difference));
}

std::vector<SecondLabel::Verdict> SecondLabel::verdicts(HostTime now, std::vector<Conflict>& conflicts) const {
  std::vector<Verdict> out;
  for (const Source& source : sources_) {
    const Candidate* c = settled(source, now);
    if (!c) continue;
    if (gps_time_ns(0) + std::chrono::seconds(c->N) < config_.not_before) {
      // N counts from the first pulse, so N seconds after the epoch is the time of the first pulse.
      conflicts.push_back({source.sensor, 0,
                           fmt::format("sensor {} says {}: before any possible drive; its week number has rolled over",
                                       source.sensor, iso_utc(gps_time_ns(0) + std::chrono::seconds(c->N)))});
      continue;
    }
    auto v = std::find_if(out.begin(), out.end(), [&](const Verdict& known) { return known.sensor == source.sensor; });
    if (v == out.end()) {
      out.push_back({source.sensor, {}, {}, false, 0});
      v = out.end() - 1;
    }
    if (source.kind == Evidence::Arrival) {
      v->arrivals = c->N;
      v->decisive = c->min_latency_ns <= config_.decisive_latency.count();
    } else {
      v->labels = c->N;
      v->label_support = c->older + c->newer;
    }
  }
  return out;
}

std::vector<SecondLabel::Opinion> SecondLabel::opinions(HostTime now, std::vector<Conflict>& conflicts) const {
  std::vector<Opinion> out;
  for (const Verdict& v : verdicts(now, conflicts)) {
    if (v.decisive) {
      const std::int64_t difference = v.labels ? *v.labels - *v.arrivals : 0;
      if (difference > 0 || difference < -config_.late_seconds) {
        conflicts.push_back(
            {v.sensor, difference,
             fmt::format("sensor {}: its time labels and the arrival of its other messages differ by {}", v.sensor,
                         describe_offset(difference))});
        if (v.sensor != config_.trusted) continue;
      }
      out.push_back({v.sensor, *v.arrivals, true});
    } else if (v.labels && config_.allow_labels_alone &&
               v.label_support >= static_cast<std::uint64_t>(config_.agreeing_alone) &&
               (!v.arrivals || *v.arrivals <= *v.labels)) {
      out.push_back({v.sensor, *v.labels, false});
    }
  }
  return out;
}

SecondLabel::Decision SecondLabel::decide(HostTime now) const {
  Decision out;
  const std::vector<Opinion> all = opinions(now, out.conflicts);
  if (all.empty()) return out;
  const auto trusted = std::find_if(all.begin(), all.end(), [&](const Opinion& o) {
    return config_.trusted != kSystemSensor && o.sensor == config_.trusted;
  });
  // Without a trusted source, the others are compared with the strongest opinion.
  const Opinion& reference = trusted != all.end()
                                 ? *trusted
                                 : *std::max_element(all.begin(), all.end(), [](const Opinion& a, const Opinion& b) {
                                     return a.decisive < b.decisive;
                                   });
  bool unanimous = true;
  for (const Opinion& o : all) {
    const std::int64_t difference = o.N - reference.N;
    const bool merely_late = reference.decisive && !o.decisive && difference < 0 && difference >= -config_.late_seconds;
    if (difference == 0 || merely_late) continue;
    unanimous = false;
    out.conflicts.push_back({o.sensor, difference, explain(o.sensor, difference)});
  }
  if (trusted != all.end() || unanimous) {
    out.N = reference.N;
    out.from_arrivals = reference.decisive;
  }
  out.disputed = !out.N;
  return out;
}

}  // namespace hueline::sync
