#include "calibration/mount/alignment_picture.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>

namespace hueline::calibration {
namespace {

constexpr double kOwnBlur_px = 1.2;
constexpr double kAround = 30;  // width of the image divided by the reach of the surroundings

AlignmentPicture shrunk(const cv::Mat& full, float blur_px) {
  cv::Mat blurred = full, small;
  if (blur_px > 0) cv::GaussianBlur(full, blurred, {0, 0}, static_cast<double>(blur_px));
  AlignmentPicture out;
  out.shrink = std::max(1.0F, static_cast<float>(static_cast<int>(blur_px / 2)));
  // Only whole cells are used, so that a cell of the small picture is exactly `shrink` pixels wide.
  const int cell = static_cast<int>(out.shrink);
  const cv::Size size(full.cols / cell, full.rows / cell);
  cv::resize(blurred(cv::Rect(0, 0, size.width * cell, size.height * cell)), small, size, 0, 0, cv::INTER_AREA);
  cv::Mat bytes;
  small.convertTo(bytes, CV_8U, 255.0);
  out.width = bytes.cols;
  out.height = bytes.rows;
  out.values.assign(bytes.data, bytes.data + bytes.total());
  return out;
}

cv::Mat mat_of(const GreyImage& image) {
  return {image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.pixels.data())};
}

}  // namespace

AlignmentPicture edge_picture(const GreyImage& image, float blur_px) {
  cv::Mat grey, dx, dy, size, around;
  mat_of(image).convertTo(grey, CV_32F, 1 / 255.0);
  cv::GaussianBlur(grey, grey, {0, 0}, kOwnBlur_px);
  cv::Sobel(grey, dx, CV_32F, 1, 0);
  cv::Sobel(grey, dy, CV_32F, 0, 1);
  cv::magnitude(dx, dy, size);
  cv::GaussianBlur(size, around, {0, 0}, std::max(4.0, image.width / kAround));
  cv::Mat edges = size / (3 * around + 0.05);
  edges = cv::min(edges, 1.0);
  AlignmentPicture out = shrunk(edges, blur_px);
  // Spread edges are faint and are scaled back to the whole range of bytes.
  const auto [least, most] = std::minmax_element(out.values.begin(), out.values.end());
  const int low = *least, span = std::max(1, *most - low);
  for (auto& v : out.values) v = static_cast<std::uint8_t>((v - low) * 255 / span);
  return out;
}

AlignmentPicture grey_picture(const GreyImage& image, float blur_px) {
  cv::Mat equal, grey;
  cv::equalizeHist(mat_of(image), equal);
  equal.convertTo(grey, CV_32F, 1 / 255.0);
  return shrunk(grey, blur_px);
}

}  // namespace hueline::calibration
