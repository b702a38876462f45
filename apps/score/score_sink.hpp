#pragma once

#include <chrono>
#include <map>
#include <vector>

#include "apps/score/cloud_print.hpp"
#include "config/rig.hpp"
#include "runtime/products.hpp"
#include "score/scorer.hpp"

namespace hueline::apps {

/// Hands everything that leaves the pipeline to a Scorer, in the simulator's terms. Thread-bound (the pipeline's).
class ScoreSink : public runtime::ProductSink {
 public:
  /// `scorer` must outlive it.
  ScoreSink(score::Scorer& scorer, const config::Rig& rig, GpsTime drive_begin);

  /// The packet of that sequence holds the picture of that true exposure. Before the packet is processed.
  void set_image(std::uint64_t packet_sequence, std::uint32_t number) { image_numbers_[packet_sequence] = number; }

  /// The packet that is about to be processed came then; what comes out next, comes out on it. Empty: the stream is
  /// over.
  void set_now(std::optional<HostTime> received) { now_ = received; }

  void on_cloud(const CloudBlock& block, const fusion::Trajectory&) override;
  void on_exposure(const Exposure& exposure) override;
  void on_settled_exposure(const Exposure& exposure, const fusion::Trajectory& trajectory) override;
  void on_fault(const Fault& fault) override;

  /// After the pipeline's flush: gives the exposures with their poses.
  void finish();

  const CloudPrint& cloud() const { return cloud_; }
  const std::map<SensorId, std::uint64_t>& told_lost() const { return told_lost_; }
  /// Spent in here, to be taken off the pipeline's time.
  std::chrono::nanoseconds spent() const { return spent_; }

 private:
  struct Stamped {
    std::uint32_t number;
    GpsTime mid;
    nanoseconds sigma;
    HostTime arrived;
    std::optional<sim::Pose> T_ecef_head{};  // once settled, if there is one
  };
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
  CloudPrint cloud_;
  std::chrono::nanoseconds spent_{0};
};

}  // namespace hueline::apps
