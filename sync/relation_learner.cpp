#include "sync/relation_learner.hpp"

#include <algorithm>
#include <tuple>

namespace hueline::sync {

void RelationLearner::add(std::int64_t counter_ns, GpsTime arrival) {
  images_.push_back({counter_ns, arrival});
  while (images_.size() > 64) images_.pop_front();
}

bool RelationLearner::is_refuted(std::int64_t difference) const {
  // A late delivery votes for the mark after its own. With that difference, an image on time would have arrived earlier
  // than possible.
  return std::any_of(images_.begin(), images_.end(), [&](const Seen& image) {
    return image.arrival - gps_time_ns(image.counter + difference) < config_.latency_min - 3 * config_.tolerance;
  });
}

/// Returns the votes of all images, sorted by difference and then by mark.
std::vector<RelationLearner::Vote> RelationLearner::votes(const std::vector<GpsTime>& marks) const {
  std::vector<Vote> votes;
  for (std::size_t i = 0; i < images_.size(); ++i)
    for (const GpsTime mark : marks) {
      const nanoseconds latency = images_[i].arrival - mark;
      if (latency >= config_.latency_min && latency <= config_.latency_max)
        votes.push_back({count_ns(mark) - images_[i].counter, i, mark});
    }
  std::sort(votes.begin(), votes.end(), [](const Vote& a, const Vote& b) {
    return std::tie(a.difference, a.mark) < std::tie(b.difference, b.mark);
  });
  return votes;
}

std::vector<CameraRelation::Pair> RelationLearner::learn(const std::vector<GpsTime>& marks, bool few_suffice) const {
  const auto votes = this->votes(marks);
  auto pairs = pairs_of_many(votes);
  return pairs.empty() && few_suffice ? pairs_of_few(votes) : pairs;
}

std::vector<CameraRelation::Pair> RelationLearner::pairs_of_few(const std::vector<Vote>& votes) const {
  constexpr std::size_t kFew = 3;
  if (votes.size() < kFew || votes.back().difference - votes.front().difference > config_.tolerance.count() ||
      is_refuted(votes.front().difference))
    return {};
  std::vector<CameraRelation::Pair> pairs;
  std::vector<bool> has_voted(images_.size(), false);
  for (const Vote& vote : votes) {
    if (has_voted[vote.image]) return {};
    has_voted[vote.image] = true;
    pairs.push_back({images_[vote.image].counter, vote.mark});
  }
  std::sort(pairs.begin(), pairs.end(), [](const auto& a, const auto& b) { return a.mark < b.mark; });
  return pairs;
}

std::vector<CameraRelation::Pair> RelationLearner::pairs_of_many(const std::vector<Vote>& votes) const {
  const auto voters = [&](std::size_t from, std::size_t to) {
    std::vector<std::size_t> images;
    for (std::size_t v = from; v < to; ++v) images.push_back(votes[v].image);
    std::sort(images.begin(), images.end());
    return static_cast<int>(std::unique(images.begin(), images.end()) - images.begin());
  };
  int best = 0, rival = 0;
  std::vector<Vote> chosen;
  for (std::size_t from = 0, to = 0; from < votes.size(); from = to) {
    to = from + 1;
    while (to < votes.size() && votes[to].difference - votes[from].difference <= config_.tolerance.count()) ++to;
    if (is_refuted(votes[from].difference)) continue;
    const int n = voters(from, to);
    rival = std::max(rival, std::min(n, best));
    if (n <= best) continue;
    best = n;
    chosen.assign(votes.begin() + static_cast<std::ptrdiff_t>(from), votes.begin() + static_cast<std::ptrdiff_t>(to));
  }
  if (best < config_.images || 2 * rival > best) return {};
  std::vector<CameraRelation::Pair> pairs;
  std::vector<bool> taken(images_.size(), false);
  std::sort(chosen.begin(), chosen.end(), [](const Vote& a, const Vote& b) { return a.mark < b.mark; });
  for (const Vote& vote : chosen) {
    if (taken[vote.image]) continue;  // the first edge of a bounced strobe counts
    taken[vote.image] = true;
    pairs.push_back({images_[vote.image].counter, vote.mark});
  }
  return pairs;
}

}  // namespace hueline::sync
