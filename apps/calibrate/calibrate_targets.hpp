#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "calibration/targets/station_orientation.hpp"
#include "core/calendar.hpp"
#include "storage/scan_cloud_writer.hpp"
#include "storage/scan_file.hpp"

namespace hueline::apps {

/// The blocks of a scan file, in the form that the calibration reads. `file` must outlive this object.
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

/// Counts of write_oriented().
struct OrientedCloud {
  std::uint64_t written = 0, without_return = 0;  ///< points at 0 0 0 or not a number are left out
};

/// Writes the whole scan in the survey frame, block by block. `origin` is subtracted in a float32 file and is the
/// offset of a LAS file. Errors: those of the scan and of the writer.
Result<OrientedCloud> write_oriented(const storage::ScanFile& scan, const calibration::Orientation& orientation,
                                     const Eigen::Vector3d& origin, storage::ScanCloudWriter::Format format,
                                     const std::filesystem::path& path, const UtcTime& date);

}  // namespace hueline::apps
