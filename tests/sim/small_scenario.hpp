#pragma once

#include <unistd.h>

#include <filesystem>
#include <string>

#include "sim/scenario.hpp"

namespace hueline::sim {

/// Returns a scenario with less than a second of motion and small images, which takes a second to render under
/// sanitizers.
inline Scenario small_scenario() {
  Scenario s;
  s.duration_s = 0.8;
  s.lead_in_s = 1;
  s.drive.stand_s = 0;
  s.drive.accelerate_s = 0.5;
  s.drive.brake_s = 0.5;
  s.drive.halt_s = 0;
  s.street.leaves_per_tree = 150;
  s.camera.lens_width = 76;
  s.camera.lens_height = 64;
  return s;
}

/// A temporary folder of the test. The destructor removes it.
class TemporaryFolder {
 public:
  explicit TemporaryFolder(const std::string& name)
      : path_(std::filesystem::temp_directory_path() / (name + "-" + std::to_string(::getpid()))) {
    std::filesystem::remove_all(path_);
    std::filesystem::create_directories(path_);
  }
  ~TemporaryFolder() {
    std::error_code ec;
    std::filesystem::remove_all(path_, ec);
  }
  std::string path() const { return path_.string(); }

 private:
  std::filesystem::path path_;
};

}  // namespace hueline::sim
