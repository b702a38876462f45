#pragma once

#include <map>
#include <span>
#include <vector>

#include "apps/score/cloud_print.hpp"
#include "config/rig.hpp"
#include "runtime/products.hpp"
#include "score/scorer.hpp"

namespace hueline::apps {

/// Passes all products of the pipeline to a Scorer, in the simulator's types. Thread safety: none; only the pipeline's
/// thread calls it.
class ScoreSink : public runtime::ProductSink {
 public:
  /// `scorer` must outlive it.
  ScoreSink(score::Scorer& scorer, const config::Rig& rig, GpsTime drive_begin);

  /// Says that packet `packet_sequence` has the image of true exposure `number`. Call this before the packet is
  /// processed.
  void set_image(std::uint64_t packet_sequence, std::uint32_t number) { image_numbers_[packet_sequence] = number; }

  /// Sets the arrival of the packet that is processed next. The products that follow are attributed to it. Empty: the
  /// stream has ended.
  void set_now(std::optional<HostTime> received) { now_ = received; }

  void on_cloud(const CloudBlock& block, const fusion::Trajectory&) override;
  void on_provisional_cloud(const CloudBlock& block, const fusion::Trajectory&) override;
  bool wants_provisional_cloud() const override { return true; }
  void on_sights(const CloudBlock& block, std::span<const fusion::JudgedSight> sights) override;
  bool wants_sights() const override { return scorer_.keeps_sights(); }
  void on_laser(const StampedLaserBatch&) override;
  void on_exposure(const Exposure& exposure) override;
  void on_settled_exposure(const Exposure& exposure, const fusion::Trajectory& trajectory) override;
  void on_fault(const Fault& fault) override;

  /// Passes the exposures with their poses to the scorer. Call this after the pipeline's flush.
  void finish();

  const CloudPrint& cloud() const { return cloud_; }
  /// Returns for each sensor how many units the Lost faults report.
  const std::map<SensorId, std::uint64_t>& told_lost() const { return told_lost_; }

 private:
  struct Stamped {
    std::uint32_t number;
    GpsTime mid;
    nanoseconds sigma;
    HostTime arrived;
    bool has_image;
    std::optional<sim::Pose> T_ecef_head{};  // set once the exposure is settled, if it has a pose
  };
  std::optional<double> latency_ms(const ColouredPoint& point) const;
  void take(const ColouredPoint& point, const Transform<Ecef, Enu>& T_ecef_enu);

  score::Scorer& scorer_;
  const bool is_panorama_;
  const Transform<Body, CameraHead> T_body_head_;
  const GpsTime drive_begin_;
  std::map<std::uint64_t, std::uint32_t> image_numbers_;  // by packet sequence
  const SensorId pos_;
  std::map<std::uint32_t, Stamped> stamped_;  // by Exposure::index
  std::map<SensorId, std::uint64_t> told_lost_;
  std::optional<HostTime> now_;
  std::optional<HostTime> first_laser_, first_exposure_;  // arrival of the packets since which they have times
  CloudPrint cloud_;
};

}  // namespace hueline::apps
