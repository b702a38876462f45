#include "apps/import/pose_choice.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <tuple>
#include <utility>

#include "core/calendar.hpp"
#include "drivers/ros/ros_solution.hpp"

namespace hueline::apps {
namespace {

using drivers::RosPosePart, drivers::RosPoseRank;

/// Topics of one kind say the same, so one of them is enough.
using PoseKind = std::pair<RosPoseRank, RosPosePart>;
constexpr PoseKind kOrientations{RosPoseRank::Part, RosPosePart::Orientation},
    kPositions{RosPoseRank::Part, RosPosePart::Position}, kSolutions{RosPoseRank::Solution, RosPosePart::Whole},
    kSigmas{RosPoseRank::Solution, RosPosePart::Sigmas};

PoseKind kind_of(const PoseTopic& topic) { return {drivers::pose_rank(topic.type), drivers::pose_part(topic.type)}; }

/// By kind, the name of its topic.
using KindTopics = std::map<PoseKind, std::string>;

/// Which of the types of one kind says most surely where the vehicle is. A PoseStamped may be a place to go to.
int sureness(const std::string& type) {
  if (drivers::carries_transforms(type)) return 0;
  if (type.starts_with("geometry_msgs/")) return 1;
  return drivers::is_gps_fix(type) ? 1 : 2;
}

KindTopics best_of_each(const std::map<std::string, PoseTopic>& found) {
  std::map<PoseKind, std::uint64_t> most;
  for (const auto& [name, topic] : found) most[kind_of(topic)] = std::max(most[kind_of(topic)], topic.usable);
  const auto worth = [&](const PoseTopic& one) {
    const bool is_rare = 10 * one.usable < most[kind_of(one)];
    return std::tuple(!is_rare, sureness(one.type), one.usable, drivers::solution_states_sigmas(one.type));
  };
  KindTopics out;
  for (const auto& [name, topic] : found) {
    if (topic.usable == 0) continue;
    // The names come in their order, so the first of equal ones stays.
    const auto [known, is_new] = out.try_emplace(kind_of(topic), name);
    if (!is_new && worth(topic) > worth(found.at(known->second))) known->second = name;
  }
  return out;
}

/// Returns whether two topics were sent at the same time, by their stamps.
bool meet(const PoseTopic& a, const PoseTopic& b) {
  if (!a.begin || !b.begin) return true;
  return *a.begin <= *b.end + kSameClock && *b.begin <= *a.end + kSameClock;
}

/// Returns the local pose whose orientation goes best with the positions of another topic; empty: none has one.
std::string best_oriented(const std::map<std::string, PoseTopic>& found, const PoseTopic& positions) {
  std::uint64_t most = 0;
  for (const auto& [name, topic] : found) most = std::max(most, topic.oriented);
  const auto worth = [&](const PoseTopic& one) {
    return std::tuple(meet(one, positions), 10 * one.oriented >= most, sureness(one.type), one.oriented);
  };
  std::string out;
  for (const auto& [name, topic] : found)
    if (topic.oriented > 0 && (out.empty() || worth(topic) > worth(found.at(out)))) out = name;
  return out;
}

/// Returns whether the best topics of a rank are a pose together.
bool is_whole(RosPoseRank rank, const KindTopics& topics) {
  if (rank == RosPoseRank::Solution) return topics.contains(kSolutions);
  return rank != RosPoseRank::Part || (topics.contains(kOrientations) && topics.contains(kPositions));
}

std::string what_it_lacks(const PoseTopic& topic) {
  if (topic.of_several > 0) return "its messages have several poses, or none, and do not say which is the vehicle's";
  const PoseKind kind = kind_of(topic);
  if (kind == kOrientations) return "no message of it says an orientation";
  if (kind == kPositions) return "no message of it says a position";
  return kind == kSigmas ? "no message of it says sigmas" : "no message of it says a pose";
}
std::string what_it_needs(const PoseKind& kind) {
  if (kind == kSigmas) return "its sigmas need the solutions of INSPVA";
  return kind == kOrientations ? "its orientations need the positions of a sensor_msgs/NavSatFix"
                               : "its positions need the orientations of a sensor_msgs/Imu or a nav_msgs/Odometry";
}
constexpr const char* kNoOrigin = "its metres need an origin or a map, see --origin and --map";

/// Returns why a topic cannot be used as what `kind` says, whatever others there are; empty: it can.
std::string why_useless(const PoseTopic& topic, const KindTopics& best, bool is_world_known, const PoseKind& kind) {
  if (kind != kind_of(topic)) return {};  // a local pose that gives its orientation alone
  if (!topic.why.empty()) return topic.why;
  if (topic.usable == 0) return what_it_lacks(topic);
  if (kind.first == RosPoseRank::Local && !is_world_known) return kNoOrigin;
  return is_whole(kind.first, best) ? std::string() : what_it_needs(kind);
}

/// Puts the topics `wanted` in the place of the best of their kinds, and returns their rank.
Result<RosPoseRank> take_wanted(const std::map<std::string, PoseTopic>& found, bool is_world_known,
                                const std::vector<std::string>& wanted, KindTopics& best) {
  const auto wrong = [](const std::string& topic, const std::string& why) {
    return Error{ErrorCode::Invalid, fmt::format("--poses {}: {}", topic, why)};
  };
  const bool has_positions = std::ranges::any_of(
      wanted, [&](const std::string& name) { return found.contains(name) && kind_of(found.at(name)) == kPositions; });
  std::map<PoseKind, std::string> named;
  for (const std::string& name : wanted) {
    const auto topic = found.find(name);
    if (topic == found.end()) return wrong(name, "the recording has no poses of that topic");
    // Of a local pose beside positions the orientation is meant.
    const bool is_orientation = has_positions && topic->second.oriented > 0;
    const PoseKind kind = is_orientation ? kOrientations : kind_of(topic->second);
    if (const std::string why = why_useless(topic->second, best, is_world_known, kind); !why.empty())
      return wrong(name, why);
    if (const auto [other, is_new] = named.try_emplace(kind, name); !is_new && other->second != name)
      return wrong(name, fmt::format("{} says the same; name one of them", other->second));
    if (named.begin()->first.first != kind.first || named.rbegin()->first.first != kind.first)
      return wrong(name, "a pose is taken from one topic, or from one of NavSatFix and one of Imu");
    best[kind] = name;
  }
  return named.begin()->first.first;
}

/// Returns how many messages of a topic that was chosen can be used.
std::uint64_t messages_of(const std::map<std::string, PoseTopic>& found, const PoseChoice& chosen,
                          const std::string& name) {
  return name == chosen.oriented_by ? found.at(name).oriented : found.at(name).usable;
}

/// Returns the times of two topics that do not meet; empty: they do.
std::string how_apart(const std::map<std::string, PoseTopic>& found, const std::string& a, const std::string& b) {
  if (meet(found.at(a), found.at(b))) return {};
  const auto times = [&](const std::string& name) {
    const PoseTopic& topic = found.at(name);
    return fmt::format("{} are from {} to {}", name, iso_utc(from_unix(*topic.begin)), iso_utc(from_unix(*topic.end)));
  };
  return fmt::format("the times of {}, those of {}: they do not meet, as stamps of different clocks", times(a),
                     times(b));
}

/// Learns from the topics that were chosen which clock their times are of.
void learn_clock(const std::map<std::string, PoseTopic>& found, PoseChoice& out) {
  out.is_by_stamp = out.rank == RosPoseRank::Part || out.rank == RosPoseRank::Local;
  std::uint64_t usable = 0, before_gps = 0;
  std::optional<UnixTime> begin;
  std::optional<nanoseconds> delay, shortest;
  for (const std::string& name : out.topics) {
    const PoseTopic& topic = found.at(name);
    usable += messages_of(found, out, name);
    before_gps += topic.before_gps;
    if (topic.begin) begin = std::min(begin.value_or(*topic.begin), *topic.begin);
    if (topic.delay && (!delay || std::chrono::abs(*topic.delay) < std::chrono::abs(*delay))) delay = topic.delay;
    if (topic.shortest_delay) shortest = std::min(shortest.value_or(*topic.shortest_delay), *topic.shortest_delay);
  }
  out.is_sigma_known = !out.is_by_stamp || std::ranges::any_of(out.topics, [&](const std::string& name) {
    return name != out.oriented_by && 2 * found.at(name).with_sigma > found.at(name).usable;
  });
  out.begin = begin.value_or(UnixTime());
  // Where the recorder's clock is behind, the nearest times are those of the message that was the longest under way.
  out.delay = delay.value_or(nanoseconds(0));
  if (out.is_by_stamp && shortest && std::chrono::abs(out.delay) > kSameClock) out.delay = *shortest;
  // A few such stamps are of a computer that did not know the time yet, and are told as not used.
  if (out.is_by_stamp && 2 * before_gps > usable) out.shift = kSimulatorBegin.time_since_epoch();
  out.is_other_pace = std::ranges::any_of(out.topics, [&](const std::string& name) {
    const PoseTopic& topic = found.at(name);
    return (out.shift == nanoseconds(0) ? topic.pace : topic.pace_before_gps).is_other();
  });
}

}  // namespace

void RecorderPace::take(UnixTime stamp, UnixTime received) {
  if (!first_stamp) first_stamp = stamp, first_received = received;
  last_stamp = stamp;
  last_received = received;
}

bool RecorderPace::is_other() const {
  if (!first_stamp) return false;
  const nanoseconds span = last_stamp - *first_stamp;
  const nanoseconds apart = std::chrono::abs((last_received - first_received) - span);
  return apart > kSameClock && apart > std::chrono::abs(span) / 100;
}

Result<PoseChoice> choose_pose(const std::map<std::string, PoseTopic>& found, bool is_world_known,
                               const std::vector<std::string>& wanted) {
  PoseChoice out;
  KindTopics best = best_of_each(found);
  if (const auto at = best.find(kPositions); at != best.end()) {
    const PoseTopic& positions = found.at(at->second);
    const std::string oriented = best_oriented(found, positions);
    const auto known = best.find(kOrientations);
    // An Imu is better, unless its stamps are of another clock.
    if (!oriented.empty() &&
        (known == best.end() || (!meet(found.at(known->second), positions) && meet(found.at(oriented), positions))))
      best[kOrientations] = oriented;
  }
  for (const auto& [kind, name] : best)
    if (is_whole(kind.first, best) && why_useless(found.at(name), best, is_world_known, kind).empty())
      out.rank = std::max(out.rank, kind.first);
  if (!wanted.empty()) {
    const auto rank = take_wanted(found, is_world_known, wanted, best);
    if (!rank.ok()) return rank.error();
    out.rank = *rank;
  }
  // INSPVAX has sigmas of its own.
  if (best.contains(kSolutions) && drivers::solution_states_sigmas(found.at(best.at(kSolutions)).type))
    best.erase(kSigmas);
  std::set<std::string> taken;
  for (const auto& [kind, name] : best) {
    if (kind.first != out.rank) continue;
    taken.insert(name);
    const PoseTopic& topic = found.at(name);
    if (kind != kPositions && kind != kSigmas) out.frame = topic.frame;
    if (kind != kind_of(topic)) {
      out.oriented_by = name;
      continue;
    }
    out.is_height_known &= !drivers::is_gps_fix(topic.type);
    out.farthest_m = std::max(out.farthest_m, topic.farthest_m);
    if (topic.first_place) out.first_place = topic.first_place;
    out.path = topic.path;
  }
  out.topics.assign(taken.begin(), taken.end());
  if (out.rank == RosPoseRank::Part) out.apart = how_apart(found, best.at(kPositions), best.at(kOrientations));
  learn_clock(found, out);
  for (const auto& [name, topic] : found) {
    if (taken.contains(name)) continue;
    std::string why = why_useless(topic, best, is_world_known, kind_of(topic));
    if (why.empty() && !best.contains(kind_of(topic)))
      why = fmt::format("the solutions of {} state their own sigmas", best.at(kSolutions));
    else if (why.empty() && best.at(kind_of(topic)) != name && kind_of(topic).first == out.rank)
      why = fmt::format("the pose is that of {}, with {} messages that can be used, of {} here; --poses {} takes this",
                        best.at(kind_of(topic)), messages_of(found, out, best.at(kind_of(topic))), topic.usable, name);
    else if (why.empty())
      why = fmt::format("the pose is that of {}; --poses {} takes this", fmt::join(out.topics, " and "), name);
    out.not_used[name] = why;
  }
  return out;
}

}  // namespace hueline::apps
