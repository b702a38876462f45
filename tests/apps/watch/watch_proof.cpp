// Drives simulated streets past the watch over mounting and times, and counts what it reports. Only what the watch
// looks at is rendered: two lens images a second and the laser packets around them, in which an hour of street takes a
// fraction of an hour. docs/calibration.md has the commands and their figures.
//
//   watch_proof SCENARIO FIRST_SEED DRIVES [THREADS]
//     drives SCENARIO with DRIVES seeds, from FIRST_SEED on, and prints a line for each drive and the sums. After the
//     moment of camera.drift a report is right, before it, or without a drift, it is a false alarm.
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "apps/simulate/simulated_rig.hpp"
#include "config/rig.hpp"
#include "config/scenario.hpp"
#include "config/section.hpp"
#include "core/angle.hpp"
#include "core/standard_streams.hpp"
#include "runtime/drive_watch.hpp"
#include "sim/camera_model.hpp"
#include "sim/ins_model.hpp"
#include "sim/laser_model.hpp"
#include "sim/wire/velodyne_encode.hpp"

namespace hueline::apps::test {
namespace {

constexpr double kImagesPerSecond = 2;
constexpr sim::GpsNs kAround_ns = 160'000'000;  // a little more than the watch uses

/// What the watch said in one drive.
struct DriveResult {
  double watched_s = 0;  ///< time with a full window, without a drift
  int false_alarms = 0;
  std::optional<double> noticed_s;  ///< after the drift
  std::string said;                 ///< the first report
  double largest = 0;               ///< largest change over its sigma, before the drift
  calibration::CalibrationDrift last;
};

InsSolution solution_of(const sim::InsSample& sample) {
  InsSolution out;
  out.time = gps_time_ns(sample.gps_ns);
  out.position = {sample.latitude_rad, sample.longitude_rad, sample.ellipsoidal_height_m};
  out.velocity_enu = {sample.velocity_east, sample.velocity_north, sample.velocity_up};
  out.attitude = {sample.roll_rad, sample.pitch_rad, sample.heading_rad};
  out.is_good = true;
  out.sigma = sample.sigma;
  return out;
}

Exposure exposure_of(std::size_t number, sim::GpsNs told_mid, SensorId camera, const sim::RigTruth& rig,
                     const std::vector<std::uint8_t>& pixels) {
  Exposure out;
  out.camera = camera;
  out.index = static_cast<std::uint32_t>(number);
  out.exposure_mid = gps_time_ns(told_mid);
  out.timing = ExposureTiming::EventMark;
  out.image.width = out.image.stride = static_cast<std::uint32_t>(rig.image_width());
  out.image.height = static_cast<std::uint32_t>(rig.image_height());
  out.image.is_complete = true;
  out.image.buffer = Buffer::copy_of(std::as_bytes(std::span(pixels)));
  return out;
}

/// The Velodyne of a simulated drive, by way of the bytes of its packets.
class Lasers {
 public:
  Lasers(const sim::Scenario& scenario, const sim::Motion& motion, const sim::World& world, const config::Rig& rig)
      : scanner_(scenario, motion, world),
        model_(scenario.laser.model),
        begin_(scenario.sensors_begin_gps_ns()),
        period_(sim::laser_timing(model_, true).packet_period_ns()),
        sensor_(rig.geometry.lasers.front().sensor),
        decoder_(rig.sensors[sensor_ - 1u].device->make_decoder()) {}

  /// Gives the watch the packets around a time.
  void feed(sim::GpsNs around, runtime::DriveWatch& watch) {
    const auto index = [&](sim::GpsNs t) {
      return static_cast<std::size_t>(std::max<sim::GpsNs>(0, (t - begin_) / period_));
    };
    const std::size_t end = std::min(index(around + kAround_ns), scanner_.packet_count());
    for (std::size_t i = std::max(next_, index(around - kAround_ns)); i < end; ++i) {
      const sim::LaserPacket packet = scanner_.fire(i).packet;
      const auto bytes = sim::encode_laser_data(packet, model_, sim::LaserReturnMode::Strongest);
      if (!bytes.ok()) std::abort();
      std::vector<Measurement> out;
      decoder_->decode({sensor_, PacketKind::Wire, false, i, HostTime(nanoseconds(packet.first_firing_gps_ns)),
                        Buffer::copy_of(std::as_bytes(std::span(*bytes)))},
                       out);
      for (Measurement& one : out)
        if (auto* batch = std::get_if<LaserBatch>(&one)) {
          StampedLaserBatch stamped;
          stamped.sensor = sensor_;
          stamped.time = gps_time_ns(packet.first_firing_gps_ns);
          stamped.returns = std::move(batch->returns);
          watch.add(stamped);
        }
    }
    next_ = end;
  }

