#include "tests/apps/measure/measuring_inputs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <vector>

#include "apps/simulate/simulated_rig.hpp"
#include "sim/noise.hpp"
#include "storage/png.hpp"

namespace hueline::apps::test {
namespace {

using sim::Vec3;
constexpr int kColumns = 14, kRows = 10;  // inner corners
constexpr double kSquare_m = 0.04;

/// A sequence of random numbers from one seed.
class Draw {
 public:
  Draw(std::uint64_t seed, std::uint64_t stream) : seed_(seed), stream_(0x6D6561ull + stream) {}
  double uniform(double from, double to) { return from + (to - from) * sim::uniform(seed_, stream_, next_++); }
  double normal() { return sim::gaussian(seed_, stream_, next_++); }

 private:
  std::uint64_t seed_, stream_, next_ = 0;
};

struct BoardPose {
  sim::Mat3 R_lens_board;
  Vec3 centre;  ///< lens frame, m
};

/// Returns a rotation that turns +z into `axis`.
sim::Mat3 facing(Vec3 axis) {
  const Vec3 right =
                 sim::normalised(std::abs(axis.y) < 0.9 ? sim::cross({0, 1, 0}, axis) : sim::cross({1, 0, 0}, axis)),
             down = sim::cross(axis, right);
  return {{right.x, down.x, axis.x, right.y, down.y, axis.y, right.z, down.z, axis.z}};
}

/// Returns a corner of the grid of squares, relative to the board's middle. (0, 0) is the first inner corner.
Vec3 corner(double column, double row) {
  return {kSquare_m * (column - (kColumns - 1) / 2.0), kSquare_m * (row - (kRows - 1) / 2.0), 0};
}

/// Returns whether the whole board, with its outermost squares, is in the image.
bool is_whole(const sim::TrueLens& lens, const BoardPose& pose) {
  for (int side = 0; side < 4; ++side)
    for (int i = -1; i <= std::max(kColumns, kRows); ++i) {
      const double c = side < 2    ? std::min(i, kColumns)
                       : side == 2 ? -1
                                   : kColumns,
                   r = side >= 2   ? std::min(i, kRows)
                       : side == 0 ? -1
                                   : kRows;
      const auto pixel = lens.project(pose.R_lens_board * corner(c, r) + pose.centre);
      if (!pixel || pixel->u < 4 || pixel->v < 4 || pixel->u > lens.width - 5 || pixel->v > lens.height - 5)
        return false;
    }
  return true;
}

/// Returns the directions at the corners of the pixels; 0 0 0 outside the field of view.
std::vector<Vec3> directions(const sim::TrueLens& lens) {
  std::vector<Vec3> out;
  for (int v = 0; v <= lens.height; ++v)
    for (int u = 0; u <= lens.width; ++u) out.push_back(lens.ray(u - 0.5, v - 0.5).value_or(Vec3{}));
  return out;
}

storage::RgbImage photograph(const sim::TrueLens& lens, const std::vector<Vec3>& at_corner, const BoardPose& pose,
                             Draw& draw) {
  const sim::Mat3 R_board_lens = sim::transposed(pose.R_lens_board);
  const Vec3 eye = -1.0 * (R_board_lens * pose.centre);
  constexpr int kFine = 3;
  storage::RgbImage out(lens.width, lens.height, {});
  const auto row_length = static_cast<std::size_t>(lens.width) + 1;
  for (int v = 0; v < lens.height; ++v)
    for (int u = 0; u < lens.width; ++u) {
      const std::size_t i = static_cast<std::size_t>(v) * row_length + static_cast<std::size_t>(u);
      const Vec3 a = at_corner[i], b = at_corner[i + 1], c = at_corner[i + row_length],
                 d = at_corner[i + row_length + 1];
      const bool seen = sim::dot(a, a) > 0 && sim::dot(b, b) > 0 && sim::dot(c, c) > 0 && sim::dot(d, d) > 0;
      double light = 0;
      for (int s = 0; s < kFine * kFine; ++s) {
        const double x = (s % kFine + 0.5) / kFine, y = (s / kFine + 0.5) / kFine;
        double grey = 110;
        const Vec3 ray = R_board_lens * ((1 - y) * ((1 - x) * a + x * b) + y * ((1 - x) * c + x * d));
        const double along = seen && ray.z != 0 ? -eye.z / ray.z : -1;
        if (along > 0) {
          const double column = (eye.x + along * ray.x) / kSquare_m + (kColumns - 1) / 2.0,
                       row = (eye.y + along * ray.y) / kSquare_m + (kRows - 1) / 2.0;
          const bool inside = column > -1 && row > -1 && column < kColumns && row < kRows;
          const bool paper = column > -2 && row > -2 && column < kColumns + 1 && row < kRows + 1;
          if (inside)
            grey = (static_cast<int>(std::floor(column)) + static_cast<int>(std::floor(row))) % 2 ? 215 : 30;
          else if (paper)
            grey = 215;
        }
        light += grey / (kFine * kFine);
      }
      const auto level = static_cast<std::uint8_t>(std::clamp(std::lround(light + 2 * draw.normal()), 0l, 255l));
      out.at(u, v) = {level, level, level};
    }
  return out;
}

}  // namespace

Status write_board_images(const sim::RigTruth& rig, std::size_t index, int views, std::uint64_t seed,
                          const std::string& folder) {
  const sim::TrueLens& lens = rig.lenses[index];
  std::filesystem::create_directories(folder);
  const auto at_corner = directions(lens);
  Draw draw(seed, 10 + index);
  const double size = 2 * sim::length(corner(0, 0));
  int written = 0;
  for (int tries = 0; tries < 200000 && written < views; ++tries) {
    const auto axis = lens.ray(draw.uniform(0, lens.width), draw.uniform(0, lens.height));
    if (!axis) continue;
    const double distance = size * draw.uniform(0.7, 1.3) * std::min(1.0, lens.focal_x / lens.width);
    const double about = draw.uniform(0, 2 * sim::kPi), tilt = draw.uniform(sim::radians(30), sim::radians(50)),
                 spin = draw.uniform(0, 2 * sim::kPi);
    const BoardPose pose{facing(*axis) * sim::rotation_z(about) * sim::rotation_x(tilt) * sim::rotation_z(spin),
                         distance * *axis};
    if (!is_whole(lens, pose)) continue;
    if (Status done =
            storage::write_png(fmt::format("{}/{:02}.png", folder, ++written), photograph(lens, at_corner, pose, draw));
        !done.ok())
      return done;
  }
  if (written < views)
    return Error{ErrorCode::Invalid, fmt::format("only {} of {} boards fit into lens {}", written, views, index)};
  return {};
}

std::string mount_points(const sim::RigTruth& rig, int count, std::uint64_t seed) {
  std::string out = "name,lens,u_px,v_px,x_m,y_m,z_m\n";
  for (std::size_t i = 0; i < rig.lenses.size(); ++i) {
    const sim::TrueLens& lens = rig.lenses[i];
    const sim::Pose T_scanner_lens = sim::inverse(rig.T_body_scanner) * rig.T_body_head * lens.T_head_lens;
    Draw draw(seed, 100 + i);
    for (int made = 0; made < count;) {
      const double u = draw.uniform(10, lens.width - 11), v = draw.uniform(10, lens.height - 11),
                   distance = 2 * std::pow(30, draw.uniform(0, 1));
      const auto ray = lens.ray(u, v);
      if (!ray) continue;
      const Vec3 p = T_scanner_lens * (distance * *ray);
      const double x = p.x + 0.005 * draw.normal(), y = p.y + 0.005 * draw.normal(), z = p.z + 0.005 * draw.normal();
      out += fmt::format("p{}_{},lens{},{:.3f},{:.3f},{:.4f},{:.4f},{:.4f}\n", i, ++made, i, u + draw.normal(),
                         v + draw.normal(), x, y, z);
    }
  }
  return out;
}

std::string nominal_rig(const sim::Scenario& scenario, std::uint32_t panorama_width) {
  const sim::RigTruth truth = sim::rig_truth(scenario);
  const auto mounting = [](const sim::Pose& T) {
    std::string numbers;
    for (const double m : T.R.m) numbers += fmt::format("{}{}", numbers.empty() ? "" : ", ", m);
    return fmt::format("{{position_m: [{}, {}, {}], rotation_matrix: [{}]}}", T.p.x, T.p.y, T.p.z, numbers);
  };
  // The drawing of the head has no tolerances. Tape measure and level are wrong by a degree and two centimetres. A
  // boresight calibration leaves a fiftieth of a degree and some millimetres.
  const sim::Pose T_body_head{
      truth.T_body_head.R * sim::rotation_zyx(sim::radians(0.8), sim::radians(-0.9), sim::radians(1)),
      truth.T_body_head.p + Vec3{0.02, -0.015, 0.01}};
  const sim::Pose T_body_scanner{
      truth.T_body_scanner.R * sim::rotation_zyx(sim::radians(0.02), sim::radians(-0.015), sim::radians(0.02)),
      truth.T_body_scanner.p + Vec3{0.004, -0.003, 0.005}};
  std::istringstream in(simulated_rig(scenario, {}, "lens"));
  std::string out;
  std::size_t lens = 0;
  for (std::string line; std::getline(in, line);) {
    const auto is = [&](const char* key) {
      return line.find_first_not_of(' ') != std::string::npos &&
             line.compare(line.find_first_not_of(' '), std::string(key).size(), key) == 0;
    };
    if (is("- name: lens")) lens = static_cast<std::size_t>(std::stoi(line.substr(line.find("lens") + 4)));
    const sim::TrueLens& here = truth.lenses[lens];
    const double focal = std::round(here.focal_x / 10) * 10;
    if (is("T_body_head:"))
      line = "  T_body_head: " + mounting(T_body_head);
    else if (is("T_body_scanner:"))
      line = "    T_body_scanner: " + mounting(T_body_scanner);
    else if (is("panorama:"))
      line = fmt::format("  panorama: {{width: {}, height: {}, stitching_radius_m: 20}}", panorama_width,
                         panorama_width / 2);
    else if (is("focal_px:"))
      line = fmt::format("      focal_px: [{}, {}]", focal, focal);
    else if (is("principal_point_px:"))
      line = fmt::format("      principal_point_px: [{}, {}]", (here.width - 1) / 2.0, (here.height - 1) / 2.0);
    else if (is("distortion:"))
      line = "      distortion: [0, 0, 0, 0]";
    else if (is("T_head_lens:")) {
      // Lenses 0 to 4 are 72 degrees apart, each mounted on its side; lens 5 looks up.
      const double turn = sim::radians(-72.0 * static_cast<double>(lens));
      const sim::Mat3 level{{0, 0, 1, 0, 1, 0, -1, 0, 0}};
      line = "      T_head_lens: " + mounting(lens < 5 ? sim::Pose{sim::rotation_z(turn) * level,
                                                                   {0.06 * std::cos(turn), 0.06 * std::sin(turn), 0}}
                                                       : sim::Pose{{{-1, 0, 0, 0, -1, 0, 0, 0, 1}}, {0, 0, 0.08}});
    }
    out += line + "\n";
  }
  return out;
}

}  // namespace hueline::apps::test
