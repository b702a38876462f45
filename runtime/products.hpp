#pragma once

#include <optional>
#include <string>

#include "core/coloured_point.hpp"
#include "core/measurements.hpp"
#include "core/stamped.hpp"

namespace hueline::runtime {

/// What leaves the pipeline, in an order that the journal alone decides. Called on the pipeline's thread.
class ProductSink {
 public:
  virtual ~ProductSink() = default;
  /// The local level of the cloud and of all poses is known: once, before the first cloud.
  virtual void on_origin(const Geodetic& origin) = 0;
  virtual void on_cloud(const CloudBlock& block) = 0;
  virtual void on_exposure(const Exposure& exposure) = 0;
  /// A batch with its time, before it is placed; who needs no more than points leaves it out.
  virtual void on_laser(const StampedLaserBatch&) {}
  virtual void on_solution(const InsSolution& solution) = 0;
  /// What a wheel encoder said, with its time.
  virtual void on_wheel(const StampedWheelSpeed&) {}
  virtual void on_fix(const GnssFix& fix) = 0;
  /// `time` is empty where the change left, or came before, any relation to GPS time.
  virtual void on_sync_state(std::optional<GpsTime> time, SensorId clock, SyncState state) = 0;
  virtual void on_fault(const Fault& fault) = 0;
};

/// For runs that want only some of it.
class NullSink : public ProductSink {
 public:
  void on_origin(const Geodetic&) override {}
  void on_cloud(const CloudBlock&) override {}
  void on_exposure(const Exposure&) override {}
  void on_solution(const InsSolution&) override {}
  void on_fix(const GnssFix&) override {}
  void on_sync_state(std::optional<GpsTime>, SensorId, SyncState) override {}
  void on_fault(const Fault&) override {}
};

}  // namespace hueline::runtime
