#include <cmath>

#include "apps/calibrate/calibrate_targets.hpp"

namespace hueline::apps {

Result<OrientedCloud> write_oriented(const storage::ScanFile& scan, const calibration::Orientation& orientation,
                                     const Eigen::Vector3d& origin, storage::ScanCloudWriter::Format format,
                                     const std::filesystem::path& path, const UtcTime& date) {
  auto writer = storage::ScanCloudWriter::create(path, format, {origin.x(), origin.y(), origin.z()}, date);
  if (!writer.ok()) return writer.error();
  const Eigen::Matrix3d M = orientation.scale * orientation.T_survey_scanner.rotation.toRotationMatrix();
  const Eigen::Vector3d t = orientation.T_survey_scanner.translation - origin;
  OrientedCloud counts;
  std::vector<std::byte> scratch;
  std::vector<double> turned;
  for (std::size_t i = 0; i < scan.blocks(); ++i) {
    const auto xyz = scan.block(i, scratch);
    if (!xyz.ok()) return xyz.error();
    turned.resize(xyz->size());
    std::size_t kept = 0;
    for (std::size_t k = 0; k < xyz->size(); k += 3) {
      const double x = (*xyz)[k], y = (*xyz)[k + 1], z = (*xyz)[k + 2];
      const double squared = x * x + y * y + z * z;
      if (!(squared > 0) || !std::isfinite(squared)) continue;
      turned[kept] = M(0, 0) * x + M(0, 1) * y + M(0, 2) * z + t.x();
      turned[kept + 1] = M(1, 0) * x + M(1, 1) * y + M(1, 2) * z + t.y();
      turned[kept + 2] = M(2, 0) * x + M(2, 1) * y + M(2, 2) * z + t.z();
      kept += 3;
    }
    counts.written += kept / 3;
    counts.without_return += (xyz->size() - kept) / 3;
    if (Status done = writer->append(std::span(turned).first(kept)); !done.ok()) return done.error();
  }
  if (Status done = writer->close(); !done.ok()) return done.error();
  return counts;
}

}  // namespace hueline::apps
