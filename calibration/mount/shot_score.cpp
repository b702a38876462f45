#include "calibration/mount/shot_score.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace hueline::calibration {
namespace {

constexpr int kEdgeBins = 15;
constexpr float kHalfWay = 0.4F;      // a change of the image that falls halfway between the middle and the last bin
constexpr double kSurroundings = 40;  // width of the image divided by the reach of the surroundings
constexpr double kAroundBlurs = 4;    // the same, in widths of the blur
constexpr double kNoBlur_px = 0.3;    // narrower than the pixels themselves
constexpr double kShrinkPerBlur = 1 / 1.5;  // pixels of the image in one of the picture, for each pixel of blur
constexpr double kFlat = 4;                 // grey levels of noise in a picture without contrast
constexpr double kLeastInImage = 1 / 3.0;

/// Returns the image blurred and made smaller by the factor `shrink`, with its mean removed and divided by its
/// contrast, both taken around each pixel.
cv::Mat flattened(const GreyImage& image, double blur_px, int shrink) {
  cv::Mat grey, mean, squares, contrast;
  cv::Mat(image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.pixels.data())).convertTo(grey, CV_32F);
  if (blur_px > kNoBlur_px) cv::GaussianBlur(grey, grey, {0, 0}, blur_px);
  // Only whole cells are used, so that a cell of the small picture is exactly `shrink` pixels wide.
  const cv::Size size(grey.cols / shrink, grey.rows / shrink);
  cv::resize(grey(cv::Rect(0, 0, size.width * shrink, size.height * shrink)), grey, size, 0, 0, cv::INTER_AREA);
  const double around = std::max(kAroundBlurs * blur_px, image.width / kSurroundings) / shrink;
  cv::GaussianBlur(grey, mean, {0, 0}, around);
  grey -= mean;
  cv::GaussianBlur(grey.mul(grey), squares, {0, 0}, around);
  cv::sqrt(squares, contrast);
  return grey / (contrast + kFlat);
}

using Joint = std::array<double, static_cast<std::size_t>(kPairKinds* kEdgeBins)>;

/// Returns the mutual information of rows and columns, in nat for each count.
double information_of(const Joint& joint) {
  std::array<double, kPairKinds> rows{};
  std::array<double, kEdgeBins> columns{};
  double count = 0;
  for (std::size_t i = 0; i < joint.size(); ++i) {
    rows[i / kEdgeBins] += joint[i];
    columns[i % kEdgeBins] += joint[i];
    count += joint[i];
  }
  double sum = 0;
  for (std::size_t i = 0; i < joint.size(); ++i)
    if (joint[i] > 0) sum += joint[i] * std::log(joint[i] * count / (rows[i / kEdgeBins] * columns[i % kEdgeBins]));
  return count > 0 ? sum / count : 0;
}

Eigen::Matrix3f rotation_of(const Eigen::Vector3d& turn) {
  const double angle = turn.norm();
  if (!(angle > 0)) return Eigen::Matrix3f::Identity();
  return Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix().cast<float>();
}

}  // namespace

PartWeights all_parts() {
  PartWeights out;
  out.fill(1);
  return out;
}

ShotScore::ShotScore(const GreyImage& image, const LensValues& lens, double max_angle,
                     const std::vector<LaserPair>& pairs, double blur, std::size_t most_pairs)
    : lens_(fast_lens(lens, max_angle)), blur_(blur) {
  const double blur_px = blur * lens.focal_px.mean();
  const int shrink = std::max(1, std::min(static_cast<int>(blur_px * kShrinkPerBlur), image.width / 16));
  const cv::Mat picture = flattened(image, blur_px, shrink);
  shrink_ = static_cast<float>(shrink);
  width_ = picture.cols;
  height_ = picture.rows;
  picture_.assign(picture.ptr<float>(), picture.ptr<float>() + picture.total());
  const std::size_t stride = std::max<std::size_t>(1, (pairs.size() + most_pairs - 1) / most_pairs);
  for (std::size_t i = 0; i < pairs.size(); i += stride) pairs_.push_back(pairs[i]);
}

bool ShotScore::read(const Eigen::Vector3f& p_lens, float& out) const {
  float u, v;
  if (!lens_.project_lens(p_lens, u, v)) return false;
  u = (u + 0.5F) / shrink_ - 0.5F;
  v = (v + 0.5F) / shrink_ - 0.5F;
  if (!(u >= 0 && v >= 0 && u < static_cast<float>(width_ - 1) && v < static_cast<float>(height_ - 1))) return false;
  const int column = static_cast<int>(u), row = static_cast<int>(v);
  const float a = u - static_cast<float>(column), b = v - static_cast<float>(row);
  const float* p = picture_.data() + static_cast<std::ptrdiff_t>(row) * width_ + column;
  out = (1 - b) * ((1 - a) * p[0] + a * p[1]) + b * ((1 - a) * p[width_] + a * p[width_ + 1]);
  return true;
}

bool ShotScore::change(const Eigen::Matrix3f& R, const LaserPair& pair, float& out) const {
  float first, second;
  if (!read(R * pair.first, first) || !read(R * pair.second, second)) return false;
  out = second - first;
  return true;
}

double ShotScore::score(const Eigen::Vector3d& turn, const PartWeights& weights) const {
  const Eigen::Matrix3f R = rotation_of(turn);
  Joint joint{};
  double all = 0, inside = 0;
  for (const LaserPair& pair : pairs_) {
    const auto weight = static_cast<double>(weights[pair.part]);
    if (!(weight > 0)) continue;
    all += weight;
    float by;
    if (!change(R, pair, by)) continue;
    inside += weight;
    // A value is shared between the two nearest bins, so that the score is continuous.
    const float place = (by / (std::abs(by) + kHalfWay) + 1) * 0.5F * (kEdgeBins - 1);
    const int bin = std::min(static_cast<int>(place), kEdgeBins - 2);
    const double upper = static_cast<double>(place) - bin;
    double* row = joint.data() + static_cast<std::size_t>(pair.kind) * kEdgeBins + bin;
    row[0] += weight * (1 - upper);
    row[1] += weight * upper;
  }
  return inside > kLeastInImage * all ? information_of(joint) : 0;
}

std::size_t ShotScore::pairs_in_image(const Eigen::Vector3d& turn) const {
  const Eigen::Matrix3f R = rotation_of(turn);
  float by;
  return static_cast<std::size_t>(
      std::count_if(pairs_.begin(), pairs_.end(), [&](const LaserPair& pair) { return change(R, pair, by); }));
}

}  // namespace hueline::calibration
