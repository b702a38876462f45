#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "core/time.hpp"

namespace hueline::sync {

/// Finds the phase of the second among edges of which some may be spurious, doubled or half-second. Edges that lie
/// whole seconds apart belong to one phase. A phase wins if it has at least `needed` edges and at least twice as many
/// as any other. Memory is bounded. Thread safety: one thread per object.
class PulseFinder {
 public:
  /// `rate_limit` is the largest rate error of the host clock, as a ratio.
  PulseFinder(int needed, double rate_limit) : needed_(needed), rate_limit_(rate_limit) {}

  /// Adds an edge. Returns the edges of the winning phase, oldest first, this edge included; empty while no phase wins.
  std::vector<HostTime> add(HostTime edge);
  void reset() { edges_.clear(); }
  /// Returns true if a phase has enough edges but another has too many for it to win.
  bool is_ambiguous() const { return ambiguous_; }

 private:
  bool together(HostTime a, HostTime b) const;
  int needed_;
  double rate_limit_;
  std::deque<HostTime> edges_;
  bool ambiguous_ = false;
};

}  // namespace hueline::sync