 private:
  sim::Scanner scanner_;
  sim::LaserModel model_;
  sim::GpsNs begin_, period_;
  SensorId sensor_;
  std::unique_ptr<Decoder> decoder_;
  std::size_t next_ = 0;
};

DriveResult drive(const sim::Scenario& scenario) {
  config::Rig rig = config::parse_rig(simulated_rig(scenario, {}, "lens"), "simulated rig");
  rig.watch.images_per_s = kImagesPerSecond;
  const sim::Motion motion(scenario);
  const sim::World world(scenario, motion);
  const sim::PanoramicCamera camera(scenario, motion, world);
  const sim::RigTruth truth = sim::rig_truth(scenario);
  fusion::Trajectory trajectory(rig.colouring.trajectory);
  for (const sim::InsSample& sample : sim::simulate_ins(scenario, motion)) trajectory.add(solution_of(sample));
  Lasers lasers(scenario, motion, world, rig);
  runtime::DriveWatch watch(rig.geometry, rig.watch);
  const sim::HeadDriftConfig& drift = scenario.camera.drift;
  DriveResult out;
  std::uint64_t windows = 0;
  const SensorId camera_id = rig.geometry.head.lenses.front().camera;
  for (std::size_t i = 0; i < camera.exposure_count(); ++i) {
    // The first exposure only begins the count of seconds. From then on the lenses are looked at in turn.
    const auto pixels = i == 0 ? std::vector<std::uint8_t>(static_cast<std::size_t>(truth.image_width()) *
                                                           static_cast<std::size_t>(truth.image_height()))
                               : camera.expose_lens(i, (i - 1) % truth.lenses.size());
    const sim::GpsNs told_mid = camera.exposure_start(i) + camera.exposure_ns(i) / 2;
    lasers.feed(told_mid, watch);
    watch.add(exposure_of(i, told_mid, camera_id, truth, pixels));
    watch.advance(gps_time_ns(told_mid + kAround_ns), trajectory, [](GpsTime) { return true; });
    const double since_s = 1e-9 * static_cast<double>(told_mid - scenario.sensors_begin_gps_ns()) - drift.at_s;
    const bool is_drifted = drift.is_there() && since_s >= 0;
    for (const Fault& fault : watch.take_faults()) {
      if (out.said.empty()) out.said = fault.detail;
      if (is_drifted && !out.noticed_s) out.noticed_s = since_s;
      out.false_alarms += is_drifted ? 0 : 1;
    }
    if (std::exchange(windows, watch.report().windows) == watch.report().windows) continue;
    out.last = *watch.report().last;
    if (is_drifted) continue;
    out.watched_s += rig.watch.block_s;
    for (int axis = 0; axis < 4; ++axis)
      if (const double sigma = std::sqrt(out.last.change_covariance(axis, axis)); sigma > 0)
        out.largest = std::max(out.largest, std::abs(out.last.change[axis]) / sigma);
  }
  return out;
}

std::string line_of(std::uint64_t seed, const DriveResult& result) {
  const Eigen::Vector3d turn = result.last.change.head<3>() * kDegPerRad,
                        off = result.last.error.head<3>() * kDegPerRad;
  const Eigen::Vector4d sigma = result.last.change_covariance.diagonal().cwiseSqrt();
  return fmt::format(
      "seed {}: {:.0f} s without drift, {} false alarms, largest change {:.1f} sigma; {}at the end changed by {:.4f} "
      "{:.4f} {:.4f} deg (+- {:.4f} {:.4f} {:.4f}), {:.3f} ms (+- {:.3f}); off {:.4f} {:.4f} {:.4f} deg, {:.3f} ms{}\n",
      seed, result.watched_s, result.false_alarms, result.largest,
      result.noticed_s ? fmt::format("noticed after {:.0f} s; ", *result.noticed_s) : "", turn.x(), turn.y(), turn.z(),
      sigma[0] * kDegPerRad, sigma[1] * kDegPerRad, sigma[2] * kDegPerRad, result.last.change[3] * 1e3, sigma[3] * 1e3,
      off.x(), off.y(), off.z(), result.last.error[3] * 1e3, result.said.empty() ? "" : ": " + result.said);
}

int prove(const std::string& file, std::uint64_t first, std::size_t drives, unsigned threads) {
  sim::Scenario scenario = config::load_scenario(file);
  scenario.camera.rate_hz = kImagesPerSecond;  // others would not be looked at
  std::atomic<std::size_t> next{0};
  std::mutex mutex;
  std::vector<DriveResult> results(drives);
  const auto work = [&] {
    for (std::size_t i; (i = next.fetch_add(1)) < drives;) {
      sim::Scenario one = scenario;
      one.seed = first + i;
      results[i] = drive(one);
      const std::lock_guard lock(mutex);
      std::fputs(line_of(one.seed, results[i]).c_str(), stdout);
      std::fflush(stdout);
    }
  };
  {
    std::vector<std::jthread> others;
    for (unsigned i = 1; i < threads; ++i) others.emplace_back(work);
    work();
  }
  double hours = 0, largest = 0, slowest = 0;
  int alarms = 0, noticed = 0;
  for (const DriveResult& result : results) {
    hours += result.watched_s / 3600;
    alarms += result.false_alarms;
    largest = std::max(largest, result.largest);
    noticed += result.noticed_s ? 1 : 0;
    slowest = std::max(slowest, result.noticed_s.value_or(0));
  }
  fmt::print(
      "{} drives, {:.2f} h without a drift: {} false alarms, largest change {:.1f} sigma; {} drifts noticed, the "
      "slowest after {:.0f} s\n",
      drives, hours, alarms, largest, noticed, slowest);
  return alarms == 0 ? 0 : 1;
}

}  // namespace
}  // namespace hueline::apps::test

int main(int argc, char** argv) {
  if (argc < 4 || argc > 5) {
    std::fputs("usage: watch_proof SCENARIO FIRST_SEED DRIVES [THREADS]\n", stderr);
    return 2;
  }
  try {
    const int status =
        hueline::apps::test::prove(argv[1], std::strtoull(argv[2], nullptr, 10), std::strtoull(argv[3], nullptr, 10),
                                   argc > 4 ? static_cast<unsigned>(std::strtoul(argv[4], nullptr, 10)) : 1);
    return hueline::flush_standard_output().ok() ? status : 4;
  } catch (const hueline::config::ConfigError& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 2;
  }
}
