#pragma once

#include <stop_token>
#include <string>

#include "sim/generate.hpp"
#include "sim/visibility.hpp"

/// sights.bin says for each return of truth.bin, in its order, which exposures truly saw it. Little-endian, no padding.
///
///   header
///     char[8]  "HLSIGHT1"
///     u32      number N of the drive's exposures
///     u8       number K of exposures that are checked for each packet, K = min(9, N)
///     u8[3]    0
///   packet, repeated until the end of the file
///     u32      number of the first of the K exposures that are nearest in time to the packet's first firing
///     u32      number n of returns
///     u16[n]   bit k is set if some lens saw the return at exposure first + k
namespace hueline::sim {

constexpr char kSightMagic[] = "HLSIGHT1";
constexpr std::uint32_t kSightExposures = 9;

/// Checks the sight of every return of a generated drive (sim/visibility.hpp) and writes the result to `path`. The
/// bytes do not depend on the number of threads. Errors: Io, Malformed (truth.bin), Stopped.
Status write_sights(const Scenario& scenario, const Drive& drive, const std::string& path,
                    const Progress& progress = {}, const GenerateOptions& options = {});

}  // namespace hueline::sim
