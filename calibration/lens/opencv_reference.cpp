#include "calibration/lens/opencv_reference.hpp"

#include <algorithm>
#include <opencv2/calib3d.hpp>
#include <vector>

namespace hueline::calibration {

OpencvLens calibrate_with_opencv(const LensCalibration& calibration, bool one_focal) {
  OpencvLens out;
  const LensValues& ours = calibration.adjusted.lens;
  out.lens = ours;
  std::vector<std::vector<cv::Point3f>> places;
  std::vector<std::vector<cv::Point2f>> pixels;
  for (const BoardView& view : calibration.views) {
    places.emplace_back();
    pixels.emplace_back();
    for (const SeenCorner& corner : view.corners) {
      const Eigen::Vector3d p = calibration.board.corner(corner.index);
      places.back().emplace_back(static_cast<float>(p.x()), static_cast<float>(p.y()), 0.0F);
      pixels.back().emplace_back(static_cast<float>(corner.pixel.x()), static_cast<float>(corner.pixel.y()));
    }
  }
  const cv::Size size(static_cast<int>(ours.width), static_cast<int>(ours.height));
  cv::Mat camera = cv::Mat::eye(3, 3, CV_64F), distortion;
  std::vector<cv::Mat> turns, shifts;
  try {
    if (ours.model == LensModel::Brown) {
      out.rms_px = cv::calibrateCamera(places, pixels, size, camera, distortion, turns, shifts,
                                       one_focal ? cv::CALIB_FIX_ASPECT_RATIO : 0,
                                       {cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 200, 1e-12});
    } else {
      out.rms_px = cv::fisheye::calibrate(places, pixels, size, camera, distortion, turns, shifts,
                                          cv::fisheye::CALIB_RECOMPUTE_EXTRINSIC | cv::fisheye::CALIB_FIX_SKEW,
                                          {cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 200, 1e-12});
    }
  } catch (const cv::Exception& e) {
    out.failure = e.err;
    return out;
  }
  out.lens.focal_px = {camera.at<double>(0, 0), camera.at<double>(1, 1)};
  out.lens.principal_point_px = {camera.at<double>(0, 2), camera.at<double>(1, 2)};
  out.lens.distortion = {};
  for (std::size_t i = 0; i < std::min<std::size_t>(5, distortion.total()); ++i)
    out.lens.distortion[i] = distortion.at<double>(static_cast<int>(i));
  return out;
}

}  // namespace hueline::calibration
