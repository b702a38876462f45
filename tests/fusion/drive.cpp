#include "tests/fusion/drive.hpp"

#include <cmath>
#include <functional>
#include <numbers>
#include <utility>

namespace hueline::test {
using std::numbers::pi;
namespace {
constexpr double kBaseLatitude = 48.1374, kBaseLongitude = 11.5755, kBaseHeight = 563.0;  // degrees, m

GeographicLib::LocalCartesian level_at(const Geodetic& g) {
  return {g.latitude * 180 / pi, g.longitude * 180 / pi, g.ellipsoidal_height};
}
Matrix3 from_rows(const std::vector<double>& m) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(m.data());
}
}  // namespace

Matrix3 paper_enu_from_imu(double phi, double omega, double kappa) {
  const double cp = std::cos(phi), sp = std::sin(phi), co = std::cos(omega), so = std::sin(omega), ck = std::cos(kappa),
               sk = std::sin(kappa);
  Matrix3 R_imu_enu;
  R_imu_enu << cp * ck + sp * so * sk, -cp * sk + sp * so * ck, -sp * co,  //
      co * sk, co * ck, so,                                                //
      sp * ck - cp * so * sk, -sp * sk - cp * so * ck, cp * co;
  return R_imu_enu.transpose();
}

Vector3 Motion::position(double t) const {
  const double r = speed / turn_rate, a = turn_rate * t;
  return {r * (1 - std::cos(a)), r * std::sin(a), 2.0 + shake * 0.05 * std::sin(2 * pi * 1.5 * t)};
}
Vector3 Motion::velocity(double t) const {
  const double a = turn_rate * t;
  return {speed * std::sin(a), speed * std::cos(a), shake * 0.05 * 2 * pi * 1.5 * std::cos(2 * pi * 1.5 * t)};
}
Matrix3 Motion::R_base_body(double t) const {
  return paper_enu_from_imu(shake * 0.03 * std::sin(2 * pi * 1.2 * t), shake * 0.02 * std::sin(2 * pi * 1.7 * t + 1),
                            turn_rate * t + shake * 0.01 * std::sin(2 * pi * 0.9 * t));
}

Drive::Drive(const Motion& motion) : motion_(motion), base_(kBaseLatitude, kBaseLongitude, kBaseHeight) {}

InsSolution Drive::solution(double t) const {
  const Vector3 p = motion_.position(t);
  double lat, lon, h;
  std::vector<double> m(9);
  base_.Reverse(p.x(), p.y(), p.z(), lat, lon, h, m);
  const Matrix3 R_local_base = from_rows(m).transpose();  // GeographicLib: v_base = M v_local
  const Matrix3 R = R_local_base * motion_.R_base_body(t);
  InsSolution s;
  s.sensor = 1;
  s.time = at(t);
  s.position = {lat * pi / 180, lon * pi / 180, h};
  s.velocity_enu = R_local_base * motion_.velocity(t);
  s.attitude.pitch = std::asin(R(2, 1));
  s.attitude.heading = std::atan2(R(0, 1), R(1, 1));
  s.attitude.roll = std::atan2(-R(2, 0), R(2, 2));
  s.is_good = true;
  s.sigma = std::array<double, 9>{0.01, 0.01, 0.02, 0.01, 0.01, 0.01, 1e-4, 1e-4, 2e-4};
  return s;
}

Vector3 Drive::point_in(const Geodetic& origin, const Vector3& p_base) const {
  double lat, lon, h;
  base_.Reverse(p_base.x(), p_base.y(), p_base.z(), lat, lon, h);
  Vector3 p;
  level_at(origin).Forward(lat, lon, h, p.x(), p.y(), p.z());
  return p;
}

void Drive::pose_in(const Geodetic& origin, double t, Matrix3& R, Vector3& p) const {
  const Vector3 p_base = motion_.position(t);
  p = point_in(origin, p_base);
  // The columns are differences of exact points 1 km away: a rotation between two local levels that shares no formula
  // with core/.
  const Matrix3 R_base_body = motion_.R_base_body(t);
  for (int i = 0; i < 3; ++i) R.col(i) = (point_in(origin, p_base + 1000.0 * R_base_body.col(i)) - p) / 1000.0;
}

