#pragma once

#include <array>
#include <cstdint>

namespace hueline::storage {

/// How the coloured cloud of a drive is written.
enum class CloudFormat : std::uint8_t { Las, Laz, Copc };

/// The names of the cloud in a drive's folder, by format.
constexpr std::array<const char*, 3> kCloudFiles{"cloud.las", "cloud.laz", "cloud.copc.laz"};
constexpr const char* cloud_file(CloudFormat format) { return kCloudFiles[static_cast<std::size_t>(format)]; }
/// The folder beside the cloud that has its strips or tiles.
constexpr const char* kPartsFolder = "parts";

}  // namespace hueline::storage
