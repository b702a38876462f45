#include "apps/panorama/import_tables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <system_error>
#include <utility>

#include "core/angle.hpp"
#include "core/calendar.hpp"
#include "core/output_file.hpp"
#include "core/portable_math.hpp"
#include "storage/las_writer.hpp"
#include "survey/panorama_table.hpp"

namespace hueline::apps {
namespace {

constexpr std::string_view kOrbitHead = "Filename\tX/Long\tY/Lat\tZ\tPan\tTilt\tRoll\tTimestamp\r\n";
constexpr double kStep = 1e-6;  // rad of latitude, 6 m: from there to here the map's north is found

Eigen::Vector3d vector_of(const std::array<double, 3>& values) { return {values[0], values[1], values[2]}; }

}  // namespace

Status PanoramaTables::set_map(const survey::DrivePanorama& first) {
  auto operation = storage::MapOperation::create(first.origin, map_, storage::decimal_year(to_utc(first.time)));
  if (!operation) return operation.error();
  operation_ = std::move(*operation);
  own_ = survey::panorama_table_head(operation_->unit().name, operation_->up_unit().name);
  navvis_ =
      "# pano poses v1.0: ID; filename; timestamp; pano_pos_x; pano_pos_y; pano_pos_z; pano_ori_w; pano_ori_x; "
      "pano_ori_y; pano_ori_z\n";
  pointerra_ =
      "Timestamp,Filename,Origin Easting,Origin Northing,Origin Height,Direction East,Direction North,Direction "
      "Height,Up East,Up North,Up Height,Roll[deg],Pitch[deg],Yaw[deg],Omega[deg],Phi[deg],Kappa[deg]\n";
  return {};
}

Status PanoramaTables::add(const survey::DrivePanorama& one, const std::string& name, bool is_clockwise) {
  if (!operation_)
    if (Status set = set_map(one); !set) return set;
  const Eigen::Vector3d place = vector_of(operation_->apply(one.centre));
  own_ += survey::panorama_table_line(one, name, place);
  if (!is_clockwise) return {};
  Geodetic north = one.centre;
  north.latitude += kStep;
  const Eigen::Vector3d along = vector_of(operation_->apply(north)) - place;
  // Directions on the map are turned by the convergence of the meridians.
  const Attitude on_map{one.roll, one.pitch, one.heading + portable::atan2(along.x(), along.y())};
  Eigen::Matrix3d R_body_view;  // the view's axes are forward, left and up
  R_body_view << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  Eigen::Quaterniond q = rotation_enu_body(on_map) * Eigen::Quaterniond(R_body_view);
  if (q.w() < 0) q.coeffs() *= -1;
  const double unix_s = static_cast<double>(count_ns(to_unix(one.time)) / 1000) * 1e-6;
  navvis_ += fmt::format("{}; {}; {:.6f}; {:.6f}; {:.6f}; {:.6f}; {:.9f}; {:.9f}; {:.9f}; {:.9f}\n", one.exposure, name,
                         unix_s, place.x(), place.y(), place.z(), q.w(), q.x(), q.y(), q.z());
  const Eigen::Vector3d forward = q * Eigen::Vector3d::UnitX(), up = q * Eigen::Vector3d::UnitZ();
  double yaw = on_map.heading / kRadPerDeg;
  yaw -= 360 * std::floor(yaw / 360);
  pointerra_ += fmt::format(
      "{:.6f},{},{:.4f},{:.4f},{:.4f},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f},{:.5f},{:.5f},"
      "{:.5f},,,\n",
      unix_s, name, place.x(), place.y(), place.z(), forward.x(), forward.y(), forward.z(), up.x(), up.y(), up.z(),
      one.roll / kRadPerDeg, one.pitch / kRadPerDeg, yaw);
  // Orbit does not publish the signs of tilt and roll; those of a level panorama are 0.
  if (one.is_level)
    orbit_ +=
        fmt::format("{}\t{:.4f}\t{:.4f}\t{:.4f}\t{:.5f}\t0\t0\t{:.6f}\r\n", std::filesystem::path(name).stem().string(),
                    place.x(), place.y(), place.z(), yaw, static_cast<double>(count_ns(one.time) / 1000) * 1e-6);
  const UtcTime utc = to_utc(one.time);
  mapillary_ += fmt::format(
      "{}\n{{\"filename\":\"{}\",\"filetype\":\"image\",\"MAPLatitude\":{:.10f},\"MAPLongitude\":{:.10f},"
      "\"MAPCaptureTime\":\"{:04}_{:02}_{:02}_{:02}_{:02}_{:02}_{:03}\",\"MAPCompassHeading\":{{\"TrueHeading\":{:.4f},"
      "\"MagneticHeading\":{:.4f}}},\"MAPGPSAccuracyMeters\":{:.4f}}}",
      mapillary_.empty() ? "" : ",", name, one.centre.latitude / kRadPerDeg, one.centre.longitude / kRadPerDeg,
      utc.year, utc.month, utc.day, utc.hour, utc.minute, std::min(utc.second, 59),  // Python has no leap second
      utc.nanosecond / 1'000'000, one.heading / kRadPerDeg, one.heading / kRadPerDeg, one.sigma_horizontal_m);
  return {};
}

Status PanoramaTables::write(const std::filesystem::path& folder) const {
  const bool is_read = !mapillary_.empty();
  using Table = std::pair<const char*, std::string>;
  for (const auto& [name, text] :
       {Table("panoramas.csv", own_.empty() ? survey::panorama_table_head() : own_),
        Table("pano-poses.csv", is_read ? navvis_ : ""), Table("pointerra.csv", is_read ? pointerra_ : ""),
        Table("orbit.txt", orbit_.empty() ? "" : std::string(kOrbitHead) + orbit_),
        Table("mapillary_image_description.json", is_read ? "[" + mapillary_ + "\n]\n" : "")}) {
    Status done;
    if (!text.empty())
      done = write_output(folder / name, text);
    else if (std::error_code error; std::filesystem::remove(folder / name, error), error)  // of earlier panoramas
      done = output_error("remove " + (folder / name).string(), error.value());
    if (!done) return done;
  }
  return {};
}

}  // namespace hueline::apps
