#include "score/metric_table.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace hueline::score {
namespace {

// Figures of one version repeat to the last digit. The noise is what a harmless change (another rounding, another order
// of equally good choices) may move: an exposure or two of a short drive for times and poses, the sampling error of
// some ten thousand rays for shares, a twentieth for colour differences.
constexpr std::array kMetrics = {
    Metric{"exposure_time_rms_us", "us",
           "stamped against true middle of the exposure, root mean square over stamped exposures", Better::Lower, 0,
           0.2, 0.10, false},
    Metric{"exposure_time_p99_us", "us", "the same, 99th percentile of the absolute error", Better::Lower, 0, 0.5, 0.15,
           false},
    Metric{"exposure_time_coverage_95", "1",
           "share of stamped exposures whose error is inside 1.96 of its own stated sigma", Better::Target, 0.95, 0.06,
           0, false},
    Metric{"exposure_time_coverage_1s", "1", "the same inside 1 sigma (0.683 if the sigma is true)",
           Better::Informative, 0.683, 0, 0, false},
    Metric{"exposure_time_coverage_2s", "1", "the same inside 2 sigma (0.954)", Better::Informative, 0.954, 0, 0,
           false},
    Metric{"exposure_time_coverage_3s", "1", "the same inside 3 sigma (0.997)", Better::Informative, 0.997, 0, 0,
           false},
    Metric{"exposures_stamped_share", "1", "stamped exposures of all that the camera made", Better::Higher, 0, 0.005, 0,
           false},
    Metric{"pose_position_rms_m", "m",
           "place of the camera head at the stamped exposure against its true place at the true middle, 3D, over "
           "stamped exposures",
           Better::Lower, 0, 0.0005, 0.05, false},
    Metric{"pose_attitude_rms_deg", "deg", "angle between stated and true attitude of the head, likewise",
           Better::Lower, 0, 0.0005, 0.05, false},
    Metric{"reprojection_rms_px", "px",
           "angle between the pixel that coloured a point and the pixel where the true point is, in pixels of an 8000 "
           "x 4000 panorama, over coloured points",
           Better::Lower, 0, 0.005, 0.03, false},
    Metric{"reprojection_p95_px", "px", "the same, 95th percentile", Better::Lower, 0, 0.005, 0.04, false},
    Metric{"reprojection_near_rms_px", "px", "the same, root mean square over points 2 to 5 m from the head",
           Better::Lower, 0, 0.01, 0.04, false},
    Metric{"reprojection_seam_rms_px", "px",
           "the same, over points that a second lens sees nearly as well (axes within 4 deg of equally near)",
           Better::Lower, 0, 0.01, 0.04, false},
    Metric{"place_rms_m", "m",
           "place of a point against scanner place + true beam x range on the wire, 3D, over points that are not "
           "misplaced",
           Better::Lower, 0, 0.0005, 0.05, false},
    Metric{
        "misplaced_share", "1",
        "points given without a true firing at their time, or more than 0.5 m from its place: stamped or posed wrongly",
        Better::Lower, 0, 0.0005, 0.05, false},
    Metric{"placed_share", "1", "points given out of all true returns", Better::Higher, 0, 0.001, 0, false},
    Metric{"coloured_share", "1", "coloured points of all true returns; the own vehicle left out, here and below",
           Better::Higher, 0, 0.002, 0, false},
    Metric{"visible_coloured_share", "1",
           "coloured of those sampled true returns that a lens truly saw in one of the nine exposures nearest in time",
           Better::Higher, 0, 0.003, 0, false},
    Metric{"wrong_surface_share", "1",
           "sampled coloured points towards which the lens that coloured them met something else, more than 5 cm "
           "before or behind",
           Better::Lower, 0, 0.001, 0.05, false},
    Metric{"wrong_surface_edge_share", "1",
           "the same, of points within two lens pixels of an outline in the true image", Better::Lower, 0, 0.004, 0.05,
           false},
    Metric{"colour_de00_median", "dE00",
           "CIEDE2000 between a point's colour and what a perfect camera at the scanner would see, median over "
           "coloured points",
           Better::Lower, 0, 0.05, 0.03, false},
    Metric{"colour_de00_p95", "dE00", "the same, 95th percentile", Better::Lower, 0, 0.2, 0.03, false},
    Metric{"colour_de00_over20_share", "1", "the same, share above 20", Better::Lower, 0, 0.0008, 0.05, false},
    Metric{"colour_de00_edge_median", "dE00",
           "the same, sampled points within two lens pixels of an outline or texture edge", Better::Lower, 0, 0.2, 0.05,
           false},
    Metric{"colour_de00_smooth_median", "dE00", "the same, the other sampled points", Better::Lower, 0, 0.05, 0.03,
           false},
    Metric{"edge_smooth_ratio", "1", "median near edges over median elsewhere", Better::Lower, 0, 0.1, 0.05, false},
    Metric{"exposure_seam_de00", "dE00",
           "step across exposure seams, median over seams: CIEDE2000 of the median difference between two exposures' "
           "colour errors in 0.25 m cubes of a surface that one lens coloured in both",
           Better::Lower, 0, 0.05, 0.05, false},
    Metric{"lens_seam_de00", "dE00", "likewise between two lenses of one exposure", Better::Lower, 0, 0.08, 0.05,
           false},
    Metric{"frame_swing_L", "L*",
           "root mean square of the change of the mean lightness error from one exposure to the next", Better::Lower, 0,
           0.05, 0.10, false},
    Metric{"hole_coloured_share", "1",
           "coloured of the sampled true returns that the exposure nearest in time cannot see: below all lenses, or "
           "behind the own vehicle",
           Better::Higher, 0, 0.005, 0, false},
    Metric{"hole_de00_ratio", "1", "their median CIEDE2000 over that of the sampled points outside the hole",
           Better::Lower, 0, 0.1, 0.05, false},
    Metric{"moving_contaminated_share", "1",
           "sampled coloured points of a wrong surface where the point or what the lens met moves by itself",
           Better::Lower, 0, 0.0008, 0.05, false},
    Metric{"unexplained_bytes", "bytes",
           "sent by the devices but neither decoded, ignored by name, malformed by name nor told lost", Better::Lower,
           0, 0, 0, false},
    Metric{"overtold_units", "units", "told lost, but not missing: one loss told twice, or none", Better::Lower, 0, 0,
           0, false},
    Metric{
        "recorded_share", "1",
        "packets read back from the recording after a fault of the computer, of those that came while the program ran",
        Better::Higher, 0, 0.002, 0, false},
    Metric{"recovered_share", "1", "the same, of the packets that the recording promises to hold", Better::Higher, 0, 0,
           0, false},
    Metric{"recording_end_lost_s", "s", "from the last packet read back until the program ended", Better::Lower, 0, 0.1,
           0.05, false},
    Metric{"lost_untold_packets", "packets", "lost without a fault or an end that tells of them, or changed",
           Better::Lower, 0, 0, 0, false},
    Metric{"replay_same_cloud", "1",
           "1: the recording's replay gave the cloud of the same packets before they were written", Better::Higher, 0,
           0, 0, false},
    Metric{"latency_p50_ms", "ms",
           "from the last needed input (firing, or arrival of the image) to the packet on which the coloured point "
           "came out, in drive time; median",
           Better::Lower, 0, 5, 0.02, false},
    Metric{"latency_p99_ms", "ms", "the same, 99th percentile", Better::Lower, 0, 5, 0.02, false},
    Metric{"realtime_factor", "1", "duration of the drive over the pipeline's time for it", Better::Informative, 0, 0,
           0, true},
    Metric{"points_per_second", "1/s", "points over the pipeline's time", Better::Informative, 0, 0, 0, true},
};

}  // namespace

const char* name(Better better) {
  switch (better) {
    case Better::Lower:
      return "lower";
    case Better::Higher:
      return "higher";
    case Better::Target:
      return "nearer to its target";
    case Better::Informative:
      return "for information";
  }
  return "?";
}

std::span<const Metric> metrics() { return kMetrics; }

const Metric* find_metric(const std::string& name) {
  const auto found = std::find_if(kMetrics.begin(), kMetrics.end(), [&](const Metric& m) { return name == m.name; });
  return found == kMetrics.end() ? nullptr : &*found;
}

double noise_of(const Metric& metric, double old_value) {
  return std::max(metric.noise, metric.relative_noise * std::abs(old_value));
}

}  // namespace hueline::score
