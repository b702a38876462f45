#include "fusion/georeference.hpp"

#include <algorithm>
#include <cmath>

namespace hueline::fusion {
namespace {

/// T_enu_scanner as three rows of four numbers, with variances.
struct Placement {
  std::array<double, 12> rows{};
  double variance_position = 0, variance_angle = 0;  // m^2, rad^2
  Leap leapt;
  NoPose reason = NoPose::None;
};

Placement placement_at(GpsTime time, double sigma_time_s, const LaserMount& mount, const Trajectory& trajectory) {
  Placement placement;
  const auto [pose, reason] = trajectory.pose_at(time);
  placement.reason = reason;
  if (!pose) return placement;
  const Transform<Enu, Scanner> T_enu_scanner = pose->T_enu_body * mount.T_body_scanner;
  const Eigen::Matrix3d R = T_enu_scanner.rotation.toRotationMatrix();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column)
      placement.rows[static_cast<std::size_t>(4 * row + column)] = R(row, column);
    placement.rows[static_cast<std::size_t>(4 * row + 3)] = T_enu_scanner.translation[row];
  }
  placement.leapt = pose->leapt;
  const double along = pose->velocity_enu.norm() * sigma_time_s;
  placement.variance_position =
      pose->sigma_position.squaredNorm() + along * along + mount.sigma_range_m * mount.sigma_range_m;
  // Each angle moves a point across the angle's axis, so on average two of the three components count.
  placement.variance_angle = pose->sigma_attitude.squaredNorm() * (2.0 / 3.0);
  return placement;
}

bool is_usable(const LaserReturn& r) {
  return r.range_m > 0 && std::isfinite(r.range_m) && std::isfinite(r.x) && std::isfinite(r.y) && std::isfinite(r.z);
}

/// Writes a return to the arrays at `place_index`; they must be long enough.
void put(const LaserReturn& r, std::uint32_t index, const Placement& a, const Placement& b, double s,
         std::size_t place_index, GeoreferencedBatch& out) {
  std::array<double, 3> place{};
  for (std::size_t row = 0; row < 3; ++row) {
    const std::size_t k = 4 * row;
    const auto element = [&](std::size_t i) { return a.rows[k + i] + s * (b.rows[k + i] - a.rows[k + i]); };
    place[row] = element(0) * r.x + element(1) * r.y + element(2) * r.z + element(3);
  }
  out.east[place_index] = place[0];
  out.north[place_index] = place[1];
  out.up[place_index] = place[2];
  out.places.x[place_index] = static_cast<float>(place[0] - out.scanner_enu.x());
  out.places.y[place_index] = static_cast<float>(place[1] - out.scanner_enu.y());
  out.places.z[place_index] = static_cast<float>(place[2] - out.scanner_enu.z());
  const double range = r.range_m;
  out.sigma_m[place_index] = static_cast<float>(std::sqrt(a.variance_position + range * range * a.variance_angle));
  out.source[place_index] = index;
}

}  // namespace

void georeference(const StampedLaserBatch& batch, const LaserMount& mount, const Trajectory& trajectory,
                  nanoseconds pose_step, GeoreferencedBatch& out) {
  const auto resize = [&out](std::size_t size) {
    out.east.resize(size);
    out.north.resize(size);
    out.up.resize(size);
    out.places.x.resize(size);
    out.places.y.resize(size);
    out.places.z.resize(size);
    out.sigma_m.resize(size);
    out.source.resize(size);
  };
  resize(batch.returns.size());
  out.scanner_enu.setZero();
  out.leapt = {};
  out.no_pose.fill(0);
  out.empty = 0;
  if (batch.returns.empty()) return;
  const auto [first_it, last_it] =
      std::minmax_element(batch.returns.begin(), batch.returns.end(),
                          [](const auto& a, const auto& b) { return a.time_offset_ns < b.time_offset_ns; });
  const std::int64_t first = first_it->time_offset_ns, span = last_it->time_offset_ns - first;
  // A batch is a packet of about a millisecond. For a batch of seconds the poses are farther apart, so that memory
  // stays bounded.
  const std::int64_t segments = std::clamp<std::int64_t>((span + pose_step.count() - 1) / pose_step.count(), 1, 4096);
  const double sigma_time_s = to_seconds(batch.sigma);
  const GpsTime start = batch.time + nanoseconds(first);
  thread_local std::vector<Placement> nodes;
  nodes.resize(static_cast<std::size_t>(segments) + 1);
  for (std::int64_t i = 0; i <= segments; ++i) {
    nodes[static_cast<std::size_t>(i)] =
        placement_at(start + nanoseconds(span * i / segments), sigma_time_s, mount, trajectory);
  }
  for (const Placement& node : nodes) {
    if (node.reason != NoPose::None) continue;
    out.scanner_enu = {node.rows[3], node.rows[7], node.rows[11]};
    out.leapt = node.leapt;
    break;
  }
  std::size_t placed = 0;
  for (std::uint32_t i = 0; i < batch.returns.size(); ++i) {
    const LaserReturn& r = batch.returns[i];
    if (!is_usable(r)) {
      ++out.empty;
      continue;
    }
    const std::int64_t offset = r.time_offset_ns - first;
    const std::int64_t segment = span > 0 ? std::min(offset * segments / span, segments - 1) : 0;
    const Placement &a = nodes[static_cast<std::size_t>(segment)], &b = nodes[static_cast<std::size_t>(segment) + 1];
    if (a.reason == NoPose::None && b.reason == NoPose::None) {
      const std::int64_t from = span * segment / segments, to = span * (segment + 1) / segments;
      put(r, i, a, b, to > from ? static_cast<double>(offset - from) / static_cast<double>(to - from) : 0.0, placed++,
          out);
      continue;
    }
    // The trajectory begins or ends inside this segment, so the pose of this firing itself is used.
    const Placement own = placement_at(batch.time + nanoseconds(r.time_offset_ns), sigma_time_s, mount, trajectory);
    if (own.reason == NoPose::None) {
      put(r, i, own, own, 0.0, placed++, out);
    } else {
      ++out.no_pose[static_cast<std::size_t>(own.reason)];
    }
  }
  resize(placed);
}

}  // namespace hueline::fusion
