#pragma once

#include <cstdlib>
#include <filesystem>

namespace hueline::test {

/// Folder of real recordings: the environment variable HUELINE_DATA, else the folder the build was configured with.
inline std::filesystem::path data_dir() {
  if (const char* named = std::getenv("HUELINE_DATA")) return named;
  return HUELINE_DATA_DEFAULT;
}

/// The project's own folder, for shipped rigs and fixtures.
inline std::filesystem::path source_dir() { return HUELINE_SOURCE_DIR; }

}  // namespace hueline::test

/// Skips the running test, saying which recording is absent; never a silent pass.
#define HUELINE_REQUIRE_DATA(relative)                                                             \
  const std::filesystem::path data_file = ::hueline::test::data_dir() / (relative);                \
  if (!std::filesystem::exists(data_file)) GTEST_SKIP() << "recording not present: " << data_file; \
  static_assert(true)
