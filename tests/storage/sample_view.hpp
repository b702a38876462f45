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

/// Writes a view with some of everything that a view can hold.
inline Status write_sample_view(const std::filesystem::path& path) {
  storage::ViewWriter::Config config;
  config.image_longest_px = 320;
  auto view = storage::ViewWriter::create(path, sample_origin(), config);
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
