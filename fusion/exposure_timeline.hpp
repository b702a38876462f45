#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "core/stamped.hpp"
#include "fusion/pixel_sampler.hpp"
#include "fusion/trajectory.hpp"

namespace hueline::fusion {

/// Brightness of one moment over that of another, each channel.
struct ColourGain {
  std::uint64_t neighbour = 0;  ///< Moment::serial
  std::array<float, 3> gain{1.0f, 1.0f, 1.0f};
};

/// One moment of the head: the images of all its cameras that were exposed together, and where the head was.
struct Moment {
  struct Picture {
    std::uint32_t exposure = 0;  ///< Exposure::index
    Image image;                 ///< keeps the pixels alive
    RawView view;
    std::uint64_t content = 0;  ///< content_of(view)
  };
  /// Of the head at the exposures' middle.
  struct Viewpoint {
    std::array<float, 9> R_head_enu;  ///< row by row
    Eigen::Vector3d centre_enu;
  };

  std::uint64_t serial = 0;  ///< in order of arrival
  GpsTime time{};            ///< middle of the exposure
  nanoseconds sigma{0};
  SyncState state = SyncState::Unlocked;
  ExposureTiming timing = ExposureTiming::Unmatched;
  std::vector<Picture> pictures;        ///< one a camera; empty view: that camera's image is missing
  std::vector<std::uint8_t> has_image;  ///< one a camera, 1 if there
  std::uint32_t blind = 0;              ///< bits of the lenses whose part of a picture was lost
  bool is_pose_final = false;
  std::optional<Viewpoint> viewpoint;
  std::optional<std::vector<ColourGain>> gains;  ///< of its neighbours, once measured

  bool is_whole() const;
  const ColourGain* gain_of(std::uint64_t neighbour) const;
};

/// Moments in order of time, and the rule which of them owns an instant. Thread-bound; const functions may run in many
/// threads.
class ExposureTimeline {
 public:
  struct Rule {
    nanoseconds interval{0};           ///< T; 0: the median of the measured ones
    nanoseconds interval_at_start{0};  ///< T until two moments have come
    nanoseconds window_slack{0};
    nanoseconds together{0};  ///< exposures of different cameras closer than this are one moment
  };
  ExposureTimeline(const Rule& rule, std::size_t cameras) : rule_(rule), cameras_(cameras) {}

  /// `camera` is the camera's place in the rig's list. `view` has data. `blind`: bits of its lenses that are lost.
  void add(const Exposure& exposure, std::size_t camera, const RawView& view, std::uint32_t blind = 0);
  /// T as of now.
  nanoseconds interval() const { return interval_; }
  /// The moment S with t in [S - T/2, S + T/2); of two the nearer, of two equally near the earlier. -1: none.
  int owner_of(GpsTime t) const { return nearest(t, interval_ / 2 + rule_.window_slack); }
  /// The nearest moment with t in [S - reach, S + reach); -1: none.
  int nearest(GpsTime t, nanoseconds reach) const;
  /// Moments within `reach` of t, at most `per_side` before and after it and without `except`, the nearest first.
  void neighbours_of(GpsTime t, nanoseconds reach, int per_side, int except, std::vector<int>& found) const;
  /// The whole moment that is the n-th after t, n from 1; nullptr: not come yet.
  const Moment* nth_whole_after(GpsTime t, int n) const;

  std::size_t size() const { return moments_.size(); }
  Moment& at(int index) { return moments_[static_cast<std::size_t>(index)]; }
  const Moment& at(int index) const { return moments_[static_cast<std::size_t>(index)]; }
  /// Drops moments before `time`; returns how many.
  std::size_t forget_before(GpsTime time);
  void drop_oldest() { moments_.pop_front(); }

 private:
  std::size_t first_at_or_after(GpsTime t) const;
  void measure_interval(GpsTime newest);

  Rule rule_;
  std::size_t cameras_;
  std::deque<Moment> moments_;
  std::uint64_t next_serial_ = 0;
  std::optional<GpsTime> last_time_;
  std::deque<nanoseconds> intervals_;
  nanoseconds interval_{rule_.interval.count() > 0 ? rule_.interval : rule_.interval_at_start};
};

}  // namespace hueline::fusion
