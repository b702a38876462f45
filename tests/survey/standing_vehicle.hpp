#pragma once

#include <functional>
#include <vector>

#include "fusion/trajectory.hpp"
#include "runtime/products.hpp"
#include "tests/fusion/drive.hpp"

/// A vehicle that stands, with a scanner in the place of its head, so that both see everything in the same direction.
namespace hueline::test {

struct StandingVehicle {
  StandingVehicle();
  /// Returns the return of a thing in a direction of the body: azimuth from forward to the right, and elevation.
  LaserReturn seen_at(double azimuth_deg, double elevation_deg, double range_m, int channel,
                      std::int32_t offset_ns) const;
  /// Returns the image of all lenses, in which each pixel has the colour of its direction in the body. Channels are
  /// counted 0, 1, 2.
  Image image(const std::function<double(double azimuth_deg, double elevation_deg, int channel)>& colour) const;
  /// Gives all products to a sink in the order in which they would come, from 0 to `until` s.
  void feed(runtime::ProductSink& sink, const std::vector<StampedLaserBatch>& batches,
            const std::vector<Exposure>& exposures, double until) const;

  Drive drive{Motion{.speed = 0, .turn_rate = 1e-9, .shake = 0}};  // Motion divides by the rate
  fusion::RigGeometry rig = ladybug_rig(fusion::LensModel::KannalaBrandt);
};

}  // namespace hueline::test
