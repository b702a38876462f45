#include "calibration/boresight/boresight_report.hpp"

#include <utility>

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "core/angle.hpp"

namespace hueline::calibration {
namespace {

constexpr const char* kNames[] = {"turn_body_x_deg", "turn_body_y_deg", "turn_body_z_deg",
                                  "position_x_m",    "position_y_m",    "position_z_m"};
constexpr const char* kWords[] = {"rotation about x (right)", "rotation about y (forward)", "rotation about z (up)",
                                  "lever arm x (right)",      "lever arm y (forward)",      "lever arm z (up)"};

/// Returns the factor from rad and m to the printed unit.
double unit(std::size_t i) { return i < 3 ? 1 / kRadPerDeg : 1; }

}  // namespace

std::string boresight_text(const Boresight& found) {
  std::string out = fmt::format(
      "{} flat places seen in two passes or more ({} face across the path, {} along it, {} up), {} returns, {:.1f} mm "
      "rms from their planes\n",
      found.patches, found.facing[0], found.facing[1], found.facing[2], found.returns, found.rms_m * 1e3);
  if (!found.is_settled)
    out += fmt::format(
        "not converged after {} rounds: the last round still changed the result by more than a tenth of its sigma\n",
        found.rounds);
  for (const ScannerBoresight& one : found.scanners) {
    out += fmt::format(
        "{}: rotated by {:.4f} deg from the rig, lever arm moved by {:.1f} {:.1f} {:.1f} mm; {} returns, noise {:.2f} "
        "times that of the rig\n",
        one.name, one.boresight_rotation.norm() / kRadPerDeg, one.lever_moved_m.x() * 1e3, one.lever_moved_m.y() * 1e3,
        one.lever_moved_m.z() * 1e3, one.returns, one.unit_sigma);
    for (std::size_t i = 0; i < 6; ++i) {
      const std::string value =
          i < 3 ? "" : fmt::format("{:9.4f} ", one.T_body_scanner.translation[static_cast<Eigen::Index>(i - 3)]);
      out += fmt::format("  {:<27}{}+- {:.4f} {}", kWords[i], value, one.sigma[i] * unit(i), i < 3 ? "deg" : "m");
      out += fmt::format(", {:.0f} % from the data", 100 * one.share[i]);
      out += one.is_determined[i]
                 ? fmt::format("; without the POS's errors +- {:.4f}\n", one.sigma_without_pos[i] * unit(i))
                 : std::string(": NOT determined, stays as measured\n");
    }
  }
  return out;
}

CalibrationRecord boresight_record(const Boresight& found, std::size_t scanner, const std::string& date,
                                   std::vector<std::string> data) {
  const ScannerBoresight& one = found.scanners[scanner];
  CalibrationRecord out;
  out.method = "boresight";
  out.date = date;
  out.data = std::move(data);
  out.data.push_back(fmt::format("{} returns in {} planes seen in two passes or more", one.returns, found.patches));
  for (std::size_t i = 0; i < 6; ++i)
    if (!one.is_determined[i]) out.data.push_back(fmt::format("{} is not determined: as measured", kNames[i]));
  out.residual_rms = found.rms_m;
  out.residual_unit.assign(1, 'm');
  for (std::size_t i = 0; i < 6; ++i) {
    out.parameters.emplace_back(kNames[i]);
    out.sigma.push_back(one.sigma[i] * unit(i));
    for (std::size_t j = i; j < 6; ++j)
      out.covariance.push_back(
          found.covariance(static_cast<Eigen::Index>(6 * scanner + i), static_cast<Eigen::Index>(6 * scanner + j)) *
          unit(i) * unit(j));
  }
  return out;
}

std::string boresight_json(const Boresight& found) {
  nlohmann::ordered_json out;
  out["patches"] = found.patches;
  out["patches_facing"] = {{"across", found.facing[0]}, {"along", found.facing[1]}, {"up", found.facing[2]}};
  out["returns"] = found.returns;
  out["rms_m"] = found.rms_m;
  out["rounds"] = found.rounds;
  out["is_settled"] = found.is_settled;
  for (const ScannerBoresight& one : found.scanners) {
    nlohmann::ordered_json scanner;
    const auto& T = one.T_body_scanner;
    scanner["name"] = one.name;
    scanner["T_body_scanner"] = {{"position_m", {T.translation.x(), T.translation.y(), T.translation.z()}},
                                 {"quaternion_wxyz", {T.rotation.w(), T.rotation.x(), T.rotation.y(), T.rotation.z()}}};
    const Eigen::Vector3d boresight = one.boresight_rotation / kRadPerDeg;
    scanner["boresight_rotation_deg"] = {boresight.x(), boresight.y(), boresight.z()};
    scanner["lever_moved_m"] = {one.lever_moved_m.x(), one.lever_moved_m.y(), one.lever_moved_m.z()};
    for (std::size_t i = 0; i < 6; ++i)
      scanner["parameters"][kNames[i]] = {{"sigma", one.sigma[i] * unit(i)},
                                          {"sigma_without_pos_errors", one.sigma_without_pos[i] * unit(i)},
                                          {"share_from_data", one.share[i]},
                                          {"is_determined", bool(one.is_determined[i])}};
    scanner["returns"] = one.returns;
    scanner["noise_over_rig"] = one.unit_sigma;
    out["scanners"].push_back(scanner);
  }
  return out.dump(1) + "\n";
}

}  // namespace hueline::calibration
