#pragma once

#include <filesystem>
#include <optional>

#include "calibration/targets/station_orientation.hpp"
#include "core/calendar.hpp"
#include "storage/scan_cloud_writer.hpp"
#include "storage/scan_file.hpp"

namespace hueline::apps {

/// A file as the blocks that calibration reads.
class ScanFileBlocks : public calibration::ScanBlocks {
 public:
  explicit ScanFileBlocks(const storage::ScanFile& file) : file_(file) {}
  std::size_t blocks() const override { return file_.blocks(); }
  Result<std::span<const float>> block(std::size_t index, std::vector<std::byte>& scratch) const override {
    return file_.block(index, scratch);
  }

 private:
  const storage::ScanFile& file_;
};

/// What write_oriented() did with the points.
struct OrientedCloud {
  std::uint64_t written = 0, without_return = 0;  ///< 0 0 0 or not a number: left out
};

/// The whole scan in the survey frame, `origin` subtracted (float32) or as the file's offset (LAS). Reads block by
/// block.
Result<OrientedCloud> write_oriented(const storage::ScanFile& scan, const calibration::Orientation& orientation,
                                     const Eigen::Vector3d& origin, storage::ScanCloudWriter::Format format,
                                     const std::filesystem::path& path, const UtcTime& date);

}  // namespace hueline::apps
