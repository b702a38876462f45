#pragma once

#include <algorithm>
#include <chrono>
#include <span>
#include <utility>
#include <vector>

#include "runtime/products.hpp"

namespace hueline::apps {

/// Passes all products to several sinks, in their order, and measures the time that they take. Thread safety: none; the
/// thread of the pipeline calls it.
class SinkGroup : public runtime::ProductSink {
 public:
  /// The sinks must outlive this object.
  explicit SinkGroup(std::vector<runtime::ProductSink*> sinks) : sinks_(std::move(sinks)) {}

  void on_origin(const Geodetic& origin) override {
    each([&](ProductSink& sink) { sink.on_origin(origin); });
  }
  void on_cloud(const CloudBlock& block, const fusion::Trajectory& trajectory) override {
    each([&](ProductSink& sink) { sink.on_cloud(block, trajectory); });
  }
  void on_provisional_cloud(const CloudBlock& block, const fusion::Trajectory& trajectory) override {
    each([&](ProductSink& sink) {
      if (sink.wants_provisional_cloud()) sink.on_provisional_cloud(block, trajectory);
    });
  }
  bool wants_provisional_cloud() const override {
    return std::any_of(sinks_.begin(), sinks_.end(),
                       [](const ProductSink* sink) { return sink->wants_provisional_cloud(); });
  }
  void on_sights(const CloudBlock& block, std::span<const fusion::JudgedSight> sights) override {
    each([&](ProductSink& sink) {
      if (sink.wants_sights()) sink.on_sights(block, sights);
    });
  }
  bool wants_sights() const override {
    return std::any_of(sinks_.begin(), sinks_.end(), [](const ProductSink* sink) { return sink->wants_sights(); });
  }
  void on_image(const Image& image) override {
    each([&](ProductSink& sink) { sink.on_image(image); });
  }
  void on_exposure(const Exposure& exposure) override {
    each([&](ProductSink& sink) { sink.on_exposure(exposure); });
  }
  void on_settled_exposure(const Exposure& exposure, const fusion::Trajectory& trajectory) override {
    each([&](ProductSink& sink) { sink.on_settled_exposure(exposure, trajectory); });
  }
  void on_laser(const StampedLaserBatch& batch) override {
    each([&](ProductSink& sink) { sink.on_laser(batch); });
  }
  void on_settled_laser(const StampedLaserBatch& batch, const fusion::Trajectory& trajectory) override {
    each([&](ProductSink& sink) {
      if (sink.wants_settled_laser()) sink.on_settled_laser(batch, trajectory);
    });
  }
  bool wants_settled_laser() const override {
    return std::any_of(sinks_.begin(), sinks_.end(),
                       [](const ProductSink* sink) { return sink->wants_settled_laser(); });
  }
  void on_watermark(GpsTime watermark) override {
    each([&](ProductSink& sink) { sink.on_watermark(watermark); });
  }
  void on_solution(const InsSolution& solution) override {
    each([&](ProductSink& sink) { sink.on_solution(solution); });
  }
  void on_wheel(const StampedWheelSpeed& wheel) override {
    each([&](ProductSink& sink) { sink.on_wheel(wheel); });
  }
  void on_fix(const GnssFix& fix) override {
    each([&](ProductSink& sink) { sink.on_fix(fix); });
  }
  void on_sync_state(std::optional<GpsTime> time, SensorId clock, SyncState state) override {
    each([&](ProductSink& sink) { sink.on_sync_state(time, clock, state); });
  }
  void on_fault(const Fault& fault) override {
    each([&](ProductSink& sink) { sink.on_fault(fault); });
  }

  /// Returns the time spent in the sinks, which is subtracted from the pipeline's time.
  std::chrono::nanoseconds spent() const { return spent_; }

 private:
  template <class Call>
  void each(Call call) {
    const auto began = std::chrono::steady_clock::now();
    for (ProductSink* sink : sinks_) call(*sink);
    spent_ += std::chrono::steady_clock::now() - began;
  }

  std::vector<runtime::ProductSink*> sinks_;
  std::chrono::nanoseconds spent_{0};
};

}  // namespace hueline::apps
