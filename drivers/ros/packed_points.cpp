#include "drivers/ros/packed_points.hpp"

#include <fmt/format.h>
#include <libdeflate.h>
#include <zstd.h>

#include <algorithm>
#include <string>

#include "core/printable.hpp"
#include "drivers/inflater.hpp"

namespace hueline::drivers {
namespace {

bool unpack_deflate(std::span<const std::byte> packed, std::vector<std::byte>& out) {
  const Inflater inflater = make_inflater();
  if (!inflater) return false;
  const bool is_gzip = packed.size() > 1 && packed[0] == std::byte{0x1F} && packed[1] == std::byte{0x8B};
  const auto unpack = is_gzip ? libdeflate_gzip_decompress : libdeflate_zlib_decompress;
  std::size_t size = 0;
  const auto done = unpack(inflater.get(), packed.data(), packed.size(), out.data(), out.size(), &size);
  out.resize(size);
  return done == LIBDEFLATE_SUCCESS;
}

}  // namespace

Result<std::vector<std::byte>> unpacked_points(std::string_view format, std::span<const std::byte> packed,
                                               std::size_t most) {
  if (format != "zstd" && format != "zlib")
    return Error{ErrorCode::Unsupported,
                 fmt::format("its points are compressed as {}, which is not read; those of zstd and zlib are. "
                             "Publish the recording's clouds as sensor_msgs/PointCloud2 (point_cloud_transport, raw) "
                             "and record these",
                             printable(std::string(format)))};
  std::vector<std::byte> out;
  bool is_whole = false;
  if (format == "zstd") {
    const auto stated = ZSTD_getFrameContentSize(packed.data(), packed.size());
    if (stated != ZSTD_CONTENTSIZE_ERROR) {
      out.resize(stated < most ? static_cast<std::size_t>(stated) : most);  // not known is a large number
      const std::size_t size = ZSTD_decompress(out.data(), out.size(), packed.data(), packed.size());
      is_whole = ZSTD_isError(size) == 0;
      if (is_whole) out.resize(size);
    }
  } else {
    constexpr std::size_t kMostTimes = 1032;  // nothing gets smaller by deflate
    out.resize(std::min(most, packed.size() * kMostTimes));
    is_whole = unpack_deflate(packed, out);
  }
  if (!is_whole)
    return Error{ErrorCode::Malformed,
                 fmt::format("a point cloud whose {} is damaged, or has more points than it says", format)};
  return out;
}

}  // namespace hueline::drivers
