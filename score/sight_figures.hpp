#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "score/figures.hpp"
#include "score/observation.hpp"

namespace hueline::score {

/// Sums up what rays into the world say of a sample of returns: who saw them, what lay between, where edges are.
/// Thread-bound.
class SightFigures {
 public:
  /// Names by surface; must outlive it.
  explicit SightFigures(const std::vector<std::string>& surfaces) : surfaces_(surfaces) {}

  /// One sampled true return that is not on the own vehicle.
  void add(const Observation& observation);
  /// visible_coloured_share, wrong_surface_*, colour_de00_edge/smooth_median, edge_smooth_ratio, hole_*,
  /// moving_contaminated_share.
  void report(ScenarioScore& score) const;

 private:
  struct Share {
    std::uint64_t part = 0, whole = 0;
    void add(bool is_part) {
      ++whole;
      part += is_part ? 1 : 0;
    }
    Figure figure(const char* none) const {
      return whole ? Figure{static_cast<double>(part) / static_cast<double>(whole), {}} : Figure{{}, none};
    }
  };
  static constexpr std::size_t kRings = Outlook::kRadii_px.size() + 1;  // the last: no edge within the largest radius
  static constexpr std::size_t kEdgeRing = 1;  // rings up to this one are "near an edge": two lens pixels

  Chart chart_by_kind() const;

  const std::vector<std::string>& surfaces_;
  Share visible_coloured_, wrong_, wrong_occluded_, hole_coloured_, contaminated_;
  std::array<Share, kRings> wrong_by_ring_;
  std::map<std::string, Share> wrong_by_kind_;  // of surface
  sim::Spread edge_, smooth_, hole_, outside_hole_, wrong_colour_;
  std::uint64_t moving_seen_ = 0, returns_ = 0, not_in_lens_ = 0;
};

}  // namespace hueline::score
