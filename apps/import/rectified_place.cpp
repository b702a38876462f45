#include "apps/import/rectified_place.hpp"

#include <algorithm>
#include <numbers>
#include <tuple>

namespace hueline::apps {
namespace {

constexpr double kSmallTurn = 0.05 * std::numbers::pi / 180;
constexpr double kSmallWay_m = 2e-3, kSmallWay_share = 0.02;  // files of tf are rounded to millimetres

/// What a CameraInfo says about its rectified camera.
struct Rectified {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();  ///< from the camera to the rectified camera
  Eigen::Vector3d way = Eigen::Vector3d::Zero();    ///< its place in the rectified axes of the pair's first camera, m
  bool is_first() const { return way.norm() < kSmallWay_m; }
  bool is_turned() const { return Eigen::AngleAxisd(R).angle() > kSmallTurn; }
};

std::optional<Rectified> rectified(const CameraFacts& facts) {
  if (!facts.why.empty() || !(facts.P[0] > 0) || !(facts.P[5] > 0)) return std::nullopt;
  Rectified out;
  const auto R = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(facts.R.data());
  if (!R.isZero()) {
    if (!(R * R.transpose()).isIdentity(1e-3) || R.determinant() < 0) return std::nullopt;
    out.R = R;
  }
  out.way = {-facts.P[3] / facts.P[0], -facts.P[7] / facts.P[5], 0};
  return out;
}

bool are_alike(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  const double way = (a.translation() - b.translation()).norm(), length = b.translation().norm();
  return way < std::max(kSmallWay_m, kSmallWay_share * length) &&
         Eigen::AngleAxisd(Eigen::Matrix3d(a.linear().transpose() * b.linear())).angle() < kSmallTurn;
}

/// Which frames the two cameras of a pair have, by the place of the second in that of the first.
enum class PairFrames { Unknown, Rectified, Cameras };
PairFrames frames_of(const Rectified& first, const Rectified& second, const Eigen::Isometry3d& T_first_second) {
  Eigen::Isometry3d as_rectified = Eigen::Isometry3d::Identity(), as_cameras = as_rectified;
  as_rectified.translation() = second.way;
  as_cameras.linear() = first.R.transpose() * second.R;
  as_cameras.translation() = first.R.transpose() * second.way;
  const bool fits_rectified = are_alike(T_first_second, as_rectified),
             fits_cameras = are_alike(T_first_second, as_cameras);
  // Without a turn both are the same, and nothing is to be done.
  if (fits_rectified && (!fits_cameras || (!first.is_turned() && !second.is_turned()))) return PairFrames::Rectified;
  return fits_cameras && !fits_rectified ? PairFrames::Cameras : PairFrames::Unknown;
}

}  // namespace

std::optional<RectifiedPlace> rectified_place(const CameraFacts& own, const std::map<std::string, CameraFacts>& all,
                                              const PlaceInFrame& place) {
  const auto mine = rectified(own);
  if (!mine || (mine->is_first() && !mine->is_turned())) return std::nullopt;
  for (const auto& [topic, facts] : all) {
    const auto other = rectified(facts);
    if (!other || other->is_first() == mine->is_first()) continue;
    if (facts.frame == own.frame) {
      // Which of the first camera's two frames it is does not show if they differ.
      if (mine->is_first() || other->is_turned() || mine->is_turned()) continue;
      RectifiedPlace out;
      out.T_frame_lens.translation() = mine->way;
      out.how = "its frame is that of " + topic + ", so its place is that of P beside it";
      return out;
    }
    const auto& [first, second] = mine->is_first() ? std::tie(*mine, *other) : std::tie(*other, *mine);
    const std::string &frame_first = mine->is_first() ? own.frame : facts.frame,
                      &frame_second = mine->is_first() ? facts.frame : own.frame;
    const auto T_first_second = place(frame_second, frame_first);
    if (!T_first_second) continue;
    switch (frames_of(first, second, *T_first_second)) {
      case PairFrames::Rectified:
        return RectifiedPlace{Eigen::Isometry3d::Identity(),
                              "its frame is that of the rectified images, as the frame of " + topic + " shows"};
      case PairFrames::Cameras: {
        RectifiedPlace out;
        out.T_frame_lens.linear() = mine->R.transpose();
        out.how = "its frame is that of the camera, as the frame of " + topic + " shows, so R is applied";
        return out;
      }
      case PairFrames::Unknown:
        break;
    }
  }
  return std::nullopt;
}

}  // namespace hueline::apps
