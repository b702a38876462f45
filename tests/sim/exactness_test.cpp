#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <iterator>

#include "core/geodesy.hpp"
#include "drivers/velodyne/velodyne_decoder.hpp"
#include "fusion/colouring.hpp"
#include "sim/generate.hpp"
#include "sim/judge.hpp"
#include "sim/wire/velodyne_encode.hpp"
#include "tests/sim/small_scenario.hpp"

/// Compares the geometry of the program with that of the simulator: a drive without noise, its laser through real
/// datagrams, coloured by fusion and judged. Only quantisation is left: whole microseconds of the scanner's stamp, and
/// floats in the projection.
namespace hueline::sim {
namespace {

constexpr SensorId kLaser = 1, kCamera = 2;

template <class To, class From>
Transform<To, From> transform(const Pose& T) {
  const auto& m = T.R.m;
  Eigen::Matrix3d R;
  R << m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], m[8];
  return {Eigen::Quaterniond(R), {T.p.x, T.p.y, T.p.z}};
}

fusion::RigGeometry rig_geometry(const Scenario& scenario) {
  const RigTruth truth = rig_truth(scenario);
  fusion::RigGeometry rig;
  rig.lasers.push_back({kLaser, transform<Body, Scanner>(truth.T_body_scanner), 0.02});
  rig.head.T_body_head = transform<Body, CameraHead>(truth.T_body_head);
  for (std::size_t i = 0; i < truth.lenses.size(); ++i) {
    const TrueLens& lens = truth.lenses[i];
    fusion::LensMount mount;
    mount.name = "lens " + std::to_string(i);
    mount.T_head_lens = transform<CameraHead, Lens>(lens.T_head_lens);
    mount.camera = kCamera;
    mount.x_offset = static_cast<std::uint32_t>(truth.column_of(i));
    mount.y_offset = static_cast<std::uint32_t>(truth.row_of(i));
    mount.intrinsics.model =
        lens.model == LensModel::Brown ? fusion::LensModel::Brown : fusion::LensModel::KannalaBrandt;
    mount.intrinsics.width = static_cast<std::uint32_t>(lens.width);
    mount.intrinsics.height = static_cast<std::uint32_t>(lens.height);
    mount.intrinsics.focal_px = {lens.focal_x, lens.focal_y};
    mount.intrinsics.principal_point_px = {lens.centre_x, lens.centre_y};
    mount.intrinsics.distortion = lens.distortion;
    mount.intrinsics.max_angle = lens.theta_max;
    rig.head.lenses.push_back(mount);
  }
  return rig;
}

InsSolution solution_of(const InsSample& s) {
  InsSolution out;
  out.time = gps_time_ns(s.gps_ns);
  out.position = {s.latitude_rad, s.longitude_rad, s.ellipsoidal_height_m};
  out.velocity_enu = {s.velocity_east, s.velocity_north, s.velocity_up};
  out.attitude = {s.roll_rad, s.pitch_rad, s.heading_rad};
  out.is_good = true;
  out.sigma = s.sigma;
  return out;
}

Exposure exposure_of(const CameraExposure& e, const std::string& folder) {
  std::ifstream in(folder + "/" + e.image_file, std::ios::binary);
  const std::string raw{std::istreambuf_iterator<char>(in), {}};
  Exposure out;
  out.camera = kCamera;
  out.index = e.number;
  out.exposure_mid = gps_time_ns(e.exposure_start_gps_ns + e.exposure_ns / 2);
  out.state = SyncState::Locked;
  out.timing = ExposureTiming::EventMark;
  out.image.sensor = kCamera;
  out.image.width = out.image.stride = e.width;
  out.image.height = e.height;
  out.image.is_complete = true;
  out.image.buffer = Buffer::copy_of(std::as_bytes(std::span(raw)));
  return out;
}

/// Colours the whole drive and judges each coloured point.
Judge colour_and_judge(const Scenario& scenario, const Drive& drive, fusion::ColourMethod method) {
  auto judge = Judge::open(scenario, drive.cache_dir + "/truth.bin", {});
  EXPECT_TRUE(judge.ok());
  fusion::Colouring::Config config;
  config.method = method;
  const auto sink = [&](const CloudBlock& block) {
    const auto to_ecef_frame = ecef_from_enu(block.origin);
    for (const ColouredPoint& p : block.points) {
      if (p.state != ColourState::Direct && p.state != ColourState::Neighbour) continue;
      const Eigen::Vector3d place = (to_ecef_frame * Point<Enu>{{p.east, p.north, p.up}}).xyz;
      Claim claim;
      claim.fired_gps_ns = count_ns(p.time);
      claim.channel = p.channel;
      claim.exposure = p.exposure;
      claim.lens = p.lens;
      claim.is_panorama_pixel = method == fusion::ColourMethod::Panorama;
      claim.u = p.u;
      claim.v = p.v;
      claim.red = p.red, claim.green = p.green, claim.blue = p.blue;
      claim.place_ecef = Vec3{place.x(), place.y(), place.z()};
      judge->add(claim);
    }
  };
  const fusion::RigGeometry rig = rig_geometry(scenario);
  EXPECT_EQ(rig.validate(), "");
  fusion::Colouring colouring(config, rig, sink);
  for (const InsSample& s : drive.ins) colouring.add(solution_of(s));
  for (const CameraExposure& e : drive.exposures) colouring.add(exposure_of(e, drive.cache_dir));
  drivers::VelodyneDecoder decoder({});
  std::uint64_t sequence = 0;
  for (const LaserPacket& p : drive.laser) {
    const auto bytes = encode_laser_data(p, LaserModel::Vlp16, LaserReturnMode::Strongest);
    EXPECT_TRUE(bytes.ok());
    Packet packet;
    packet.sensor = kLaser;
    packet.sequence = ++sequence;
    packet.received = host_time_ns(p.first_firing_gps_ns - drive.begin_gps_ns + 2'000'000);
    packet.bytes = Buffer::copy_of(std::as_bytes(std::span(bytes->data(), bytes->size())));
    std::vector<Measurement> measured;
    decoder.decode(packet, measured);
    for (Measurement& m : measured)
      if (auto* batch = std::get_if<LaserBatch>(&m)) {
        StampedLaserBatch stamped;
        stamped.sensor = kLaser;
        stamped.packet_sequence = sequence;
        stamped.time = gps_time_ns(p.first_firing_gps_ns / 1000 * 1000);  // the wire carries whole microseconds
        stamped.state = SyncState::Locked;
        stamped.returns = std::move(batch->returns);
        colouring.add(std::move(stamped));
      }
  }
  colouring.flush();
  return std::move(*judge);
}

void expect(Scenario scenario, fusion::ColourMethod method, const char* name, double rms_px, double p95_px,
            double place_m) {
  const TemporaryFolder folder("hueline-exact");
  scenario.duration_s = 2;
  const auto drive = generate(scenario, folder.path());
  ASSERT_TRUE(drive.ok()) << drive.error().message;
  const Judge judge = colour_and_judge(scenario, *drive, method);
  const auto& all = judge.all();
  std::printf(
      "%s: %llu points judged, %llu unmatched; error %.5f px rms, %.5f px p95, %.5f px max on 8000 x 4000; place %.6f "
      "m rms, %.6f m max\n",
      name, static_cast<unsigned long long>(all.error_px.count()), static_cast<unsigned long long>(judge.unmatched()),
      all.error_px.rms(), all.error_px.quantile(0.95), all.error_px.max(), all.place_error_m.rms(),
      all.place_error_m.max());
  EXPECT_GT(all.error_px.count(), 20'000u);
  EXPECT_EQ(judge.unmatched(), 0u);
  EXPECT_LE(all.error_px.rms(), rms_px);
  EXPECT_LE(all.error_px.quantile(0.95), p95_px);
  EXPECT_LE(all.place_error_m.rms(), place_m);
}

void expect_exact(LensModel model, fusion::ColourMethod method, const char* name) {
  Scenario scenario = small_scenario();
  scenario.noise = false;
  scenario.camera.lens_model = model;
  expect(scenario, method, name, 0.01, 0.02, 1e-4);
}

TEST(Exactness, FisheyeByLens) {
  expect_exact(LensModel::KannalaBrandt, fusion::ColourMethod::Lens, "Kannala-Brandt, by lens");
}
TEST(Exactness, BrownByLens) { expect_exact(LensModel::Brown, fusion::ColourMethod::Lens, "Brown, by lens"); }
TEST(Exactness, Panorama) {
  expect_exact(LensModel::KannalaBrandt, fusion::ColourMethod::Panorama, "panoramic sphere");
}

TEST(Exactness, WithTheSensorsNoise) {
  expect(small_scenario(), fusion::ColourMethod::Lens, "with noise", 1.0, 2.0, 0.05);
}

}  // namespace
}  // namespace hueline::sim
