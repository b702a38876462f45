#include <fmt/format.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <span>
#include <utility>

#include "core/calendar.hpp"
#include "core/json_text.hpp"
#include "core/printable.hpp"
#include "core/utc_text.hpp"
#include "products/trajectory_export.hpp"

namespace hueline::products {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// Returns whether the way from one longitude to the next one, in degrees, leads across the date line.
bool crosses_date_line(double from, double to) { return std::abs(to - from) > 180; }

/// Returns the time as XML has it, which knows no leap second: it is the second before it once more.
std::string xml_time(GpsTime time) {
  std::string out = utc_text(time);
  constexpr std::size_t kSecond = 17;  // where its two digits are
  if (out.compare(kSecond, 2, "60") == 0) out.replace(kSecond, 2, "59");
  return out;
}

class Csv : public TrajectoryFile {
 public:
  explicit Csv(storage::FileWriter file) : TrajectoryFile(std::move(file)) {}

 private:
  void begin(std::string& out) override {
    out +=
        "gps_week,gps_second,utc,latitude_deg,longitude_deg,ellipsoidal_height_m,velocity_east_m_s,velocity_north_m_s,"
        "velocity_up_m_s,roll_deg,pitch_deg,heading_deg,sigma_east_m,sigma_north_m,sigma_up_m,sigma_roll_deg,"
        "sigma_pitch_deg,sigma_heading_deg\n";
  }
  void put(const TrajectoryRow& row, std::string& out) override {
    const GpsWeekTime gps = to_gps_week(row.time);
    out += fmt::format("{},{:.6f},{},{:.10f},{:.10f},{:.4f},{:.4f},{:.4f},{:.4f},{:.5f},{:.5f},{:.5f}", gps.week,
                       to_seconds(gps.time_of_week), utc_text(row.time), row.position.latitude / kDegree,
                       row.position.longitude / kDegree, row.position.ellipsoidal_height, row.velocity_enu.x(),
                       row.velocity_enu.y(), row.velocity_enu.z(), row.attitude.roll / kDegree,
                       row.attitude.pitch / kDegree, row.attitude.heading / kDegree);
    for (const double sigma : row.sigma_position) out += fmt::format(",{:.4f}", sigma);
    for (const double sigma : row.sigma_attitude) out += fmt::format(",{:.5f}", sigma / kDegree);
    out += '\n';
  }
  Status end(std::string&) override { return {}; }
};

class Gpx : public TrajectoryFile {
 public:
  Gpx(storage::FileWriter file, std::string name) : TrajectoryFile(std::move(file)), name_(std::move(name)) {}

 private:
  void begin(std::string& out) override {
    out += fmt::format(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<gpx version=\"1.1\" creator=\"hueline\" "
        "xmlns=\"http://www.topografix.com/GPX/1/1\">\n<trk><name>{}</name><trkseg>\n",
        name_);
  }
  // Without heights, as in KML: programs take those of GPX for heights above the sea.
  void put(const TrajectoryRow& row, std::string& out) override {
    const double longitude = row.position.longitude / kDegree;
    if (row.is_behind_gap || (!is_first() && crosses_date_line(longitude_, longitude))) out += "</trkseg><trkseg>\n";
    out += fmt::format("<trkpt lat=\"{:.9f}\" lon=\"{:.9f}\"><time>{}</time></trkpt>\n",
                       row.position.latitude / kDegree, longitude, xml_time(row.time));
    longitude_ = longitude;
  }
  Status end(std::string& out) override {
    out += "</trkseg></trk>\n</gpx>\n";
    return {};
  }
  std::string name_;
  double longitude_ = 0;  // of the row before, in degrees
};

class Kml : public TrajectoryFile {
 public:
  Kml(storage::FileWriter file, std::string name) : TrajectoryFile(std::move(file)), name_(std::move(name)) {}

 private:
  // Without heights: those of KML are above the sea, and these would be above the ellipsoid.
  void begin(std::string& out) override {
    out += fmt::format(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<kml xmlns=\"http://www.opengis.net/kml/2.2\"><Document><name>{0}"
        "</name>\n",
        name_);
    begin_line(out);
  }
  void put(const TrajectoryRow& row, std::string& out) override {
    const double longitude = row.position.longitude / kDegree, latitude = row.position.latitude / kDegree;
    // Programs draw a line from 180 to -180 degrees around the earth, so it is cut at the date line.
    if (row.is_behind_gap) {
      end_line(out);
      begin_line(out);
    } else if (!is_first() && crosses_date_line(longitude_, longitude)) {
      const double edge = longitude_ > 0 ? 180 : -180, before = std::abs(edge - longitude_),
                   after = std::abs(edge + longitude), share = before + after > 0 ? before / (before + after) : 0;
      const double at = latitude_ + share * (latitude - latitude_);
      out += fmt::format("{:.9f},{:.9f}\n", edge, at);
      end_line(out);
      begin_line(out);
      out += fmt::format("{:.9f},{:.9f}\n", -edge, at);
    }
    out += fmt::format("{:.9f},{:.9f}\n", longitude, latitude);
    longitude_ = longitude;
    latitude_ = latitude;
  }
  Status end(std::string& out) override {
    end_line(out);
    out += "</Document></kml>\n";
    return {};
  }
  void begin_line(std::string& out) const {
    out += fmt::format("<Placemark><name>{}</name><LineString><tessellate>1</tessellate><coordinates>\n", name_);
  }
  static void end_line(std::string& out) { out += "</coordinates></LineString></Placemark>\n"; }

