#pragma once

#include <string>
#include <string_view>

namespace hueline {

/// The first bytes of what Zstandard has packed.
constexpr std::string_view kZstdMagic = "\x28\xB5\x2F\xFD";

/// Says of a file that stands for another one how to get at that one, for the message of a reader that does not know
/// the file: "is compressed as a whole: unpack it with gunzip". It knows gzip, zstd, xz, bzip2, ZIP, the pointers that
/// git leaves in place of large files, recordings in the scanner makers' own formats (.lvx, .lvx2, .osf), and those of
/// bus loggers (.mf4). Returns nothing for other first bytes (24 are enough). It does not judge whether the rest is
/// whole.
std::string how_to_unpack(std::string_view first_bytes);

}  // namespace hueline
