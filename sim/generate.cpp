#include "sim/generate.hpp"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "sim/camera_model.hpp"
#include "sim/drive_file.hpp"
#include "sim/ins_model.hpp"
#include "sim/laser_model.hpp"
#include "sim/pps_model.hpp"
#include "sim/profile_scanner_model.hpp"
#include "sim/truth_file.hpp"
#include "sim/wheel_model.hpp"
#include "sim/wire/jpeg_planes_encode.hpp"
#include "sim/wire/utc.hpp"

namespace hueline::sim {
namespace {

namespace fs = std::filesystem;

Status save(const std::string& path, const void* data, std::size_t size) {
  ByteWriter out(path);
  out.bytes(data, size);
  return out.close();
}

std::string image_name(std::size_t number) {
  char name[32];
  std::snprintf(name, sizeof name, "images/%06zu.raw", number);
  return name;
}

constexpr std::uint32_t kPayloadRow = 4096;
constexpr std::int64_t kGpsEpochUnix_s = 315'964'800;

/// Encodes an exposure as the head's own compression does.
Result<Bytes> jpeg_planes(const Scenario& scenario, const RigTruth& rig, const CameraExposure& e,
                          std::span<const std::uint8_t> mosaic) {
  JpegPlanesImage image;
  image.mosaic = mosaic;
  image.width = static_cast<std::uint32_t>(rig.image_width());
  image.height = static_cast<std::uint32_t>(rig.image_height());
  image.lens_columns = static_cast<std::uint32_t>(scenario.camera.stack_columns);
  image.lens_rows = static_cast<std::uint32_t>(scenario.camera.stack_rows);
  image.lenses = rig.lenses.size();
  image.unix_us = (e.exposure_start_gps_ns / 1000) + (kGpsEpochUnix_s - kGpsMinusUtcSeconds) * 1'000'000;
  image.sequence = e.number;
  image.reports = e.reports;
  if (e.reports.empty())
    image.reports.assign(rig.lenses.size(), {std::llround(scenario.camera.exposure_us) * 1000, 0.0f});
  image.quality = scenario.camera.jpeg_quality;
  return encode_jpeg_planes(image);
}

/// Fills all files up to the size of the largest, in whole rows of bytes: a camera sends its compressed exposures in
/// buffers of one size.
Status fill_up(const fs::path& folder, std::size_t largest, std::vector<CameraExposure>& exposures) {
  for (CameraExposure& e : exposures) {
    e.width = kPayloadRow;
    e.height = static_cast<std::uint32_t>((largest + kPayloadRow - 1) / kPayloadRow);
    std::error_code ec;
    fs::resize_file(folder / e.image_file, std::uintmax_t{e.width} * e.height, ec);
    if (ec) return Error{ErrorCode::Io, "filling up " + e.image_file + ": " + ec.message()};
  }
  return {};
}

/// Returns what the camera writes of an exposure: of each lens, or of all, which are then exposed alike.
std::vector<CameraExposure::Report> reports_of(const PanoramicCamera& camera, std::size_t number, bool of_each) {
  std::vector<CameraExposure::Report> out;
  for (const float factor : camera.lens_gains(number))
    out.push_back({camera.shutter().exposure_ns(factor), camera.shutter().amplification(factor)});
  if (!of_each) out.resize(1);
  return out;
}

/// Renders the images one after the other, each with all threads, so that at most one is in memory.
Status render_images(const Scenario& scenario, const PanoramicCamera& camera, const RigTruth& rig,
                     const fs::path& folder, Drive& drive, unsigned threads, const std::function<bool(double)>& go_on) {
  const bool is_coded = scenario.camera.payload == ImagePayload::JpegPlanes;
  std::size_t largest = 0;
  for (std::size_t i = 0; i < camera.exposure_count(); ++i) {
    if (!go_on(static_cast<double>(i) / static_cast<double>(camera.exposure_count())))
      return Error{ErrorCode::Stopped, "stopped while rendering images; nothing is kept"};
    const auto image = camera.expose(i, threads);
    CameraExposure e;
    e.number = static_cast<std::uint32_t>(i);
    e.exposure_start_gps_ns = camera.exposure_start(i);
    e.exposure_ns = camera.exposure_ns(i);
    for (const float factor : camera.lens_gains(i))
      if (const GpsNs own = camera.shutter().exposure_ns(factor); own > std::max(e.exposure_ns, e.longest_ns))
        e.longest_ns = own;
    if (scenario.camera.reports_exposure) e.reports = reports_of(camera, i, is_coded);
    e.width = static_cast<std::uint32_t>(rig.image_width());
    e.height = static_cast<std::uint32_t>(rig.image_height());
    e.image_file = image_name(i);
    const std::string file = (folder / e.image_file).string();
    if (is_coded) {
      const Result<Bytes> coded = jpeg_planes(scenario, rig, e, image);
      if (!coded.ok()) return coded.error();
      largest = std::max(largest, coded->size());
      if (Status s = save(file, coded->data(), coded->size()); !s.ok()) return s;
    } else if (Status s = save(file, image.data(), image.size()); !s.ok()) {
      return s;
    }
    drive.exposures.push_back(std::move(e));
  }
  return is_coded ? fill_up(folder, largest, drive.exposures) : Status();
}

/// Fires the packets in groups: a group is fired in parallel, then `keep` takes its packets one after the other, in
/// order.
template <class AnyScanner, class Keep>
Status fire_laser(const AnyScanner& scanner, unsigned threads, const std::function<bool(double)>& go_on, Keep keep) {
  constexpr std::size_t kGroup = 512;
  std::vector<decltype(scanner.fire(0))> group(kGroup);
  for (std::size_t first = 0; first < scanner.packet_count(); first += kGroup) {
    if (!go_on(static_cast<double>(first) / static_cast<double>(scanner.packet_count())))
      return Error{ErrorCode::Stopped, "stopped while firing the laser; nothing is kept"};
    const std::size_t count = std::min(kGroup, scanner.packet_count() - first);
    std::atomic<std::size_t> next{0};
    const auto work = [&] {
      for (std::size_t i; (i = next.fetch_add(1)) < count;) group[i] = scanner.fire(first + i);
    };
    {
      std::vector<std::jthread> others;
      for (unsigned t = 1; t < threads; ++t) others.emplace_back(work);
      work();
    }
    for (std::size_t i = 0; i < count; ++i) keep(std::move(group[i]));
  }
  return {};
}

/// Returns false if the files of the folder have an older format. They hold the same drive but can no longer be read,
/// so the drive is rendered again.
bool is_current(const fs::path& folder) {
  const auto begins = [&](const char* file, const char* magic) {
    ByteReader in((folder / file).string());
    char first[8] = {};
    return in.bytes(first, 8) && std::memcmp(first, magic, 8) == 0;
  };
  return begins("drive.bin", kDriveMagic) && begins("truth.bin", kTruthMagic);
}

Status make(const Scenario& scenario, const fs::path& folder, const Progress& progress,
            const GenerateOptions& options) {
  const unsigned threads = options.threads > 0 ? options.threads : std::max(1u, std::thread::hardware_concurrency());
  auto last = std::chrono::steady_clock::time_point();
  // Only the reports of progress, which people read, use a clock here.
  const auto report = [&](const char* stage) {
    return [&, stage](double share) {
      const auto now = std::chrono::steady_clock::now();
      if (progress && now - last > std::chrono::milliseconds(100)) {
        last = now;
        progress(stage, share);
      }
      return !options.stop.stop_requested();
    };
  };
  const Motion motion(scenario);
  const World world(scenario, motion);
  const PanoramicCamera camera(scenario, motion, world);
  const RigTruth rig = rig_truth(scenario);
  const GeodeticPlace origin = scene_origin(scenario);

  Drive drive;
  drive.origin_latitude_rad = origin.latitude;
  drive.origin_longitude_rad = origin.longitude;
  drive.origin_height_m = origin.height;
  drive.begin_gps_ns = scenario.begin_gps_ns();
  drive.end_gps_ns = scenario.end_gps_ns();
  drive.ins = simulate_ins(scenario, motion);
  drive.pps_edge_error_ns = simulate_pps(scenario);
  drive.wheel = simulate_wheel(scenario, motion);

  TruthHeader header{
      origin.latitude, origin.longitude, origin.height, scenario.text(), world.surfaces(), world.targets(), {}};
  header.has_fine_light = scenario.street.daylight < 1;
  for (std::size_t i = 0; i < camera.exposure_count(); ++i) {
    const Pose T = camera.T_enu_head(i);
    header.exposures.push_back(
        {static_cast<std::uint32_t>(i), camera.exposure_mid(i), T.R.m, {T.p.x, T.p.y, T.p.z}, camera.lens_gains(i)});
  }
  TruthWriter truth((folder / "truth.bin").string(), header);
  if (Status s = render_images(scenario, camera, rig, folder, drive, threads, report("images")); !s.ok()) return s;
  Status fired;
  if (scenario.laser.model == LaserModel::Profile)
    fired = fire_laser(ProfileScanner(scenario, motion, world), threads, report("laser"), [&](FiredProfile&& one) {
      truth.packet(one.packet.first_pulse_gps_ns, one.scanner_enu, one.returns);
      drive.profile.push_back(std::move(one.packet));
    });
  else
    fired = fire_laser(Scanner(scenario, motion, world), threads, report("laser"), [&](FiredPacket&& one) {
      truth.packet(one.packet.first_firing_gps_ns, one.scanner_enu, one.returns);
      drive.laser.push_back(std::move(one.packet));
    });
  if (!fired.ok()) return fired;
  if (Status s = truth.close(); !s.ok()) return s;
  if (Status s = write_drive(drive, (folder / "drive.bin").string()); !s.ok()) return s;
  if (progress) progress("done", 1.0);
  return save((folder / "scenario.txt").string(), header.scenario.data(), header.scenario.size());
}

}  // namespace

Result<Drive> generate(const Scenario& scenario, const std::string& cache_dir, const Progress& progress,
                       const GenerateOptions& options) {
  if (const std::string complaint = scenario.validate(); !complaint.empty())
    return Error{ErrorCode::Invalid, "scenario: " + complaint};
  const fs::path folder = fs::path(cache_dir) / scenario.fingerprint();
  const std::string file = (folder / "drive.bin").string();
  std::error_code ec;
  if (fs::exists(file, ec) && is_current(folder)) return read_drive(file);

  const fs::path partial = folder.string() + ".partial-" + std::to_string(::getpid());
  fs::remove_all(partial, ec);
  fs::create_directories(partial / "images", ec);
  if (ec) return Error{ErrorCode::Io, "making " + partial.string() + ": " + ec.message()};
  if (Status made = make(scenario, partial, progress, options); !made.ok()) {
    fs::remove_all(partial, ec);
    return made.error();
  }
  if (fs::exists(file, ec) && !is_current(folder)) fs::remove_all(folder, ec);
  fs::rename(partial, folder, ec);
  // Another process may have finished the same drive first; its result is equal.
  if (ec && !fs::exists(file)) return Error{ErrorCode::Io, "renaming " + partial.string() + ": " + ec.message()};
  return read_drive(file);
}

}  // namespace hueline::sim
