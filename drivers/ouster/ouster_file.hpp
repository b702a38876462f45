#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "core/result.hpp"

/// Metadata of an Ouster that lie in a file.
namespace hueline::drivers {

/// Returns the text of the file. Errors: those of read_input().
Result<std::string> read_ouster_metadata_file(const std::string& path);

/// Returns the packet of the metadata in a file. Errors: those of read_input() and parse_ouster_metadata().
Result<std::vector<std::byte>> describe_ouster(const std::string& path);

}  // namespace hueline::drivers
