#pragma once

#include <vector>

#include "core/calendar.hpp"
#include "storage/view_writer.hpp"
#include "tests/storage/sample_cloud.hpp"

namespace hueline::test {

inline GpsTime sample_start() { return *from_utc({2026, 3, 1, 0, 0, 0, 0}); }

/// Returns 50 solutions at 100 Hz, 1e-4 degrees further north at each step, heading east.
inline std::vector<InsSolution> sample_solutions() {
  std::vector<InsSolution> all;
  for (int i = 0; i < 50; ++i) {
    InsSolution s;
    s.time = sample_start() + std::chrono::milliseconds(10) * i;
    s.position = sample_origin();
    s.position.latitude += i * 1e-4 * std::numbers::pi / 180;
    s.attitude.heading = std::numbers::pi / 2;
    s.is_good = true;
    all.push_back(s);
  }
  return all;
}

/// Returns a Bayer image of one colour.
inline Exposure sample_exposure(GpsTime time) {
  Exposure e;
  e.exposure_mid = time;
  e.image.width = e.image.stride = 640, e.image.height = 320;
  e.image.format = PixelFormat::BayerRG8;
  e.image.is_complete = true;
  std::vector<std::byte> pixels(640 * 320);
  for (std::size_t y = 0; y < 320; ++y)
    for (std::size_t x = 0; x < 640; ++x)
      pixels[y * 640 + x] = static_cast<std::byte>(y % 2 == 0 ? (x % 2 == 0 ? 200 : 100) : (x % 2 == 0 ? 100 : 50));
  e.image.buffer = Buffer::copy_of(pixels);
  return e;
}

/// Returns a scanner, and a camera "head" with two lenses side by side in its image of 640 x 320 pixels.
inline storage::ViewRig sample_view_rig() {
  storage::ViewRig rig;
  Transform<Body, Scanner> T_body_scanner;
  T_body_scanner.translation = {0.1, 0.2, 1.5};
  rig.scanners.emplace_back("laser_front", T_body_scanner);
  rig.T_body_head.rotation = Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitZ());
  for (const std::uint32_t i : {0u, 1u}) {
    storage::ViewLens lens;
    lens.name = i == 0 ? "left" : "right";
    lens.camera = "head";
    lens.is_fisheye = i == 1;
    lens.focal_px = {300, 310};
    lens.principal_point_px = {159.5, 149.5};
    lens.distortion = i == 0 ? std::vector{0.1, 0.01, 1e-3, 2e-3, 1e-4} : std::vector{0.02, 0.03, 0.0, 0.0};
    lens.x_offset = 320 * i;
    rig.lenses.push_back(lens);
  }
  return rig;
}

/// Writes a view with some of everything that a view can hold.
inline Status write_sample_view(const std::filesystem::path& path) {
  storage::ViewWriter::Config config;
  config.messages.image_longest_px = 320;
  auto view = storage::ViewWriter::create(path, sample_origin(), sample_view_rig(), config);
  if (!view) return view.error();
  Status done = view->append(sample_cloud(4'000));
  if (done) done = view->append(sample_cloud(6'000, 4'000));
  for (const InsSolution& s : sample_solutions())
    if (done) done = view->append(s);
  GnssFix fix;
  fix.time = sample_start();
  fix.position = sample_origin();
  fix.sigma_enu = {0.1, 0.2, 0.3};
  if (done) done = view->append(fix);
  for (const int ms : {0, 700, 1400})
    if (done) done = view->append(sample_exposure(sample_start() + std::chrono::milliseconds(ms)), "head");
  if (done)
    done = view->append_log(sample_start(), storage::ViewWriter::Level::Warning, "laser_front", "12 packets lost");
  const Status closed = view->close();
  return done ? closed : done;
}

}  // namespace hueline::test
