// Lens calibration on images that this project has not made: real images with published values, and images of another
// simulator.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "calibration/lens/find_board.hpp"
#include "calibration/lens/lens_calibration.hpp"
#include "calibration/lens/lens_report.hpp"
#include "calibration/lens/opencv_reference.hpp"
#include "config/key_reader.hpp"
#include "fusion/camera_model.hpp"
#include "tests/support/test_data.hpp"

namespace hueline::calibration {
namespace {

const std::filesystem::path kOpencvDoc = "/usr/share/doc/opencv-doc/examples/data";  // Debian's package opencv-doc

struct Seen {
  std::vector<BoardView> views;
  std::uint32_t width = 0, height = 0;
};
Seen see(const Board& board, const std::vector<std::filesystem::path>& files, int refine_half_px = 0) {
  Seen out;
  for (const auto& file : files) {
    const auto image = read_grey_image(file.string());
    if (!image.ok()) continue;
    out.width = static_cast<std::uint32_t>(image->width);
    out.height = static_cast<std::uint32_t>(image->height);
    auto corners = find_board(*image, board, refine_half_px);
    if (corners.ok()) out.views.push_back({file.filename().string(), std::move(*corners)});
  }
  return out;
}
std::vector<std::filesystem::path> numbered(const std::filesystem::path& folder, const std::string& lead,
                                            std::initializer_list<int> numbers) {
  std::vector<std::filesystem::path> out;
  for (const int n : numbers) out.push_back(folder / (lead + (n < 10 ? "0" : "") + std::to_string(n) + ".jpg"));
  return out;
}

/// left_intrinsics.yml of opencv-doc: one focal length (aspectRatio 1, flags 2), all 13 views.
constexpr double kPublished[9] = {535.91573396163199,    535.91573396163199,      342.28315473308373,
                                  235.57082909788173,    -0.26637260909660682,    -0.038588898922304653,
                                  0.0017831947042852964, -0.00028122100441115472, 0.23839153080878486};
constexpr double kPublishedRms_px = 0.39259098975581364;

std::vector<std::filesystem::path> left_images() {
  return numbered(kOpencvDoc, "left", {1, 2, 3, 4, 5, 6, 7, 8, 9, 11, 12, 13, 14});
}

TEST(RealBoards, OpencvsLeftCameraByThePublishedProcedure) {
  if (!std::filesystem::exists(left_images()[0]))
    GTEST_SKIP() << "Debian's package opencv-doc is not installed: " << left_images()[0];
  const Board board{BoardKind::Chessboard, 9, 6, 0.025, 0, ""};
  // The window is 11 px each way, as in OpenCV's sample, and nothing is left out.
  const Seen seen = see(board, left_images(), 11);
  ASSERT_EQ(seen.views.size(), 13u);
  const auto found =
      calibrate_lens(board, seen.views, seen.width, seen.height,
                     {.model = LensModel::Brown, .one_focal = true, .corner_limit_sigma = 1e9, .view_limit = 1e9});
  ASSERT_TRUE(found.ok()) << found.error().message;
  // The sample stops refining at steps of 0.1 px; this program continues.
  EXPECT_NEAR(found->adjusted.rms_px, kPublishedRms_px, 0.03);
  const auto ours = found->adjusted.lens.parameters();
  for (int i = 0; i < 9; ++i) {
    const double sigma = std::sqrt(found->adjusted.covariance(i, i));
    std::printf("  %-15s %12.6f +- %.6f, published %12.6f\n",
                parameter_names(LensModel::Brown)[static_cast<std::size_t>(i)].c_str(),
                ours[static_cast<std::size_t>(i)], sigma, kPublished[i]);
    EXPECT_LT(std::abs(ours[static_cast<std::size_t>(i)] - kPublished[i]), 0.5 * sigma) << i;
  }
}

TEST(RealBoards, OpencvsLeftCameraWithItsOwnWindow) {
  if (!std::filesystem::exists(left_images()[0]))
    GTEST_SKIP() << "Debian's package opencv-doc is not installed: " << left_images()[0];
  const Board board{BoardKind::Chessboard, 9, 6, 0.025, 0, ""};
  const Seen seen = see(board, left_images());
  ASSERT_EQ(seen.views.size(), 13u);
  const auto found =
      calibrate_lens(board, seen.views, seen.width, seen.height, {.model = LensModel::Brown, .one_focal = true});
  ASSERT_TRUE(found.ok()) << found.error().message;
  const auto& adjusted = found->adjusted;
  EXPECT_LE(adjusted.rms_px, 0.2)
      << "half of the published one: its window held neighbouring corners in left02, where squares are 15 px wide";
  const auto ours = adjusted.lens.parameters();
  // The published values have the published residuals, so that their own sigma is larger by this factor.
  const double larger = kPublishedRms_px / adjusted.rms_px;
  for (int i = 0; i < 9; ++i) {
    const double sigma = std::sqrt(adjusted.covariance(i, i));
    std::printf("  %-15s %12.6f +- %.6f, published %12.6f +- %.6f\n",
                parameter_names(LensModel::Brown)[static_cast<std::size_t>(i)].c_str(),
                ours[static_cast<std::size_t>(i)], sigma, kPublished[i], sigma * larger);
    EXPECT_LT(std::abs(ours[static_cast<std::size_t>(i)] - kPublished[i]), 4 * sigma * larger) << i;
  }
  const OpencvLens theirs = calibrate_with_opencv(*found, true);
  EXPECT_LT((theirs.lens.focal_px - adjusted.lens.focal_px).norm(), 0.05);
  EXPECT_LT((theirs.lens.principal_point_px - adjusted.lens.principal_point_px).norm(), 0.05);
  EXPECT_NEAR(theirs.rms_px, adjusted.rms_px, 1e-3);
  std::printf("  rms %.4f px, OpenCV %.4f px (focal %.4f)\n", adjusted.rms_px, theirs.rms_px, theirs.lens.focal_px.x());
}

TEST(RealBoards, AnotherSimulatorsBoard) {
  HUELINE_REQUIRE_DATA("chessboard/01.jpg");
  // 18 x 8 squares; that they are 5 cm wide follows from circle.csv (the mount's test).
  const Board board{BoardKind::Chessboard, 17, 7, 0.05, 0, ""};
  const Seen seen = see(board, numbered(data_file.parent_path(), "", {1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23}));
  EXPECT_EQ(seen.views.size(), 12u);
  // All boards but one are parallel to the image. They determine the lens only with a single focal length, and hardly:
  // the corners' noise alone would give 1600 +- 21 px, but the views disagree far more.
  const auto found =
      calibrate_lens(board, seen.views, seen.width, seen.height, {.model = LensModel::Brown, .one_focal = true});
  ASSERT_TRUE(found.ok()) << found.error().message;
  EXPECT_LE(found->adjusted.rms_px, 0.5);
  const double focal = found->adjusted.lens.focal_px.x(), sigma = std::sqrt(found->adjusted.covariance(0, 0));
  std::printf("  rms %.4f px in %zu views, focal %.2f +- %.2f (%.2f by noise), principal point %.2f %.2f\n",
              found->adjusted.rms_px, found->views.size(), focal, sigma, found->adjusted.focal_noise_px.x(),
              found->adjusted.lens.principal_point_px.x(), found->adjusted.lens.principal_point_px.y());
  for (const auto& view : found->rejected_views)
    std::printf("  left out %s: %s\n", view.view.c_str(), view.why.c_str());
  EXPECT_LT(found->adjusted.focal_noise_px.x(), 0.02 * focal);
  EXPECT_GT(sigma, 2 * found->adjusted.focal_noise_px.x());
}

TEST(RealBoards, TheFragmentIsReadByTheRig) {
  const auto files = numbered(kOpencvDoc, "left", {1, 3, 4, 5, 6});
  if (!std::filesystem::exists(files[0])) GTEST_SKIP() << "Debian's package opencv-doc is not installed: " << files[0];
  const Board board{BoardKind::Chessboard, 9, 6, 0.025, 0, ""};
  const Seen seen = see(board, files);
  const auto found = calibrate_lens(board, seen.views, seen.width, seen.height, {.model = LensModel::Brown});
  ASSERT_TRUE(found.ok()) << found.error().message;
  const LensReportContext context{"2026-11-21", "5 images", {}, ""};
  config::Section root = config::Section::load_text("lens:\n" + lens_fragment(*found, context, 2), "lens.yaml");
  const auto read = config::read_config<fusion::CameraIntrinsics>(root.section("lens"));
  EXPECT_LT((read.focal_px - found->adjusted.lens.focal_px).norm(), 1e-6);
  EXPECT_EQ(read.width, 640u);
  EXPECT_NE(lens_html(*found, context).find("</svg>"), std::string::npos);
  EXPECT_NE(lens_json(*found, context).find("\"corner_sigma_px\""), std::string::npos);
}

}  // namespace
}  // namespace hueline::calibration
