#include "apps/colour/published_calibration.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <filesystem>
#include <initializer_list>
#include <map>
#include <sstream>
#include <string>
#include <utility>

#include "apps/colour/published_lens.hpp"
#include "config/section.hpp"

namespace hueline::apps {
namespace {

using Pose = Transform<Lens, Scanner>;

/// Lines of the form "NAME: number number ..." (KITTI also leaves out the colon), and numbers on lines without a name,
/// by the latest word alone on a line.
struct NamedNumbers {
  std::map<std::string, Numbers> by_name;
  std::map<std::string, Numbers> unnamed;
  std::map<std::string, std::string> unread;  ///< by name, the word in the line that is no number

  /// Throws config::ConfigError if the line of one of these names has a word that is no number.
  void check(const std::string& path, std::initializer_list<const char*> names) const {
    for (const char* name : names)
      if (const auto found = unread.find(name); found != unread.end())
        throw config::ConfigError(fmt::format("{}: {}: '{}' is no number", path, name, found->second));
  }
};

NamedNumbers named_numbers(const std::string& path) {
  NamedNumbers out;
  std::istringstream in(config::read_configuration(path));
  std::string title, below;
  int number = 0;
  for (std::string line; std::getline(in, line);) {
    ++number;
    line.erase(std::min(line.find('#'), line.size()));
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    const auto colon = line.find(':');
    std::string text = colon == std::string::npos ? line : line.substr(colon + 1);
    std::ranges::replace_if(
        text, [](char c) { return c == ',' || c == ';' || c == '[' || c == ']'; }, ' ');
    std::istringstream values(text);
    Numbers list;
    for (double value; values >> value;) list.push_back(value);
    std::string word;
    values.clear();
    if (colon != std::string::npos) {
      const std::string name = line.substr(0, colon);
      if (values >> word) out.unread[name] = word;
      // The numbers may stand in rows below the name.
      below = list.empty() && word.empty() ? name : std::string();
      out.by_name[name] = std::move(list);
      continue;
    }
    if (std::string name; list.empty() && values >> name) {
      for (double value; values >> value;) list.push_back(value);
      if (values.eof() && !list.empty()) {
        out.by_name[name] = std::move(list);
        continue;
      }
      list.clear();
    }
    values.clear();
    if (!list.empty()) {
      if (values >> word) throw config::ConfigError(fmt::format("{}:{}: '{}' is no number", path, number, word));
      Numbers& all = below.empty() ? out.unnamed[title] : out.by_name[below];
      all.insert(all.end(), list.begin(), list.end());
    } else if (std::istringstream words(text); words >> title && !(words >> word)) {
      below.clear();
    } else {
      throw config::ConfigError(fmt::format("{}:{}: is neither 'NAME: numbers' nor a row of numbers", path, number));
    }
  }
  return out;
}

/// Returns whether the name of a file says that its matrix leads from the camera to the laser, as that of KITTI-360's
/// calib_cam_to_velo.txt does.
bool is_from_camera(const std::string& path) {
  const std::string name = lower_case(std::filesystem::path(path).filename().string());
  for (const char* camera : {"cam", "camera"})
    for (const char* to : {"_to_", "2"})
      for (const char* laser : {"velo", "lidar", "laser"})
        if (name.find(fmt::format("{}{}{}", camera, to, laser)) != std::string::npos) return true;
  return false;
}

/// Returns whether these are rows of 4 of a camera matrix, with a column of 0 behind it.
bool is_projection(const Numbers& v) {
  return (v.size() == 12 || v.size() == 16) && v[0] > 1 && v[5] > 1 && v[2] > 1 && v[6] > 1 && v[3] == 0 && v[7] == 0 &&
         v[11] == 0;
}

/// Matrices without names tell what they are by their size: 9 numbers are K, 4 greater than 1 are fx fy cx cy, 12 or 16
/// T or a projection, and 4 or 5 under a title that begins with "dist" the distortion.
void read_unnamed(const std::string& path, const std::map<std::string, Numbers>& matrices, CalibrationParts& out) {
  PublishedLens lens;
  for (const auto& [title, values] : matrices) {
    if (values.size() == 9) {
      lens.K = values;
    } else if (title.starts_with("dist") && (values.size() == 4 || values.size() == 5)) {
      lens.distortion = values;
    } else if (values.size() == 4 && std::ranges::all_of(values, [](double v) { return v > 1; })) {
      lens.K = camera_matrix(values);
    } else if (is_projection(values)) {
      lens.K = {values[0], values[1], values[2], values[4], values[5], values[6], values[8], values[9], values[10]};
    } else {
      const Pose found = pose_of(values, path + ": the matrix" + (title.empty() ? "" : " " + title));
      if (is_from_camera(path)) {
        out.T_first_scanner = turned_round(found);
        out.shot.pose_note = turned_by_name(path);
      } else {
        out.shot.T_lens_scanner = found;
      }
    }
  }
  if (!lens.K.empty()) take_lens(lens, path, "the camera matrix", out.shot);
}

/// One text of KITTI, whose left colour camera has the number 2, or of KITTI-360, where it has the number 0.
class KittiText {
 public:
  KittiText(const std::string& path, const std::map<std::string, Numbers>& lines) : path_(path), lines_(lines) {}

