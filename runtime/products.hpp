#pragma once

#include <optional>
#include <string>

#include "core/coloured_point.hpp"
#include "core/measurements.hpp"
#include "core/stamped.hpp"
#include "fusion/trajectory.hpp"

namespace hueline::runtime {

/// What leaves the pipeline, in an order that the journal alone decides. A sink overrides what it wants. Called on the
/// pipeline's thread.
///
/// A trajectory that comes with a product is the pipeline's own and may be asked during the call, for the poses at the
/// times of a cloud's points and from 10 ms before an exposure or a batch to 10 ms after it. Those are settled: no
/// later solution changes them, and one that is missing never comes.
class ProductSink {
 public:
  virtual ~ProductSink() = default;
  /// The local level of the cloud and of all poses is known: once, before the first cloud.
  virtual void on_origin(const Geodetic&) {}
  virtual void on_cloud(const CloudBlock&, const fusion::Trajectory&) {}
  /// An exposure as soon as it has its time, with its image. Its pose may not be settled yet.
  virtual void on_exposure(const Exposure&) {}
  /// The same exposure once its pose is settled, without its image.
  virtual void on_settled_exposure(const Exposure&, const fusion::Trajectory&) {}
  /// A batch as soon as it has its time. Its poses may not be settled yet.
  virtual void on_laser(const StampedLaserBatch&) {}
  /// The same batch once its poses are settled; only for a sink that wants it, because batches are held for it.
  virtual void on_settled_laser(const StampedLaserBatch&, const fusion::Trajectory&) {}
  virtual bool wants_settled_laser() const { return false; }
  virtual void on_solution(const InsSolution&) {}
  /// What a wheel encoder said, with its time.
  virtual void on_wheel(const StampedWheelSpeed&) {}
  virtual void on_fix(const GnssFix&) {}
  /// `time` is empty where the change left, or came before, any relation to GPS time.
  virtual void on_sync_state(std::optional<GpsTime> time, SensorId clock, SyncState state) {
    (void)time, (void)clock, (void)state;
  }
  virtual void on_fault(const Fault&) {}
};

}  // namespace hueline::runtime
