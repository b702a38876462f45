#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <unordered_map>

#include "score/byte_account.hpp"
#include "score/colour_figures.hpp"
#include "score/observation.hpp"
#include "score/reprojection_figures.hpp"
#include "score/round_view.hpp"
#include "score/seam_figures.hpp"
#include "score/time_figures.hpp"

namespace hueline::score {

/// A point as the program gave it.
struct PointClaim {
  sim::Claim claim;  ///< exposure: number of the true exposure. Not coloured: only firing, channel and place count
  bool is_coloured = false;
  std::optional<double>
      latency_ms;  ///< from the last needed input to the packet on which it came out; empty: came out at the end
};

/// An exposure as the program stamped it, with the pose that it gives the head then (in ECEF, row by row).
struct ExposureClaim {
  std::uint32_t number = 0;
  sim::GpsNs mid_gps_ns = 0;
  double sigma_ns = 0;
  std::optional<sim::Pose> T_ecef_head;
};

/// Holds all that the program says of one drive against the drive's truth and gives the figures of metric_table.hpp.
/// What it says depends on the claims alone, not on their order among points. Thread-bound.
class Scorer {
 public:
  struct Config {
    std::size_t ray_returns =
        40'000;  ///< true returns that rays are cast for, about: one in so many, picked by a hash of firing and channel
    std::uint64_t seed = 1;  ///< of that hash
    int threads = 1;         ///< that cast rays, the caller included; the figures do not depend on it
    std::string validate() const;
  };
  /// `cache_dir`: Drive::cache_dir. Errors: those of sim::Judge.
  static Result<Scorer> open(const sim::Scenario& scenario, const std::string& cache_dir, const Config& config);

  void add(const ExposureClaim& exposure);
  void add(const PointClaim& point);
  /// Everything was added: casts the rays and writes the figures. `progress` gets 0 .. 1.
  ScenarioScore finish(const std::string& name, const std::map<std::string, DeviceBytes>& devices,
                       const std::function<void(double)>& progress);

 private:
  Scorer(const sim::Scenario& scenario, sim::Judge judge, const Config& config);
  std::vector<Observation> observe_sample(const std::function<void(double)>& progress) const;
  bool is_sampled(const sim::TrueReturn& truth) const;
  static std::uint64_t key(const sim::TrueReturn& truth) {
    return static_cast<std::uint64_t>(truth.fired_gps_ns) * 64 + truth.channel;
  }

  Config config_;
  sim::Judge judge_;
  sim::GpsNs begin_;
  sim::Pose T_ecef_scene_;
  LabOfRgb lab_;
  std::unique_ptr<Outlook> outlook_;
  std::uint64_t one_in_ = 1;
  std::vector<sim::TrueReturn> sample_;
  std::unordered_map<std::uint64_t, GivenColour> given_;  // of the sample, by key()

  std::vector<ExposureError> exposures_;
  ReprojectionFigures reprojection_;
  ColourFigures colour_;
  SeamFigures seams_;
  std::optional<RoundView> view_;
  sim::Spread latency_, place_;
  std::uint64_t world_returns_ = 0;  // true returns that are not on the own vehicle
  std::uint64_t points_ = 0, own_ = 0, coloured_ = 0, unmatched_ = 0, misplaced_ = 0, at_the_end_ = 0;
};

}  // namespace hueline::score
