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
           "stamped minus true middle of the exposure, root mean square over stamped exposures", Better::Lower, 0, 0.2,
           0.10, false},
    Metric{"exposure_time_p99_us", "us",
           "stamped minus true middle of the exposure, 99th percentile of the absolute value", Better::Lower, 0, 0.5,
           0.15, false},
    Metric{"exposure_time_coverage_95", "1",
           "share of stamped exposures whose error is within 1.96 of its own stated sigma", Better::Target, 0.95, 0.06,
           0, false},
    Metric{"exposure_time_coverage_1s", "1",
           "share of stamped exposures whose error is within 1 stated sigma (0.683 if the sigma is true)",
           Better::Informative, 0.683, 0, 0, false},
    Metric{"exposure_time_coverage_2s", "1", "share of stamped exposures whose error is within 2 stated sigmas (0.954)",
           Better::Informative, 0.954, 0, 0, false},
    Metric{"exposure_time_coverage_3s", "1", "share of stamped exposures whose error is within 3 stated sigmas (0.997)",
           Better::Informative, 0.997, 0, 0, false},
    Metric{"exposures_stamped_share", "1", "share of the camera's exposures that were stamped", Better::Higher, 0,
           0.005, 0, false},
    Metric{"pose_position_rms_m", "m",
           "distance of the stated place of the camera head at the stamped middle from its true place at the true "
           "middle, root mean square over stamped exposures",
           Better::Lower, 0, 0.0005, 0.05, false},
    Metric{"pose_attitude_rms_deg", "deg",
           "angle between the stated and the true attitude of the head, root mean square over stamped exposures",
           Better::Lower, 0, 0.0005, 0.05, false},
    Metric{"reprojection_rms_px", "px",
           "angle between the pixel that coloured a point and the pixel where the true point is, in pixels of an 8000 "
           "x 4000 panorama, root mean square over coloured points",
           Better::Lower, 0, 0.005, 0.03, false},
    Metric{"reprojection_p95_px", "px", "reprojection error, 95th percentile over coloured points", Better::Lower, 0,
           0.005, 0.04, false},
    Metric{"reprojection_near_rms_px", "px", "reprojection error, root mean square over points 2 to 5 m from the head",
           Better::Lower, 0, 0.01, 0.04, false},
    Metric{"reprojection_seam_rms_px", "px",
           "reprojection error, root mean square over points that a second lens sees nearly as well (its axis is less "
           "than 4 deg farther away)",
           Better::Lower, 0, 0.01, 0.04, false},
    Metric{"place_rms_m", "m",
           "distance of a point from scanner place + true beam x range on the wire, root mean square over points that "
           "are not misplaced",
           Better::Lower, 0, 0.0005, 0.05, false},
    Metric{"misplaced_share", "1",
           "share of points without a true firing at their time, or more than 0.5 m from its place: they were stamped "
           "or posed wrongly",
           Better::Lower, 0, 0.0005, 0.05, false},
    Metric{"placed_share", "1", "points as a share of all true returns; the own vehicle is left out, here and below",
           Better::Higher, 0, 0.001, 0, false},
    Metric{"coloured_share", "1", "coloured points as a share of all true returns", Better::Higher, 0, 0.002, 0, false},
    Metric{"coloured_share_bound", "1",
           "what a perfect test of visibility would reach: share of sampled true returns that a lens truly saw in one "
           "of the exposures that the colouring may use",
           Better::Informative, 0, 0, 0, false},
    Metric{"visible_coloured_share", "1",
           "share that was coloured of those sampled true returns that a lens truly saw in one of the nine exposures "
           "nearest in time",
           Better::Higher, 0, 0.003, 0, false},
    Metric{"visible_coloured_share_bound", "1",
           "what a perfect test of visibility would reach: of the same returns, the share that a lens truly saw in one "
           "of the exposures that the colouring may use",
           Better::Informative, 0, 0, 0, false},
    Metric{"wrong_surface_share", "1",
           "share of sampled coloured points where the lens that coloured them met something else, more than 5 cm in "
           "front of them or behind them",
           Better::Lower, 0, 0.001, 0.05, false},
    Metric{"wrong_surface_share_bound", "1",
           "what even a perfect choice has if it colours every point that is in an image: of the sampled true returns "
           "whose place is in the image of an exposure that the colouring may use and not behind the own vehicle, the "
           "share that none truly saw",
           Better::Informative, 0, 0, 0, false},
    Metric{"wrong_surface_edge_share", "1",
           "share of wrong surfaces among points within two lens pixels of an outline in the true image", Better::Lower,
           0, 0.004, 0.05, false},
    Metric{"colour_de00_median", "dE00",
           "CIEDE2000 difference between a point's colour and what a perfect camera at the scanner would see, median "
           "over coloured points",
           Better::Lower, 0, 0.05, 0.03, false},
    Metric{"colour_de00_p95", "dE00", "colour difference, 95th percentile over coloured points", Better::Lower, 0, 0.2,
           0.03, false},
    Metric{"colour_de00_over20_share", "1", "share of coloured points whose colour difference is above 20",
           Better::Lower, 0, 0.0008, 0.05, false},
    Metric{"colour_de00_edge_median", "dE00",
           "colour difference, median over sampled points within two lens pixels of an outline or texture edge",
           Better::Lower, 0, 0.2, 0.05, false},
    Metric{"colour_de00_smooth_median", "dE00", "colour difference, median over the other sampled points",
           Better::Lower, 0, 0.05, 0.03, false},
    Metric{"edge_smooth_ratio", "1", "median colour difference near edges divided by that elsewhere", Better::Lower, 0,
           0.1, 0.05, false},
    Metric{"exposure_seam_de00", "dE00",
           "step of colour across exposure seams, median over seams: CIEDE2000 of the median difference between the "
           "colour errors of two exposures in 0.25 m cubes of a surface that one lens coloured in both",
           Better::Lower, 0, 0.05, 0.05, false},
    Metric{"lens_seam_de00", "dE00",
           "step of colour across seams between two lenses of one exposure, median over seams", Better::Lower, 0, 0.08,
           0.05, false},
    Metric{
        "flicker_de00_p90", "dE00",
        "colour difference of two neighbouring points of one still surface (0.1 m cubes) that have their colours from "
        "different exposures or lenses, minus the difference of their true colours; 90th percentile of pairs",
        Better::Lower, 0, 0.1, 0.03, false},
    Metric{"frame_swing_L", "L*",
           "root mean square of the change of the mean lightness error from one exposure to the next", Better::Lower, 0,
           0.05, 0.10, false},
    Metric{"held_out_de00_median", "dE00",
           "difference between images that were left out of a second colouring and what its cloud predicts for them, "
           "median over pixels; needs no truth",
           Better::Lower, 0, 0.05, 0.03, false},
    Metric{"held_out_within10_share", "1", "share of those pixels whose difference is 10 or less", Better::Higher, 0,
           0.004, 0, false},
    Metric{"depth_edge_missed_share", "1",
           "share of the laser's depth edges in the images that have no image edge within 3 px; needs no truth",
           Better::Lower, 0, 0.015, 0.05, false},
    Metric{"depth_edge_missed_share_by_chance", "1",
           "the same share for places 12 px beside the depth edges: what a quite wrong mounting or time would have",
           Better::Informative, 0, 0, 0, false},
    Metric{"drift_noticed_s", "s",
           "time from a drift of the head (`camera.drift`) to the fault Implausible of the camera", Better::Lower, 0, 1,
           0.1, false},
    Metric{"drift_false_alarms", "1", "faults Implausible of the camera while nothing had drifted", Better::Lower, 0, 0,
           0, false},
    Metric{"hole_coloured_share", "1",
           "share that was coloured of those sampled true returns that the exposure nearest in time cannot see, below "
           "all lenses or behind the own vehicle",
           Better::Higher, 0, 0.005, 0, false},
    Metric{"hole_coloured_share_bound", "1",
           "what a perfect test of visibility would reach: of the same returns, the share that a lens truly saw in one "
           "of the exposures that the colouring may use",
           Better::Informative, 0, 0, 0, false},
    Metric{"hole_visible_coloured_share", "1", "share that was coloured of those of them that a lens truly saw there",
           Better::Higher, 0, 0.005, 0, false},
    Metric{"hole_de00_ratio", "1",
           "median colour difference of sampled points in the hole divided by that of sampled points outside it",
           Better::Lower, 0, 0.1, 0.05, false},
    Metric{
        "moving_contaminated_share", "1",
        "share of sampled coloured points with a wrong surface where the point, or what the lens met, moves by itself",
        Better::Lower, 0, 0.0008, 0.05, false},
    Metric{"static_accuracy", "1",
           "share of the points on things that stand still that are not told moving (`moving` below 128)",
           Better::Higher, 0, 0.001, 0, false},
    Metric{"dynamic_accuracy", "1",
           "share of the points on things that move by themselves that are told moving (`moving` 128 or more)",
           Better::Higher, 0, 0.005, 0, false},
    Metric{"associated_accuracy", "1", "geometric mean of static_accuracy and dynamic_accuracy", Better::Higher, 0,
           0.005, 0, false},
    Metric{
        "unexplained_bytes", "bytes",
        "bytes that the devices sent and that were neither decoded, ignored by name, malformed by name nor told lost",
        Better::Lower, 0, 0, 0, false},
    Metric{"overtold_units", "units",
           "units that were told lost but are not missing: a loss was told twice, or there was none", Better::Lower, 0,
           0, 0, false},
    Metric{"recorded_share", "1",
           "packets read back from the recording after a fault of the computer, as a share of those that came while "
           "the program ran",
           Better::Higher, 0, 0.002, 0, false},
    Metric{"recovered_share", "1", "packets read back from the recording, as a share of those that it promises to hold",
           Better::Higher, 0, 0, 0, false},
    Metric{"recording_end_lost_s", "s", "time from the last packet that was read back until the program ended",
           Better::Lower, 0, 0.1, 0.05, false},
    Metric{"lost_untold_packets", "packets",
           "packets that were changed, or lost without a fault or an end that tells of them", Better::Lower, 0, 0, 0,
           false},
    Metric{"replay_same_cloud", "1",
           "1 if the replay of the recording gave the cloud of the same packets before they were written",
           Better::Higher, 0, 0, 0, false},
    Metric{"provisional_latency_p99_ms", "ms",
           "time from the last needed input (firing, arrival of the image, lock of clock and camera) to the packet on "
           "which a "
           "point got its provisional colour, in drive time; 99th percentile",
           Better::Lower, 0, 5, 0.02, false},
    Metric{"latency_p50_ms", "ms",
           "time from the last needed input (firing, arrival of the image, lock of clock and camera) to the packet on "
           "which "
           "the coloured point came out, in drive time; median",
           Better::Lower, 0, 5, 0.02, false},
    Metric{"latency_p99_ms", "ms", "the same time, 99th percentile", Better::Lower, 0, 5, 0.02, false},
    Metric{"realtime_factor", "1", "duration of the drive divided by the pipeline's time for it", Better::Informative,
           0, 0, 0, true},
    Metric{"points_per_second", "1/s", "points divided by the pipeline's time", Better::Informative, 0, 0, 0, true},
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
