#pragma once

#include <stop_token>
#include <string>

#include "sim/generate.hpp"
#include "sim/visibility.hpp"

/// sights.bin, little-endian, no padding: which exposures truly saw each return of truth.bin, in its order.
///   8 bytes "HLSIGHT1"; u32 number of exposures N of the drive; u8 number of exposures asked for a packet K = min(9,
///   N); u8[3] 0 then packets until the end of the file; each: u32 number of the first of the K exposures nearest in
///   time to the packet's first firing; u32 number of returns n; n x u16: bit k is set if some lens saw the return at
///   exposure first + k
namespace hueline::sim {

constexpr char kSightMagic[] = "HLSIGHT1";
constexpr std::uint32_t kSightExposures = 9;

/// Asks the world for every return of a generated drive (sim/visibility.hpp) and writes `path`. The bytes do not depend
/// on `threads`. Errors: Io, Malformed (truth.bin), Stopped.
Status write_sights(const Scenario& scenario, const Drive& drive, const std::string& path,
                    const Progress& progress = {}, const GenerateOptions& options = {});

}  // namespace hueline::sim
