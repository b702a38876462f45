#pragma once

#include <cstdlib>
#include <filesystem>

namespace hueline::test {

/// Returns the folder of real recordings: the environment variable HUELINE_DATA, or else the folder that the build was
/// configured with.
inline std::filesystem::path data_dir() {
  if (const char* named = std::getenv("HUELINE_DATA")) return named;
  return HUELINE_DATA_DEFAULT;
}

/// Returns the project's own folder, for shipped rigs and fixtures.
inline std::filesystem::path source_dir() { return HUELINE_SOURCE_DIR; }

}  // namespace hueline::test

/// Skips the running test if the recording is absent, with a message that names it. A test never passes silently
/// without its recording.
#define HUELINE_REQUIRE_DATA(relative)                                                             \
  const std::filesystem::path data_file = ::hueline::test::data_dir() / (relative);                \
  if (!std::filesystem::exists(data_file)) GTEST_SKIP() << "recording not present: " << data_file; \
  static_assert(true)
