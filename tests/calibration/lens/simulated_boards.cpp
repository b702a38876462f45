#include "tests/calibration/lens/simulated_boards.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>

namespace hueline::calibration::test {

fusion::CameraIntrinsics plane_lens() {
  fusion::CameraIntrinsics lens;
  lens.model = fusion::LensModel::Brown;
  lens.width = 1224;
  lens.height = 1024;
  lens.focal_px = {1052.3, 1053.1};
  lens.principal_point_px = {619.4, 504.8};
  lens.distortion = {-0.18, 0.09, 0.0006, -0.0004, -0.02};
  return lens;
}

fusion::CameraIntrinsics large_plane_lens() {
  fusion::CameraIntrinsics lens = plane_lens();
  lens.width *= 2;
  lens.height *= 2;
  lens.focal_px *= 2;
  lens.principal_point_px = 2 * lens.principal_point_px + Eigen::Vector2d(0.5, 0.5);
  return lens;
}

fusion::CameraIntrinsics fisheye_lens() {
  fusion::CameraIntrinsics lens;
  lens.model = fusion::LensModel::KannalaBrandt;
  lens.width = 1224;
  lens.height = 1024;
  lens.focal_px = {432.7, 432.2};
  lens.principal_point_px = {617.2, 519.6};
  lens.distortion = {-0.012, 0.004, -0.0031, 0.0004, 0};
  lens.max_angle = 1.5;
  return lens;
}

SimulatedBoards good_views() {
  SimulatedBoards out;
  out.board = {BoardKind::Chessboard, 14, 10, 0.04, 0, ""};
  out.views = 40;
  out.least_tilt_deg = 30;
  out.tilt_deg = 50;
  out.nearest = 0.7;
  out.farthest = 1.3;
  return out;
}

std::vector<BoardView> simulate_boards(const fusion::CameraIntrinsics& lens, const SimulatedBoards& what) {
  const fusion::CameraModel camera(lens);
  std::mt19937 random(what.seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::normal_distribution<double> noise(0, what.noise_px);
  const Eigen::Vector3d middle = 0.5 * (what.board.corner(0) + what.board.corner(what.board.corner_count() - 1));
  const double size = 2 * middle.norm();
  std::vector<BoardView> out;
  for (int tries = 0; tries < 100000 && static_cast<int>(out.size()) < what.views; ++tries) {
    // One draw a statement: compilers order the arguments of a call as they like.
    const double down = (uniform(random) + 1) / 2;
    const double right = (uniform(random) + 1) / 2;
    const Eigen::Vector2d aim(right * lens.width, down * lens.height);
    const auto axis = camera.unproject(aim);
    if (!axis) continue;
    // The board faces the lens from its place, with a tilt.
    const double share = (uniform(random) + 1) / 2;
    const double distance =
        size * (what.nearest + (what.farthest - what.nearest) * share) * std::min(1.0, lens.focal_px.x() / lens.width);
    // The shortest rotation of the lens's axis onto the direction.
    const Eigen::Quaterniond facing =
        Eigen::Quaterniond(1 + axis->xyz.z(), -axis->xyz.y(), axis->xyz.x(), 0).normalized();
    const double about = std::numbers::pi * uniform(random), tilt_share = (uniform(random) + 1) / 2;
    const double tilt =
        (what.least_tilt_deg + (what.tilt_deg - what.least_tilt_deg) * tilt_share) * std::numbers::pi / 180;
    const Eigen::Quaterniond R = facing *
                                 Eigen::AngleAxisd(tilt, Eigen::Vector3d(std::cos(about), std::sin(about), 0)) *
                                 Eigen::AngleAxisd(std::numbers::pi * uniform(random), Eigen::Vector3d::UnitZ());
    BoardView view{"view " + std::to_string(out.size() + 1), {}};
    for (std::size_t i = 0; i < what.board.corner_count(); ++i) {
      const auto pixel = camera.project(Point<Lens>{R * (what.board.corner(i) - middle) + distance * axis->xyz});
      if (!pixel || !camera.in_image(*pixel, 5)) break;
      const double noise_v = noise(random);
      const double noise_u = noise(random);
      view.corners.push_back({i, *pixel + Eigen::Vector2d(noise_u, noise_v)});
    }
    if (view.corners.size() == what.board.corner_count()) out.push_back(std::move(view));
  }
  return out;
}

}  // namespace hueline::calibration::test
