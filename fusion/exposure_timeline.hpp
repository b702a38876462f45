#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "core/stamped.hpp"
#include "fusion/depth_map.hpp"
#include "fusion/head_projector.hpp"
#include "fusion/met_things.hpp"
#include "fusion/pixel_sampler.hpp"
#include "fusion/radiometry.hpp"
#include "fusion/trajectory.hpp"

namespace hueline::fusion {

/// One moment of the head: the images of all its cameras that were exposed together, and the head's pose.
struct Moment {
  struct Picture {
    std::uint32_t exposure = 0;  ///< Exposure::index
    Image image;                 ///< keeps the pixels in memory
    RawView view;
    std::uint64_t content = 0;  ///< content_of(view)
  };
  /// Pose of the head at the middle of the exposures.
  struct Viewpoint {
    std::array<float, 9> R_head_enu;  ///< row by row
    Eigen::Vector3d centre_enu;
    Leap leapt;                       ///< Pose::leapt
    HeadMotion motion;                ///< of a head with a rolling shutter, or whose lenses are not exposed at one time
    std::span<const LensEye> eyes{};  ///< HeadProjector::eyes()
    /// Returns the head as seen from places relative to `origin`.
    RelativeHead relative_to(const Eigen::Vector3d& origin) const {
      const Eigen::Vector3f offset = (origin - centre_enu).cast<float>();
      return {R_head_enu, {offset.x(), offset.y(), offset.z()}, eyes};
    }
    /// Returns a place in the head's frame. The difference is calculated in double precision, because ENU coordinates
    /// of a long drive do not fit a float.
    std::array<float, 3> in_head(double east, double north, double up) const {
      const auto dx = static_cast<float>(east - centre_enu.x()), dy = static_cast<float>(north - centre_enu.y()),
                 dz = static_cast<float>(up - centre_enu.z());
      const auto& R = R_head_enu;
      return {R[0] * dx + R[1] * dy + R[2] * dz, R[3] * dx + R[4] * dy + R[5] * dz, R[6] * dx + R[7] * dy + R[8] * dz};
    }
  };

  std::uint64_t serial = 0;  ///< in order of arrival
  GpsTime time{};            ///< middle of the exposure
  nanoseconds sigma{0};
  SyncState state = SyncState::Unlocked;
  ExposureTiming timing = ExposureTiming::Unmatched;
  std::vector<Picture> pictures;        ///< one for each camera; an empty view means that the camera's image is missing
  std::vector<std::uint8_t> has_image;  ///< one for each camera; 1 if its image is there
  std::uint32_t blind = 0;              ///< one bit for each lens; set if its part of an image was lost
  std::array<float, kMostLenses> lateness{};  ///< HeadMotion::lateness, against `time`
  std::vector<ReportedExposure> reported;     ///< of each lens; empty: the cameras report nothing
  bool is_pose_final = false;
  std::optional<Viewpoint> viewpoint;
  /// What stands before the head, and what was before it at the moment itself, moving things among it. Empty until
  /// points around the moment are coloured.
  std::optional<DepthMap> standing, glance;
  MetThings met;  ///< what moved around the moment; complete when `glance` is
  /// The same as `standing`, from the points that were there when the moment came. For provisional colours.
  std::optional<DepthMap> early;
  std::uint64_t next_turn = 0, next_glance = 0;  ///< numbers of the first turn and batch that they do not have yet
  std::optional<GpsTime> newest_turn;            ///< middle of the newest turn when `standing` was last completed
  bool is_compared = false;                      ///< whether Radiometry knows it
  /// Whether it is one of those that are ExposureTimeline::kApart apart, and therefore serves points far from it in
  /// time.
  bool is_step = false;
  std::optional<HeadGains> gains;  ///< once found

  bool is_whole() const;
  /// Whether the lenses were exposed at different times.
  bool is_spread() const;
};

/// The moments in order of time, and the rule that decides which of them owns an instant (docs/methods, equation 7).
/// Thread safety: one thread makes the calls that change it; while it makes none, const functions may be called by many
/// threads.
class ExposureTimeline {
 public:
  struct Rule {
    nanoseconds interval{0};           ///< T; 0: the median of the measured intervals
    nanoseconds interval_at_start{0};  ///< T until two moments have come
    nanoseconds window_slack{0};
    /// Exposures of different cameras are one moment if they are closer together than this.
    nanoseconds together{0};
  };
  /// Time between moments that serve points far from them, unless the camera is slower. In this time a vehicle moves by
  /// some metres, so that they see past different things.
  static constexpr nanoseconds kApart{400'000'000};

  ExposureTimeline(const Rule& rule, std::size_t cameras) : rule_(rule), cameras_(cameras) {}

  /// Adds an exposure and returns its moment. `camera` is the camera's index in the rig's list, and `view` has data.
  /// `blind` has one bit for each lens, set if the lens's part of the image is lost.
  Moment& add(const Exposure& exposure, std::size_t camera, const RawView& view, std::uint32_t blind = 0);
  /// Returns the current T.
  nanoseconds interval() const { return interval_; }
  /// Returns the index of the moment S with t in [S - T/2, S + T/2), widened by the slack on both sides; of two the
  /// nearer, of two equally near the earlier. -1 if there is none.
  int owner_of(GpsTime t) const { return nearest(t, interval_ / 2 + rule_.window_slack); }
  /// Returns the index of the nearest moment with t in [S - reach, S + reach); -1 if there is none.
  int nearest(GpsTime t, nanoseconds reach) const;
  /// Finds the moments within `reach` of t, at most `per_side` before and after it and without `except`, the nearest
  /// first. Those beyond the nearest `nearest` of a side are steps, so that a fast camera's moments reach as far as
  /// those of a slow one.
  void neighbours_of(GpsTime t, nanoseconds reach, int per_side, int nearest, int except,
                     std::vector<int>& found) const;
  /// Returns the time of the newest moment that has come; empty before the first.
  std::optional<GpsTime> newest() const { return last_time_; }
  /// Returns whether a moment after t that is whole has come.
  bool has_whole_after(GpsTime t) const;

  std::size_t size() const { return moments_.size(); }
  Moment& at(int index) { return moments_[static_cast<std::size_t>(index)]; }
  const Moment& at(int index) const { return moments_[static_cast<std::size_t>(index)]; }
  /// Returns about the time between two steps.
  nanoseconds step() const { return std::max(interval_, kApart); }
  /// Removes the moments before `time`.
  void forget_before(GpsTime time);
  /// Removes the moments before `time` that are no steps.
  void keep_steps_before(GpsTime time);
  void drop_oldest() { moments_.pop_front(); }

 private:
  std::size_t first_at_or_after(GpsTime t) const;
  void measure_interval(GpsTime newest);

  Rule rule_;
  std::size_t cameras_;
  std::deque<Moment> moments_;
  std::uint64_t next_serial_ = 0;
  std::optional<GpsTime> last_time_, last_step_;
  std::deque<nanoseconds> intervals_;
  nanoseconds interval_{rule_.interval.count() > 0 ? rule_.interval : rule_.interval_at_start};
};

}  // namespace hueline::fusion
