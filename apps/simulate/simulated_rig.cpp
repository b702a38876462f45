#include "apps/simulate/simulated_rig.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "sim/mask_outline.hpp"
#include "sim/rig_truth.hpp"
#include "sim/shutter.hpp"

namespace hueline::apps {
namespace {

// A mask extends a little beyond the pixels of the vehicle and never less: what a sample reads around its place, the
// colouring adds by itself. The simplification of its corners stays within the margin.
constexpr int kMaskMargin_px = 1;
constexpr double kMaskTolerance_px = 0.5;

std::string numbers(const double* values, std::size_t count) {
  std::string out;
  for (std::size_t i = 0; i < count; ++i) out += fmt::format("{}{}", i ? ", " : "", values[i]);
  return "[" + out + "]";
}

std::string transform(const sim::Pose& T) {
  const double p[3] = {T.p.x, T.p.y, T.p.z};
  return fmt::format("{{position_m: {}, rotation_matrix: {}}}", numbers(p, 3), numbers(T.R.m.data(), 9));
}

/// `number` is the index of the scanner on the vehicle, from 0.
std::string laser_yaml(const sim::Scenario& scenario, const SimulatedAddresses& at, const sim::RigTruth& rig,
                       int number) {
  std::string out = number == 0 ? "  - name: laser\n" : fmt::format("  - name: laser{}\n", number + 1);
  if (scenario.laser.model == sim::LaserModel::Profile)
    out += fmt::format("    driver: profile_scanner\n    scanner_id: {}\n    min_range_m: {}\n", number + 1,
                       std::min(0.5, scenario.laser.min_range_m));
  else
    out += fmt::format("    driver: velodyne\n    model: {}\n",
                       scenario.laser.model == sim::LaserModel::Vlp16 ? "VLP-16" : "HDL-32E");
  return out + fmt::format(
                   "    udp: {{ports: [{}, {}], bind_address: {}}}\n    sigma_range_m: {}\n    T_body_scanner: {}\n\n",
                   at.data_port + number, at.position_port + number, at.receiver(), scenario.laser.range_sigma_m,
                   transform(rig.T_body_scanner));
}

/// The sensor is at the rear wheels, which do not steer.
std::string wheel_yaml(const sim::Scenario& scenario, const SimulatedAddresses& at) {
  if (scenario.wheel.rate_hz <= 0) return {};
  const std::string bus = at.can_interface.empty()
                              ? fmt::format("cannelloni: {{ports: [{}], bind_address: {}}}", at.can_port, at.receiver())
                              : fmt::format("can: {{interface: {}}}", at.can_interface);
  const double per_pulse = scenario.wheel.circumference_m / scenario.wheel.pulses_per_turn;
  return fmt::format(
      "  - name: wheel\n    driver: wheel\n    {}\n    age_ms: {}\n    messages:\n"
      "      - id: 178  # ESP_19\n        speeds:\n"
      "          - {{unit: km/h, dbc: 'SG_ ESP_HL_Radgeschw_02 : 0|16@1+ (0.0075,0) [0|491.49] "
      "\"Unit_KiloMeterPerHour\" X'}}\n"
      "          - {{unit: km/h, dbc: 'SG_ ESP_HR_Radgeschw_02 : 16|16@1+ (0.0075,0) [0|491.49] "
      "\"Unit_KiloMeterPerHour\" X'}}\n"
      "      - id: 416\n        pulses:\n"
      "          - {{metres_per_pulse: {}, start_bit: 7, bits: 16, byte_order: big}}\n"
      "          - {{metres_per_pulse: {}, start_bit: 23, bits: 16, byte_order: big}}\n"
      "        counter: {{start_bit: 32, bits: 4}}\n        checksum: {{kind: crc8_j1850, byte: 7}}\n\n",
      bus, std::min(1000.0, 500 / scenario.wheel.rate_hz), per_pulse, per_pulse);
}

std::string lens_yaml(const sim::RigTruth& rig, std::size_t i, double row_time_us) {
  const sim::TrueLens& lens = rig.lenses[i];
  const bool fisheye = lens.model == sim::LensModel::KannalaBrandt;
  std::string out = fmt::format(
      "    - name: lens{}\n      camera: camera\n      offset_px: [{}, {}]\n      width: {}\n      height: {}\n      "
      "model: {}\n"
      "      focal_px: [{}, {}]\n      principal_point_px: [{}, {}]\n      distortion: {}\n      max_angle_deg: {}\n   "
      "   T_head_lens: {}\n",
      i, rig.column_of(i), rig.row_of(i), lens.width, lens.height, fisheye ? "kannala_brandt" : "brown", lens.focal_x,
      lens.focal_y, lens.centre_x, lens.centre_y, numbers(lens.distortion.data(), fisheye ? 4 : 5),
      sim::degrees(lens.theta_max), transform(lens.T_head_lens));
  if (row_time_us != 0) out += fmt::format("      row_time_us: {}\n", row_time_us);
  const auto outlines =
      sim::mask_outline(rig.own_vehicle_mask(i), lens.width, lens.height, kMaskMargin_px, kMaskTolerance_px);
  if (!outlines.empty()) out += "      masks:  # the vehicle itself\n";
  for (const auto& outline : outlines) {
    std::vector<double> corners;
    for (const sim::TruePixel& corner : outline) corners.insert(corners.end(), {corner.u, corner.v});
    out += fmt::format("        - polygon_px: {}\n", numbers(corners.data(), corners.size()));
  }
  return out;
}

}  // namespace

std::string simulated_rig(const sim::Scenario& scenario, const SimulatedAddresses& at, const std::string& method,
                          const sim::Scenario* beside) {
  const sim::RigTruth rig = sim::rig_truth(scenario);
  std::string out = fmt::format(
      "# The emulated vehicle of a scenario: laser, {}-lens head as one GigE camera, SPAN receiver and its PPS.\n"
      "# Mounting and lenses are the simulator's own: a perfect calibration. Written by: hueline simulate SCENARIO "
      "--write-rig FILE\n"
      "rig: street\n\nsensors:\n"
      "  - name: pps\n    driver: pps\n    socket: {}\n\n"
      "  - name: pos\n    driver: novatel\n    tcp: {{host: {}, port: {}}}\n    logs: {{ins_rate_hz: {}}}\n\n"
      "{}",
      rig.lenses.size() == 6 ? "six" : std::to_string(rig.lenses.size()), at.pps_socket, at.address, at.pos_port,
      scenario.ins.rate_hz,
      laser_yaml(scenario, at, rig, 0) +
          (beside != nullptr ? laser_yaml(*beside, at, sim::rig_truth(*beside), 1) : ""));
  // A camera that chooses its exposures, and reports them as chunks.
  const bool is_auto = scenario.camera.reports_exposure && scenario.camera.payload == sim::ImagePayload::Raw &&
                       sim::Shutter(scenario).sets_shutter();
  // Above one gigabit the bursts exceed the socket's buffer unless the receiving thread runs at once.
  const bool is_fast = scenario.camera.payload == sim::ImagePayload::Raw &&
                       scenario.camera.rate_hz * rig.image_width() * rig.image_height() > 110e6;
  out += fmt::format(
      "  - name: camera\n    driver: genicam\n    address: {0}\n    interface: {9}\n    serial: {1}\n    pixel_format: "
      "BayerRG8\n{6}    width: {2}\n"
      "    height: {3}\n    exposure_us: {4}\n{10}    event_input: 1\n    mark_sigma_us: {8}\n    stamp_event: "
      "exposure_end\n    stamp_delay_us: 45\n    latency_max_ms: {5}\n{7}\n",
      at.address, at.camera_serial, rig.image_width(), rig.image_height(),
      scenario.camera.exposure_us * (is_auto ? scenario.camera.auto_exposure_limit : 1),
      std::min(250.0, 800.0 / scenario.camera.rate_hz),
      scenario.camera.payload == sim::ImagePayload::JpegPlanes
          ? fmt::format("    payload: jpeg_planes\n    lens_columns: {}\n{}", scenario.camera.stack_columns,
                        scenario.camera.reports_exposure ? "    shutter_step_us: 1\n    gain_step_dB: 0.1\n" : "")
          : "",
      is_fast ? "    realtime_priority: 20\n" : "",
      scenario.noise ? std::max(0.1, scenario.camera.strobe_jitter_us) : 0.1, at.receiver(),
      is_auto ? "    auto_exposure: true\n" : "");
  out += wheel_yaml(scenario, at);
  out += fmt::format(
      "head:\n  T_body_head: {}\n  panorama: {{width: 8000, height: 4000, stitching_radius_m: 20}}\n  lenses:\n",
      transform(rig.T_body_head));
  for (std::size_t i = 0; i < rig.lenses.size(); ++i)
    out += lens_yaml(rig, i, scenario.camera.shutter == sim::ShutterKind::Rolling ? scenario.camera.row_time_us : 0);
  out += fmt::format("\ncolouring:\n  method: {}\n  exposure_interval_s: {}\n\ncloud:\n  crs: utm\n", method,
                     1.0 / scenario.camera.rate_hz);
  // Who lets the head drift wants to know whether it is noticed.
  if (scenario.camera.drift.is_there()) out += "\nwatch: {images_per_s: 2}\n";
  return out;
}

}  // namespace hueline::apps
