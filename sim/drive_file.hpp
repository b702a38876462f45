#pragma once

#include <string>

#include "core/result.hpp"
#include "sim/drive.hpp"

/// drive.bin of the cache: a Drive without its images. The file is little-endian and holds "HLDRIVE2", then the members
/// in their order; a u32 or u64 count stands before each vector. Only this project reads it; the fingerprint of a
/// scenario covers the revision that wrote it.
namespace hueline::sim {

constexpr char kDriveMagic[] = "HLDRIVE2";

/// Writes `drive` to `path`. Errors: Io.
Status write_drive(const Drive& drive, const std::string& path);
/// Reads a drive and sets `cache_dir` to the folder of the file. Errors: Io, Malformed.
Result<Drive> read_drive(const std::string& path);

}  // namespace hueline::sim
