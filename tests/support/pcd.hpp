#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace hueline::test {

/// Returns the first three fields (x y z) of an ASCII PCD file without NaN points. Empty if the file is not one.
inline std::vector<Eigen::Vector3d> read_ascii_pcd(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::string line;
  bool is_ascii = false;
  while (std::getline(file, line)) {
    if (line.rfind("DATA", 0) == 0) {
      is_ascii = line.find("ascii") != std::string::npos;
      break;
    }
  }
  std::vector<Eigen::Vector3d> points;
  while (is_ascii && std::getline(file, line)) {
    std::istringstream fields(line);
    Eigen::Vector3d p;
    if (fields >> p.x() >> p.y() >> p.z() && p.allFinite()) points.push_back(p);
  }
  return points;
}

}  // namespace hueline::test