LaserReturn Drive::hit(const Vector3& p_base, double t, double batch_t, const fusion::LaserMount& mount) const {
  const Vector3 p_body = motion_.R_base_body(t).transpose() * (p_base - motion_.position(t));
  const Vector3 p_scanner =
      mount.T_body_scanner.rotation.toRotationMatrix().transpose() * (p_body - mount.T_body_scanner.translation);
  LaserReturn r;
  r.x = static_cast<float>(p_scanner.x());
  r.y = static_cast<float>(p_scanner.y());
  r.z = static_cast<float>(p_scanner.z());
  r.range_m = static_cast<float>(p_scanner.norm());
  r.time_offset_ns = static_cast<std::int32_t>((at(t) - at(batch_t)).count());
  return r;
}

fusion::RigGeometry ladybug_rig(fusion::LensModel model) {
  using namespace fusion;
  RigGeometry rig;
  LaserMount laser;
  laser.sensor = kLaser;
  laser.T_body_scanner.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Vector3(0.2, 1, -0.4).normalized()));
  laser.T_body_scanner.translation = {0.3, -0.8, 0.5};
  rig.lasers.push_back(laser);
  // Head: x forward, y left; Body: x right, y forward. A yaw of 90 degrees and a small boresight error.
  rig.head.T_body_head.rotation =
      Eigen::Quaterniond(Eigen::AngleAxisd(pi / 2, Vector3::UnitZ()) * Eigen::AngleAxisd(0.02, Vector3::UnitY()));
  rig.head.T_body_head.translation = {0.1, 0.2, 1.0};
  for (int i = 0; i < 6; ++i) {
    LensMount lens;
    lens.name = "lens" + std::to_string(i);
    const double yaw = -2 * pi * i / 5;  // clockwise from forward, as a Ladybug counts
    const Vector3 axis = i < 5 ? Vector3(std::cos(yaw), std::sin(yaw), 0) : Vector3::UnitZ();
    const Vector3 down = i < 5 ? Vector3(-Vector3::UnitZ()) : Vector3(-Vector3::UnitX());
    Matrix3 R_head_lens;  // columns: right, down, axis
    R_head_lens << down.cross(axis), down, axis;
    lens.T_head_lens.rotation = Eigen::Quaterniond(R_head_lens);
    lens.T_head_lens.translation = 0.06 * axis;
    CameraIntrinsics& k = lens.intrinsics;
    k.model = model;
    k.width = 306;
    k.height = 256;
    if (model == LensModel::Brown) {
      k.focal_px = {112, 113};
      k.distortion = {-0.02, 0.004, 0.0005, -0.0003, -0.0002};
      k.max_angle = 1.2;
    } else {
      k.focal_px = {100, 101};
      k.distortion = {-0.03, 0.004, -0.001, 0.0002, 0};
      k.max_angle = 1.5;
    }
    k.principal_point_px = {152.3 + i, 127.1 - i};
    lens.camera = kCamera;
    lens.y_offset = static_cast<std::uint32_t>(256 * i);
    rig.head.lenses.push_back(lens);
  }
  return rig;
}

Image make_image(std::uint32_t width, std::uint32_t height, PixelFormat format,
                 const std::function<double(std::uint32_t, std::uint32_t, int)>& colour) {
  const bool is_rgb = format == PixelFormat::Rgb8;
  std::vector<std::byte> bytes;
  bytes.reserve(static_cast<std::size_t>(width) * height * (is_rgb ? 3 : 1));
  const auto put = [&](std::uint32_t x, std::uint32_t y, int channel) {
    bytes.push_back(
        static_cast<std::byte>(static_cast<std::uint8_t>(std::lround(std::clamp(colour(x, y, channel), 0.0, 255.0)))));
  };
  // The colour of the pixel at (x mod 2, y mod 2), as the formats' names spell the first two rows.
  const auto channel_of = [&](std::uint32_t x, std::uint32_t y) {
    const char* cells = format == PixelFormat::BayerRG8   ? "RGGB"
                        : format == PixelFormat::BayerBG8 ? "BGGR"
                        : format == PixelFormat::BayerGR8 ? "GRBG"
                                                          : "GBRG";
    const char c = cells[2 * (y % 2) + x % 2];
    return c == 'R' ? 0 : c == 'G' ? 1 : 2;
  };
  for (std::uint32_t y = 0; y < height; ++y) {
    for (std::uint32_t x = 0; x < width; ++x) {
      if (is_rgb) {
        for (int c = 0; c < 3; ++c) put(x, y, c);
      } else {
        put(x, y, format == PixelFormat::Mono8 ? 1 : channel_of(x, y));
      }
    }
  }
  Image image;
  image.sensor = kCamera;
  image.width = width;
  image.height = height;
  image.stride = width * (is_rgb ? 3 : 1);
  image.format = format;
  image.is_complete = true;
  image.buffer = Buffer::copy_of(bytes);
  return image;
}

