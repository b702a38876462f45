#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "score/byte_account.hpp"
#include "score/colour_figures.hpp"
#include "score/flicker_figures.hpp"
#include "score/motion_figures.hpp"
#include "score/observation.hpp"
#include "score/reprojection_figures.hpp"
#include "score/round_view.hpp"
#include "score/seam_figures.hpp"
#include "score/time_figures.hpp"

namespace hueline::score {

/// A point as the program gave it.
struct PointClaim {
  /// `exposure` is the number of the true exposure. If the point is not coloured, only firing, channel and place count.
  sim::Claim claim;
  bool is_coloured = false;
  std::uint8_t moving = 0;  ///< ColouredPoint::moving
  /// Time from the last needed input to the packet at which the point was given out; empty: given out at the end of the
  /// stream.
  std::optional<double> latency_ms;
};

/// An exposure as the program stamped it, with the pose that the program gives the head at that time (in ECEF).
struct ExposureClaim {
  std::uint32_t number = 0;
  sim::GpsNs mid_gps_ns = 0;
  double sigma_ns = 0;
  std::optional<sim::Pose> T_ecef_head;
  bool has_image = true;  ///< whether the image is whole, so that it could give colours
};

/// A line of sight to a point, and what the program knew of it when it judged whether the lens sees the point.
struct SightClaim {
  std::uint16_t channel = 0;
  sim::GpsNs fired_gps_ns = 0;
  std::uint32_t exposure = 0;  ///< number of the true exposure
  std::size_t lens = 0;
  std::vector<float> evidence;
};

/// Compares everything that the program says of one drive with the drive's truth and computes the figures of
/// metric_table.hpp. The figures depend on the claims, not on the order of the points. Thread safety: none.
class Scorer {
 public:
  struct Config {
    /// Approximate number of true returns for which rays are cast; a hash of firing and channel selects them.
    std::size_t ray_returns = 40'000;
    std::uint64_t seed = 1;  ///< seed of that hash
    /// How many exposures on each side of a firing the colouring may use; they are the candidates of the bounds.
    int neighbours = 4;
    int threads = 1;  ///< threads that cast rays, including the caller; the figures do not depend on their number
    std::string validate() const;
  };
  /// Opens the truth of a drive; `cache_dir` is Drive::cache_dir. Errors: those of sim::Judge, and Invalid
  /// (configuration).
  static Result<Scorer> open(const sim::Scenario& scenario, const std::string& cache_dir, const Config& config);

  /// Adds an exposure. An exposure that the camera did not make is ignored.
  void add(const ExposureClaim& exposure);
  /// Adds the latency of a point that got a provisional colour, ms.
  void add_provisional(double latency_ms) { provisional_latency_.add(latency_ms); }
  /// Adds a point, coloured or not.
  void add(const PointClaim& point);
  /// Takes note of lines of sight to the sampled returns from now on.
  void keep_sights() { keeps_sights_ = true; }
  bool keeps_sights() const { return keeps_sights_; }
  void add(SightClaim sight);
  /// Writes a table of the lines of sight that were kept: a line each with the number of the return, whether the lens
  /// truly saw it (1) or met something else (0), and the evidence, whose words are the columns' names. Errors: Io.
  Status write_sights(const std::filesystem::path& file, std::span<const char* const> words) const;
  /// Casts the rays and computes the figures. Call it after everything was added. `progress` gets 0 .. 1.
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
  std::unordered_map<std::uint64_t, GivenColour> given_;  // of the sampled returns, by key()

  bool keeps_sights_ = false;
  struct KeptSight {
    sim::Vec3 place;
    SightClaim claim;
  };
  std::vector<KeptSight> sights_;  // of the sampled returns

  std::vector<ExposureError> exposures_;
  std::vector<bool> is_there_;  // by exposure: whether the colouring got its image and its pose
  ReprojectionFigures reprojection_;
  ColourFigures colour_;
  SeamFigures seams_;
  FlickerFigures flicker_;
  MotionFigures motion_;
  std::optional<RoundView> view_;
  sim::Spread latency_, provisional_latency_, place_;
  std::uint64_t world_returns_ = 0;  // true returns that are not on the own vehicle
  std::uint64_t points_ = 0, own_ = 0, coloured_ = 0, unmatched_ = 0, misplaced_ = 0, at_the_end_ = 0;
};

}  // namespace hueline::score
