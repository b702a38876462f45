#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <set>
#include <vector>

#include "fusion/colouring.hpp"
#include "tests/fusion/drive.hpp"

/// Runs the whole stage on a small drive with known truth.
namespace hueline::test {

constexpr double kInterval = 0.25;
constexpr double kFirstExposure = 0.1;

/// Makes an image in which red grows to the right and green downwards inside each lens; blue identifies the exposure.
Image ramp_image(double blue);
/// Makes an image of one colour.
Image flat_image(double red, double green, double blue);

struct TestDrive {
  /// Colours are as delivered: most images here are drawn on the lenses, and show no world.
  TestDrive() { config.radiometry.rendering = fusion::Rendering::AsDelivered; }
  Drive drive{Motion{}};
  fusion::RigGeometry rig = ladybug_rig(fusion::LensModel::KannalaBrandt);
  fusion::Colouring::Config config;
  double until = 2.0;
  std::vector<int> lost;  ///< exposures that are never delivered
  std::function<Image(int)> image = [](int i) { return ramp_image(10.0 * i); };
  std::function<void(Exposure&)> alter = [](Exposure&) {};
  std::function<bool(double)> has_solution = [](double) { return true; };
  int per_batch = 64;
  double packet_rate = 100;
  double flush_at = 1e9;
  bool is_provisional = false;  ///< whether provisional colours are wanted
};

struct Outcome {
  std::vector<ColouredPoint> points;
  std::vector<ColouredPoint> provisional;
  std::set<std::size_t> judged;  ///< indices of the points whose lines of sight were judged
  double longest_wait_s = 0, longest_provisional_wait_s = 0;  ///< from a point's firing until it came out, if coloured
  Geodetic origin;
  fusion::ColouringCounts counts;
  std::vector<Fault> faults;
  std::vector<Vector3> truth_base;  ///< in the order of the returns given to the stage
};

/// Runs the stage with everything in the order in which it would arrive; images arrive 80 ms after their middle.
Outcome run(const TestDrive& test);

std::uint64_t count_state(const Outcome& out, ColourState state);
/// Expects that each return and each exposure is counted exactly once.
void expect_every_return_accounted_for(const Outcome& out);

double exposure_time(int index);
/// Returns a point of the base level in the head's frame at an exposure, by the tests' own mathematics.
Vector3 in_head_at(const TestDrive& test, const Vector3& p_base, double t);
/// Calculates the pixel where the point must lie in an exposure and lens. With `onto_sphere` > 0, the point is first
/// moved along its ray to that radius.
bool true_pixel(const TestDrive& test, const Vector3& p_base, int exposure, int lens, Eigen::Vector2d& pixel,
                double onto_sphere = 0);

}  // namespace hueline::test