Exposure make_exposure(std::uint32_t index, double t, const Image& image) {
  Exposure e;
  e.camera = kCamera;
  e.index = index;
  e.exposure_mid = at(t);
  e.sigma = nanoseconds(1000);
  e.state = SyncState::Locked;
  e.timing = ExposureTiming::EventMark;
  e.image = image;
  return e;
}

std::vector<StampedLaserBatch> scan(const Drive& drive, const fusion::LaserMount& mount, double from, double to,
                                    double packet_rate, int per_batch, std::vector<Vector3>* truth_base) {
  std::vector<StampedLaserBatch> batches;
  std::uint64_t random = 88172645463325252ULL;
  const auto uniform = [&] {
    random ^= random << 13;
    random ^= random >> 7;
    random ^= random << 17;
    return static_cast<double>(random >> 11) * 0x1p-53;
  };
  const auto packets = static_cast<int>(std::floor((to - from) * packet_rate));
  for (int i = 0; i < packets; ++i) {
    const double t0 = from + i / packet_rate;
    StampedLaserBatch batch;
    batch.sensor = mount.sensor;
    batch.packet_sequence = static_cast<std::uint64_t>(i);
    batch.time = at(t0);
    batch.sigma = nanoseconds(500);
    batch.state = SyncState::Locked;
    for (int j = 0; j < per_batch; ++j) {
      const double t = t0 + 1.3e-3 * j / per_batch;
      const Vector3 here = drive.motion().position(t);
      const double side = uniform();
      Vector3 p;
      if (side < 0.5) {
        p = {here.x() + 30 * (uniform() - 0.5), here.y() + 30 * (uniform() - 0.5), 0};  // the road, 2 m under the IMU
      } else {
        p = {here.x() + (side < 0.75 ? -9.0 : 11.0), here.y() + 60 * (uniform() - 0.5), 8 * uniform()};
      }
      batch.returns.push_back(drive.hit(p, t, t0, mount));
      batch.returns.back().channel = static_cast<std::uint16_t>(j % 16);
      if (truth_base) truth_base->push_back(p);
    }
    batches.push_back(std::move(batch));
  }
  return batches;
}

bool project_truth(const fusion::LensMount& lens, const Vector3& p_head, Eigen::Vector2d& pixel) {
  const Matrix3 R_head_lens = lens.T_head_lens.rotation.toRotationMatrix();
  const Vector3 p = R_head_lens.transpose() * (p_head - lens.T_head_lens.translation);
  const auto& k = lens.intrinsics;
  const double theta = std::acos(p.z() / p.norm());
  if (theta > k.max_angle) return false;
  double x, y;
  if (k.model == fusion::LensModel::Brown) {
    const double a = p.x() / p.z(), b = p.y() / p.z(), r2 = a * a + b * b;
    const auto& d = k.distortion;
    const double radial = 1 + d[0] * r2 + d[1] * std::pow(r2, 2) + d[4] * std::pow(r2, 3);
    x = a * radial + 2 * d[2] * a * b + d[3] * (r2 + 2 * a * a);
    y = b * radial + d[2] * (r2 + 2 * b * b) + 2 * d[3] * a * b;
  } else {
    double distorted = theta;
    for (int i = 0; i < 4; ++i) distorted += k.distortion[static_cast<std::size_t>(i)] * std::pow(theta, 3 + 2 * i);
    const double turn = std::atan2(p.y(), p.x());
    x = distorted * std::cos(turn);
    y = distorted * std::sin(turn);
  }
  pixel = {k.focal_px.x() * x + k.principal_point_px.x(), k.focal_px.y() * y + k.principal_point_px.y()};
  // The nearest pixel is none of the border's, but for the difference of two calculations.
  const Eigen::Array2d last(k.width - 1.0, k.height - 1.0);
  return (pixel.array() > 0.49).all() && (pixel.array() < last - 0.49).all();
}

}  // namespace hueline::test
