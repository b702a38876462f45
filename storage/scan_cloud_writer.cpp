#include "storage/scan_cloud_writer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "core/calendar.hpp"

namespace hueline::storage {
namespace {

constexpr double kStep = 0.001;
constexpr std::size_t kRecord = 30;  // point format 6

}  // namespace

ScanCloudWriter::ScanCloudWriter(FileWriter file, Format format, const std::array<double, 3>& origin,
                                 const UtcTime& created)
    : file_(std::move(file)), format_(format) {
  header_.global_encoding = kLasWkt;
  header_.system_identifier = header_.generating_software = "hueline";
  header_.creation_year = created.year;
  header_.creation_day = day_of_year(created);
  header_.header_size = kLasHeaderSize14;
  header_.point_offset = kLasHeaderSize14;
  header_.point_format = 6;
  header_.point_size = kRecord;
  header_.scale = {kStep, kStep, kStep};
  header_.offset = origin;
  lowest_.fill(std::numeric_limits<std::int32_t>::max());
  highest_.fill(std::numeric_limits<std::int32_t>::min());
}

Result<ScanCloudWriter> ScanCloudWriter::create(const std::filesystem::path& path, Format format,
                                                const std::array<double, 3>& origin, const UtcTime& created) {
  auto file = FileWriter::replace(path);
  if (!file.ok()) return file.error();
  ScanCloudWriter writer(std::move(file).value(), format, origin, created);
  if (format == Format::Las)
    if (Status done = writer.file_.write(encode_las_header(writer.header_)); !done.ok()) return done.error();
  return writer;
}

Status ScanCloudWriter::append(std::span<const double> xyz_from_origin) {
  const std::size_t count = xyz_from_origin.size() / 3;
  if (format_ == Format::Float32) {
    buffer_.resize(4 * xyz_from_origin.size());
    auto* out = reinterpret_cast<float*>(buffer_.data());
    for (std::size_t i = 0; i < xyz_from_origin.size(); ++i) out[i] = static_cast<float>(xyz_from_origin[i]);
  } else {
    buffer_.assign(kRecord * count, std::byte{0});
    for (std::size_t i = 0; i < count; ++i) {
      std::byte* record = buffer_.data() + kRecord * i;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double steps = std::nearbyint(xyz_from_origin[3 * i + axis] / kStep);
        if (!(std::abs(steps) < 2147483647.0))
          return Error{ErrorCode::Invalid,
                       file_.path().string() + ": a point lies too far from the cloud's origin for LAS"};
        const auto stored = static_cast<std::int32_t>(steps);
        lowest_[axis] = std::min(lowest_[axis], stored);
        highest_[axis] = std::max(highest_[axis], stored);
        std::memcpy(record + 4 * axis, &stored, 4);
      }
      record[14] = std::byte{0x11};  // return 1 of 1
    }
    header_.points_by_return[0] += count;
  }
  header_.point_count += count;
  return file_.write(buffer_);
}

Status ScanCloudWriter::close() {
  if (format_ == Format::Las) {
    for (std::size_t axis = 0; axis < 3 && header_.point_count > 0; ++axis) {
      header_.minimum[axis] = lowest_[axis] * kStep + header_.offset[axis];
      header_.maximum[axis] = highest_[axis] * kStep + header_.offset[axis];
    }
    if (Status done = file_.overwrite(0, encode_las_header(header_)); !done.ok()) return done;
  }
  return file_.close();
}

}  // namespace hueline::storage
