#pragma once

#include <filesystem>
#include <string_view>

#include "core/result.hpp"

/// Recordings whose files are compressed as a whole, as rosbag2 does with --compression-mode file.
namespace hueline::rosbag {

/// Returns whether a file's name is that of a recording (.db3, .mcap, .bag) which is packed with Zstandard (.zstd as
/// rosbag2 names it, .zst).
bool is_packed_name(std::string_view name);

/// Makes a recording that open_bag() reads: unpacks a packed file, or those of a folder, into `folder`, where a link to
/// each of the others is made. Returns its path, or `recording` itself if nothing of it is packed or if it does not
/// lie on this computer. A file may have 64 times its size unpacked, and 8 GB at least. Errors: Io; Truncated and
/// Malformed for a packed file that is cut or damaged.
Result<std::filesystem::path> unpacked_recording(const std::filesystem::path& recording,
                                                 const std::filesystem::path& folder);

}  // namespace hueline::rosbag
