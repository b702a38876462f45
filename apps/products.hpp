#pragma once

#include <string>

#include "core/coloured_point.hpp"
#include "core/measurements.hpp"
#include "core/stamped.hpp"

namespace hueline::apps {

/// What leaves the pipeline, in an order that the journal alone decides. Called on the pipeline's thread.
class ProductSink {
 public:
  virtual ~ProductSink() = default;
  virtual void on_cloud(const CloudBlock& block) = 0;
  virtual void on_exposure(const Exposure& exposure) = 0;
  virtual void on_solution(const InsSolution& solution) = 0;
  virtual void on_fix(const GnssFix& fix) = 0;
  virtual void on_sync_state(GpsTime time, SensorId clock, SyncState state) = 0;
  virtual void on_fault(const Fault& fault) = 0;
};

/// For runs that want only some of it.
class NullSink : public ProductSink {
 public:
  void on_cloud(const CloudBlock&) override {}
  void on_exposure(const Exposure&) override {}
  void on_solution(const InsSolution&) override {}
  void on_fix(const GnssFix&) override {}
  void on_sync_state(GpsTime, SensorId, SyncState) override {}
  void on_fault(const Fault&) override {}
};

}  // namespace hueline::apps