  bool read(CalibrationParts& out) const {
    const char* const laser = first({"Tr_velo_to_cam", "Tr_velo_cam", "Tr"});
    if (has("P2") && laser != nullptr) {
      out.T_first_scanner = pose_of(numbers(laser, 12), path_ + ": " + laser);
      const char* const rectification = first({"R0_rect", "R_rect"});
      read_projection("P2", rectification == nullptr ? "R0_rect" : rectification, out);
      return true;
    }
    for (const auto& [P, S] : {std::pair{"P_rect_02", "S_rect_02"}, std::pair{"P_rect_00", "S_rect_00"}}) {
      if (!has(P)) continue;
      read_projection(P, "R_rect_00", out);
      if (has(S)) {
        const Numbers size = numbers(S, 2);
        out.shot.intrinsics->width = static_cast<std::uint32_t>(std::clamp(size[0], 0.0, 1e6));
        out.shot.intrinsics->height = static_cast<std::uint32_t>(std::clamp(size[1], 0.0, 1e6));
      }
      return true;
    }
    if (!has("R") || !has("T") || has("K")) return false;
    out.T_first_scanner = pose_of(numbers("R", 9), numbers("T", 3), path_, "R", "T");
    return true;
  }

 private:
  bool has(const char* name) const { return lines_.contains(name); }
  /// Returns the first of these names that the text has, or null.
  const char* first(std::initializer_list<const char*> names) const {
    for (const char* name : names)
      if (has(name)) return name;
    return nullptr;
  }
  const Numbers& numbers(const char* name, std::size_t count) const {
    const Numbers& found = lines_.at(name);
    if (found.size() != count)
      throw config::ConfigError(fmt::format("{}: {} has {} numbers; allowed: {}", path_, name, found.size(), count));
    return found;
  }
  /// P = K [I | t] leads from the rectified first camera, in whose frame the rectified colour camera stands at -t.
  void read_projection(const char* projection, const char* rectification, CalibrationParts& out) const {
    const Numbers values = numbers(projection, 12);
    const Eigen::Map<const Matrix34> P(values.data());
    const Matrix3 K = P.leftCols<3>();
    take_lens({.K = {K.data(), K.data() + 9}, .distortion = {}, .model = {}}, path_, projection, out.shot);
    Matrix34 T = Matrix34::Identity();
    if (has(rectification)) T.leftCols<3>() = Eigen::Map<const Matrix3>(numbers(rectification, 9).data());
    T.col(3) = K.inverse() * P.col(3);
    const Pose pose = pose_of(T, path_ + ": " + rectification);
    out.T_lens_first = Transform<Lens, Lens>{pose.rotation, pose.translation};
  }

  const std::string& path_;
  const std::map<std::string, Numbers>& lines_;
};

}  // namespace

void read_published_text(const std::string& path, CalibrationParts& out) {
  const NamedNumbers found = named_numbers(path);
  found.check(path, {"K", "D", "T", "R", "P2", "Tr", "Tr_velo_to_cam", "Tr_velo_cam", "R0_rect", "R_rect", "P_rect_02",
                     "P_rect_00", "R_rect_00", "S_rect_02", "S_rect_00"});
  const auto& lines = found.by_name;
  if (const auto K = lines.find("K"); K != lines.end()) {
    const auto D = lines.find("D");
    take_lens({.K = K->second, .distortion = D == lines.end() ? Numbers() : D->second, .model = {}}, path, "K",
              out.shot);
    if (const auto T = lines.find("T"); T != lines.end()) out.shot.T_lens_scanner = pose_of(T->second, path + ": T");
    return;
  }
  if (KittiText(path, lines).read(out)) return;
  if (const auto T = lines.find("T"); T != lines.end()) {
    out.shot.T_lens_scanner = pose_of(T->second, path + ": T");
    return;
  }
  if (lines.empty() && !found.unnamed.empty()) return read_unnamed(path, found.unnamed, out);
  throw config::ConfigError(
      path +
      ": holds neither K with D, nor T, nor P2 with Tr_velo_to_cam or Tr, P_rect_02, or R and T of "
      "KITTI, nor P_rect_00 of KITTI-360, nor rows of numbers alone");
}

}  // namespace hueline::apps
