#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/decoder.hpp"
#include "core/keys.hpp"
#include "drivers/ros/ros_cloud.hpp"
#include "drivers/ros/ros_cloud_time.hpp"

namespace hueline::drivers {

/// Decodes point clouds that a driver of ROS has made (ros_cloud.hpp). A packet is a message as it lies in a recording.
///
/// The points of a message become LaserBatches of 1 ms each, in the order of their times; without times, one batch at
/// header.stamp. A packet is expected to be received when its last point was measured, on the clock of header.stamp;
/// each batch is taken as received when its own last point was. LaserBatch::time is UTC by the clock of header.stamp,
/// or a counter of its own if that clock is not set (before 2000).
///
/// Frame: Scanner has the axes of header.frame_id, by REP 103 x forward, y left, z up. azimuth counts from x to y.
/// channel is the field ring, channel or line. Points that are not finite or (0, 0, 0) are no returns; they are counted
/// as kReturnless, and those that the rig's range leaves out as kOutOfRange.
///
/// Faults:
/// - Malformed: a message that contradicts itself, or whose times cannot be (not used).
/// - NoTime: the points have no times, though the rig does not say that header.stamp is enough (not used); header.stamp
///   is 0, or the times that were recognised do not fit to how often the messages come (used).
/// - Late: header.stamp went back. It is used.
///
/// Thread safety: none; one thread calls all functions.
class RosCloudDecoder final : public Decoder {
 public:
  static constexpr const char* kReturnless = "points without a return";
  static constexpr const char* kOutOfRange = "points nearer than min_range_m or beyond max_range_m";

  using Message = RosCloudKind;
  struct Config {
    Message message = Message::PointCloud2;
    RosEncoding encoding = RosEncoding::Cdr;
    /// header.stamp is the time of all points, within stamp_sigma: the driver has moved them to that moment, or they
    /// have no times.
    bool stamp_is_enough = false;
    RosTimeRule times;  ///< what is not given is recognised from the first message that has returns
    /// header.stamp is on a clock that follows UTC; otherwise it is the computer's, and the POS says how far it is off.
    bool is_utc = false;
    nanoseconds stamp_sigma{std::chrono::milliseconds(2)};  ///< one sigma of header.stamp on its clock
    std::string intensity_field;                            ///< empty: intensity, i, reflectivity
    double intensity_full = 255;                            ///< becomes LaserReturn::reflectivity 255
    double min_range_m = 0.1;
    std::optional<double> max_range_m;

    void visit(Keys& keys);
    KeyError validate() const;
  };
  /// Returns the Config for messages of `type` (carries_cloud()), of which `first` is one. Its times are recognised. If
  /// there are none, header.stamp has to be enough, with half of `period`, the time between two messages, as sigma.
  /// `intensity_full` is 1, 255, 4095 or 65535, or what is above all values.
  static Config suited(std::string_view type, RosEncoding encoding, const RosCloud& first,
                       nanoseconds period = std::chrono::milliseconds(100));

  explicit RosCloudDecoder(Config config) : config_(std::move(config)) {}

  void decode(const Packet& packet, std::vector<Measurement>& out) override;
  void reset() override;
  const DecodeCounts& counts() const override { return counts_; }

  /// Returns how far after header.stamp a message is complete: the time of its last point, or 1 ms. `rule` is complete.
  static nanoseconds end_of(const RosCloud& cloud, const RosTimeRule& rule);

 private:
  void tell(const Packet& packet, FaultKind kind, std::string what, std::vector<Measurement>& out) const;
  void refuse(const Packet& packet, const std::string& what, std::vector<Measurement>& out);
  void follow_stamp(const Packet& packet, const RosCloud& cloud, std::vector<Measurement>& out);
  void judge_span(const Packet& packet, nanoseconds span, std::vector<Measurement>& out);
  void give(const Packet& packet, const RosCloud& cloud, const std::vector<RosPoint>& points,
            std::vector<Measurement>& out);

  Config config_;
  DecodeCounts counts_;
  std::optional<RosTimeRule> rule_;
  std::optional<UnixTime> last_stamp_;
  std::optional<nanoseconds> period_;  // the shortest time between two messages
  bool is_zero_told_ = false, is_span_told_ = false;
};

}  // namespace hueline::drivers
