#include "sync/pulse_finder.hpp"

#include <cmath>
#include <cstdlib>

namespace hueline::sync {

bool PulseFinder::together(HostTime a, HostTime b) const {
  const std::int64_t d = (b - a).count();
  const std::int64_t whole_s = (d + 500'000'000) / 1'000'000'000;
  if (whole_s < 1) return false;
  // 300 us is the largest interrupt latency of an edge that still belongs to this phase.
  const double tolerance = 300e3 + rate_limit_ * static_cast<double>(d);
  return std::abs(static_cast<double>(d - whole_s * 1'000'000'000)) <= tolerance;
}

std::vector<HostTime> PulseFinder::add(HostTime edge) {
  if (!edges_.empty() && edge < edges_.back()) edges_.clear();
  edges_.push_back(edge);
  const std::chrono::seconds memory(4 * needed_ + 4);
  while (edges_.size() > 64 || edge - edges_.front() > memory) edges_.pop_front();
  std::vector<HostTime> members;
  for (const HostTime e : edges_)
    if (e == edge || together(e, edge)) members.push_back(e);
  ambiguous_ = false;
  if (static_cast<int>(members.size()) < needed_) return {};
  for (std::size_t i = 0; i < edges_.size(); ++i) {
    if (edges_[i] == edge || together(edges_[i], edge)) continue;
    std::size_t rivals = 1;
    for (std::size_t k = 0; k < edges_.size(); ++k)
      if (k != i && (k < i ? together(edges_[k], edges_[i]) : together(edges_[i], edges_[k]))) ++rivals;
    if (2 * rivals > members.size()) {
      ambiguous_ = true;
      return {};
    }
  }
  return members;
}

}  // namespace hueline::sync