  std::string name_;
  double longitude_ = 0, latitude_ = 0;  // of the row before, in degrees
};

/// One Feature for each row, so that each has its time and attitude and nothing has to be held until the end.
class GeoJson : public TrajectoryFile {
 public:
  /// `name` is JSON.
  GeoJson(storage::FileWriter file, std::string name) : TrajectoryFile(std::move(file)), name_(std::move(name)) {}

 private:
  void begin(std::string& out) override {
    out += fmt::format("{{\"type\":\"FeatureCollection\",\"name\":{},\"features\":[\n", name_);
  }
  void put(const TrajectoryRow& row, std::string& out) override {
    out += fmt::format(
        "{}{{\"type\":\"Feature\",\"geometry\":{{\"type\":\"Point\",\"coordinates\":[{:.9f},{:.9f},{:.3f}]}},"
        "\"properties\":{{\"time\":\"{}\",\"roll_deg\":{:.4f},\"pitch_deg\":{:.4f},\"heading_deg\":{:.4f},"
        "\"sigma_m\":{:.4f}}}}}",
        is_first() ? "" : ",\n", row.position.longitude / kDegree, row.position.latitude / kDegree,
        row.position.ellipsoidal_height, utc_text(row.time), row.attitude.roll / kDegree, row.attitude.pitch / kDegree,
        row.attitude.heading / kDegree, row.sigma_position.norm());
  }
  Status end(std::string& out) override {
    out += "\n]}\n";
    return {};
  }
  std::string name_;
};

/// SBET and SMRMSG (drivers/trajectory/sbet_file.hpp has the records). The wander angle is 0, so velocities are north,
/// west and up. Accelerations, angular rates and the sigmas of velocities are 0: the trajectory does not have them.
class Sbet : public TrajectoryFile {
 public:
  Sbet(storage::FileWriter file, storage::FileWriter accuracies)
      : TrajectoryFile(std::move(file)), accuracies_(std::move(accuracies)) {}

 private:
  void begin(std::string&) override {}
  void put(const TrajectoryRow& row, std::string& out) override {
    // The seconds go on beyond the end of the week.
    const GpsWeekTime gps = to_gps_week(row.time);
    if (is_first()) week_ = gps.week;
    const double second = to_seconds(gps.time_of_week) + static_cast<double>((gps.week - week_) * kSecondsPerWeek);
    const auto add = [](std::string& to, std::span<const double> values) {
      to.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
    };
    const Eigen::Vector3d& v = row.velocity_enu;
    add(out, std::array{second, row.position.latitude, row.position.longitude, row.position.ellipsoidal_height, v.y(),
                        -v.x(), v.z(), row.attitude.roll, row.attitude.pitch, row.attitude.heading, 0.0, 0.0, 0.0, 0.0,
                        0.0, 0.0, 0.0});
    constexpr double kArcMinute = kDegree / 60;
    const Eigen::Vector3d &p = row.sigma_position, &a = row.sigma_attitude;
    add(rest_, std::array{second, p.y(), p.x(), p.z(), 0.0, 0.0, 0.0, a.x() / kArcMinute, a.y() / kArcMinute,
                          a.z() / kArcMinute});
    if (rest_.size() < 1 << 16 || !written_) return;
    written_ = accuracies_.write(storage::as_bytes(rest_));
    rest_.clear();
  }
  Status end(std::string&) override {
    if (written_) written_ = accuracies_.write(storage::as_bytes(rest_));
    return written_;
  }
  Status close_second() override { return accuracies_.close(); }
  storage::FileWriter accuracies_;
  std::string rest_;
  Status written_;
  int week_ = 0;
};

}  // namespace

Result<std::unique_ptr<TrajectoryFile>> TrajectoryFile::create(const std::filesystem::path& path,
                                                               const std::string& name) {
  const std::string ending = path.extension().string();
  const bool is_sbet = ending == ".out" || ending == ".sbet";
  if (!is_sbet && ending != ".csv" && ending != ".gpx" && ending != ".kml" && ending != ".geojson")
    return Error{ErrorCode::Invalid, path.string() + ": a trajectory is written as .out or .sbet (SBET with SMRMSG), " +
                                         ".csv, .gpx, .kml or .geojson; give a name that ends so"};
  auto file = storage::FileWriter::replace(path);
  if (!file) return file.error();
  std::unique_ptr<TrajectoryFile> out;
  if (is_sbet) {
    auto accuracies = storage::FileWriter::replace(std::filesystem::path(path).replace_extension(".smrmsg"));
    if (!accuracies) return accuracies.error();
    out = std::make_unique<Sbet>(std::move(*file), std::move(*accuracies));
  } else if (ending == ".csv") {
    out = std::make_unique<Csv>(std::move(*file));
  } else if (ending == ".gpx") {
    out = std::make_unique<Gpx>(std::move(*file), as_markup(printable(name)));
  } else if (ending == ".kml") {
    out = std::make_unique<Kml>(std::move(*file), as_markup(printable(name)));
  } else {
    out = std::make_unique<GeoJson>(std::move(*file), json_text(name));
  }
  out->begin(out->buffer_);
  return out;
}

Status TrajectoryFile::add(const TrajectoryRow& row) {
  put(row, buffer_);
  ++rows_;
  return buffer_.size() < 1 << 16 ? Status{} : flush();
}

Status TrajectoryFile::flush() {
  const Status written = file_.write(storage::as_bytes(buffer_));
  buffer_.clear();
  return written;
}

Status TrajectoryFile::close() {
  Status done = end(buffer_);
  if (done) done = flush();
  if (done) done = close_second();
  if (done) done = file_.close();
  return done;
}

}  // namespace hueline::products
