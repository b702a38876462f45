#pragma once

#include <string>

#include "core/result.hpp"
#include "sim/drive.hpp"

/// drive.bin of the cache: a Drive without its images. Little-endian: "HLDRIVE2", the members in their order, vectors
/// with a u32 or u64 count before them. Private to the cache: a scenario's fingerprint covers the revision that wrote
/// it.
namespace hueline::sim {

constexpr char kDriveMagic[] = "HLDRIVE2";

Status write_drive(const Drive& drive, const std::string& path);
/// cache_dir is set to the file's folder. Errors: Io, Malformed.
Result<Drive> read_drive(const std::string& path);

}  // namespace hueline::sim
