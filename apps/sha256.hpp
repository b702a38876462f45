#pragma once

#include <filesystem>
#include <stop_token>
#include <string>
#include <string_view>

#include "core/result.hpp"

namespace hueline::apps {

/// Returns the SHA-256 of a file in small hexadecimal digits, as sha256sum prints it (FIPS 180-4). Errors: those of
/// InputFile::open(); Io or Truncated if the file cannot be read to its end; Stopped if `stop` asks for it; Unsupported
/// if OpenSSL refuses to compute it. Thread-safe.
Result<std::string> sha256_of(const std::filesystem::path& file, const std::stop_token& stop = {});

/// Returns the SHA-256 of a text in the same form; an empty text if OpenSSL refuses to compute it.
std::string sha256_of_text(std::string_view text);

}  // namespace hueline::apps
