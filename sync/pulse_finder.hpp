#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "core/time.hpp"

namespace hueline::sync {

/// Finds the second's phase among edges that may be spurious, doubled or half-second: edges that lie whole seconds
/// apart belong together; a phase wins if it has `needed` edges and at least twice as many as any other. Bounded
/// memory.
class PulseFinder {
 public:
  /// `rate_limit`: largest rate error of the host clock, as a ratio.
  PulseFinder(int needed, double rate_limit) : needed_(needed), rate_limit_(rate_limit) {}

  /// The edges of the winning phase, oldest first, the newest included; empty while nothing is decided.
  std::vector<HostTime> add(HostTime edge);
  void reset() { edges_.clear(); }
  /// True if two phases have enough edges and neither wins.
  bool is_ambiguous() const { return ambiguous_; }

 private:
  bool together(HostTime a, HostTime b) const;
  int needed_;
  double rate_limit_;
  std::deque<HostTime> edges_;
  bool ambiguous_ = false;
};

}  // namespace hueline::sync
