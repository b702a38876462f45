#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "score/figures.hpp"
#include "score/observation.hpp"

namespace hueline::score {

/// Sums up what rays into the world show about a sample of returns: which lenses saw them, what was in between, where
/// edges are. Thread safety: none.
class SightFigures {
 public:
  /// `surfaces` are the names of the surfaces. They must outlive this object.
  explicit SightFigures(const std::vector<std::string>& surfaces) : surfaces_(surfaces) {}

  /// Adds one sampled true return that is not on the own vehicle.
  void add(const Observation& observation);
  /// Adds the figures visible_coloured_share, wrong_surface_*, their bounds and that of coloured_share,
  /// colour_de00_edge_median, colour_de00_smooth_median, edge_smooth_ratio, hole_* and moving_contaminated_share.
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
  // the last ring holds returns without an edge within the largest radius
  static constexpr std::size_t kRings = Outlook::kRadii_px.size() + 1;
  static constexpr std::size_t kEdgeRing = 1;  // rings up to this one count as near an edge: two pixels of the lens

  Chart chart_by_kind() const;

  const std::vector<std::string>& surfaces_;
  Share coloured_bound_, visible_coloured_bound_, wrong_bound_;
  Share visible_coloured_, wrong_, wrong_occluded_, hole_coloured_, hole_bound_, hole_visible_, contaminated_;
  std::array<Share, kRings> wrong_by_ring_;
  std::map<std::string, Share> wrong_by_kind_;  // by the kind of surface
  sim::Spread edge_, smooth_, hole_, outside_hole_, wrong_colour_;
  std::uint64_t wrong_needlessly_ = 0;  // a candidate saw the place
  std::uint64_t moving_seen_ = 0, returns_ = 0, not_in_lens_ = 0;
};

}  // namespace hueline::score
