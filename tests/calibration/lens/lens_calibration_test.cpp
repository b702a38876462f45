// Lens calibration against simulated boards whose lens is known, and against fusion's camera model.
#include "calibration/lens/lens_calibration.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "runtime/lens_values.hpp"
#include "tests/calibration/lens/simulated_boards.hpp"

namespace hueline::calibration {
namespace {

using test::fisheye_lens;
using test::plane_lens;
using test::simulate_boards;

TEST(LensValues, ProjectAsFusionDoes) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (const auto& lens : {plane_lens(), fisheye_lens()}) {
    const fusion::CameraModel camera(lens);
    const LensValues ours = runtime::lens_values(lens);
    int compared = 0;
    for (int i = 0; i < 2000; ++i) {
      const Eigen::Vector3d p(normal(random), normal(random), normal(random) + 0.8);
      const auto theirs = camera.project(Point<Lens>{p});
      if (!theirs || !camera.in_image(*theirs)) continue;
      const auto mine = ours.project(p);
      ASSERT_TRUE(mine);
      EXPECT_LT((*mine - *theirs).norm(), 1e-9);
      const auto back = ours.direction(*mine);
      ASSERT_TRUE(back);
      EXPECT_LT((*back - p.normalized()).norm(), 1e-8);
      ++compared;
    }
    EXPECT_GT(compared, 300);
  }
}

TEST(LensCalibration, ZhangsClosedFormIsExactWithoutDistortion) {
  auto lens = plane_lens();
  lens.distortion = {};
  const auto views = simulate_boards(lens, {.views = 6, .noise_px = 0});
  const auto start = zhang_start(test::SimulatedBoards{}.board, views, lens.width, lens.height);
  ASSERT_TRUE(start);
  EXPECT_LT((start->focal_px - lens.focal_px).norm(), 1e-3);
  EXPECT_LT((start->principal_point_px - lens.principal_point_px).norm(), 1e-3);
}

TEST(LensCalibration, WithoutNoiseFindsTheLensExactly) {
  for (const auto& lens : {plane_lens(), fisheye_lens()}) {
    const auto views = simulate_boards(lens, {.views = 5, .noise_px = 0});
    const auto found = calibrate_lens(test::SimulatedBoards{}.board, views, lens.width, lens.height,
                                      {.model = runtime::lens_values(lens).model});
    ASSERT_TRUE(found.ok()) << found.error().message;
    EXPECT_LT((found->adjusted.lens.focal_px - lens.focal_px).norm(), 1e-4);
    EXPECT_LT((found->adjusted.lens.principal_point_px - lens.principal_point_px).norm(), 1e-4);
    EXPECT_LT(found->adjusted.rms_px, 1e-5);
  }
}

TEST(LensCalibration, ChoosesTheModelThatPredictsBetter) {
  for (const auto& lens : {plane_lens(), fisheye_lens()}) {
    const auto views = simulate_boards(lens, {.views = 6});
    const auto found = calibrate_lens(test::SimulatedBoards{}.board, views, lens.width, lens.height,
                                      {.model = std::nullopt, .folds = 2});
    ASSERT_TRUE(found.ok()) << found.error().message;
    EXPECT_EQ(found->adjusted.lens.model, runtime::lens_values(lens).model);
    EXPECT_EQ(found->trials.size(), 2u);
  }
}

/// With few noisy views of a fisheye, a plane lens bends far enough to fit them, but cannot pose a view that it was not
/// fitted to.
TEST(LensCalibration, AModelThatCannotPoseHeldBackViewsIsNotChosen) {
  const auto lens = fisheye_lens();
  test::SimulatedBoards what;
  what.views = 5;
  what.seed = 21;
  what.nearest = 0.5;
  what.noise_px = 1;
  const auto views = simulate_boards(lens, what);
  const auto found = calibrate_lens(what.board, views, lens.width, lens.height, {});
  ASSERT_TRUE(found.ok()) << found.error().message;
  EXPECT_EQ(found->adjusted.lens.model, LensModel::KannalaBrandt);
  ASSERT_EQ(found->trials.size(), 2u);
  const ModelTrial &brown = found->trials[0], &fisheye = found->trials[1];
  EXPECT_FALSE(brown.predicted_rms_px) << "what was not measured is no number";
  ASSERT_EQ(brown.unpredicted.size(), 1u);
  EXPECT_EQ(brown.unpredicted[0].view, "view 4");
  EXPECT_THAT(brown.words(),
              testing::HasSubstr("fails on 1 of the views held back: view 4: the board cannot be posed"));
  ASSERT_TRUE(fisheye.predicted_rms_px);
  EXPECT_LT(brown.rms_px, *fisheye.predicted_rms_px)
      << "its fit looks better than what the other predicts: that is what the case is about";

  // If its name is given the model is fitted, and its trial reports the failure.
  const auto asked = calibrate_lens(what.board, views, lens.width, lens.height, {.model = LensModel::Brown});
  ASSERT_TRUE(asked.ok()) << asked.error().message;
  EXPECT_EQ(asked->trials[0].unpredicted.size(), 1u);
}

TEST(LensCalibration, ThreeViewsAreTooFewToHoldAnyBack) {
  const auto lens = plane_lens();
  const auto found =
      calibrate_lens(test::SimulatedBoards{}.board, simulate_boards(lens, {.views = 3}), lens.width, lens.height, {});
  ASSERT_TRUE(found.ok()) << found.error().message;
  for (const ModelTrial& trial : found->trials) {
    if (!trial.failure.empty()) continue;
    EXPECT_FALSE(trial.predicted_rms_px);
    EXPECT_THAT(trial.words(), testing::HasSubstr("too few views to hold any back"));
  }
}

/// The full proof, 200 runs, is lens_trials in calibration_bench.
TEST(LensCalibration, MeetsTheTruthWithinItsOwnSigma) {
  for (const auto& lens : {plane_lens(), fisheye_lens()}) {
    int outside = 0;
    double noise2 = 0;
    constexpr int kRuns = 1;
    for (std::uint32_t run = 0; run < kRuns; ++run) {
      test::SimulatedBoards what = test::good_views();
      what.board = test::SimulatedBoards{}.board;
      what.views = 10;
      what.seed = 100 + run;
      const auto found = calibrate_lens(what.board, simulate_boards(lens, what), lens.width, lens.height,
                                        {.model = runtime::lens_values(lens).model});
      ASSERT_TRUE(found.ok()) << found.error().message;
      const auto truth = runtime::lens_values(lens).parameters(), ours = found->adjusted.lens.parameters();
      for (int i = 0; i < 4; ++i) {
        const double error = ours[static_cast<std::size_t>(i)] - truth[static_cast<std::size_t>(i)];
        EXPECT_LT(std::abs(error), 1.2) << parameter_names(found->adjusted.lens.model)[static_cast<std::size_t>(i)];
        outside += std::abs(error) > 3 * std::sqrt(found->adjusted.covariance(i, i));
        EXPECT_LT(std::sqrt(found->adjusted.covariance(i, i)), 0.4) << "a sigma so large is met by anything";
      }
      noise2 += found->adjusted.sigma_px * found->adjusted.sigma_px;
    }
    EXPECT_LE(outside, 1);
    EXPECT_NEAR(std::sqrt(noise2 / kRuns), 0.1, 0.005) << "the noise that was put in";
  }
}

/// Moves the corners of each view by a smooth error of its own, as a board does that bends when it is put up, or light
/// that comes from another side.
void bend(std::vector<BoardView>& views, int columns, double size_px, std::mt19937& random) {
  std::normal_distribution<double> normal(0, size_px);
  for (BoardView& view : views) {
    Eigen::Matrix<double, 2, 3> bent;
    for (double& one : bent.reshaped()) one = normal(random);
    for (SeenCorner& corner : view.corners) {
      const double x = static_cast<double>(corner.index % static_cast<std::size_t>(columns)) / 4 - 1,
                   y = static_cast<double>(corner.index / static_cast<std::size_t>(columns)) / 3 - 1;
      corner.pixel += bent * Eigen::Vector3d(x * x, y * y, x * y);
    }
  }
}

TEST(LensCalibration, TheSigmaContainsErrorsThatTheCornersOfAViewHaveInCommon) {
  const auto lens = plane_lens();
  const auto truth = runtime::lens_values(lens).parameters();
  std::mt19937 random(11);
  double ratio2 = 0, disagreement = 0;
  constexpr int kRuns = 12;
  for (std::uint32_t run = 0; run < kRuns; ++run) {
    test::SimulatedBoards what = test::good_views();
    what.board = test::SimulatedBoards{}.board;
    what.views = 20;
    what.seed = 300 + run;
    auto views = simulate_boards(lens, what);
    bend(views, what.board.columns, 0.3, random);
    const auto found = adjust_lens(what.board, views, runtime::lens_values(lens), {});
    ASSERT_TRUE(found.ok()) << found.error().message;
    const auto ours = found->lens.parameters();
    for (std::size_t i = 0; i < 4; ++i) {
      const double error = ours[i] - truth[i];
      ratio2 += error * error / found->covariance(static_cast<int>(i), static_cast<int>(i)) / (4 * kRuns);
    }
    disagreement += found->disagreement / kRuns;
  }
  EXPECT_GT(disagreement, 2);
  EXPECT_NEAR(std::sqrt(ratio2), 1, 0.35) << "errors divided by what was stated";
}

/// A board that is bent by a thousandth of its width moves the lens of all views alike. The views show it.
TEST(LensCalibration, FindsTheBendOfABoardAndTheLensAllTheSame) {
  const auto lens = plane_lens();
  const auto truth = runtime::lens_values(lens).parameters();
  double ratio2 = 0, error2 = 0, as_plane2 = 0;
  constexpr int kRuns = 3;
  for (std::uint32_t run = 0; run < kRuns; ++run) {
    test::SimulatedBoards what = test::good_views();
    what.board = test::SimulatedBoards{}.board;
    what.views = 15;
    what.seed = 500 + run;
    Board plane = what.board;
    // A sheet that is rolled about a diagonal, and warped: a millimetre of 400 mm.
    what.board.bend_m = {0.6e-3, 1.0e-3, 0.4e-3, 0, -0.4e-3, 0, 0.6e-3};
    const auto views = simulate_boards(lens, what);
    const auto found = calibrate_lens(plane, views, lens.width, lens.height, {.model = LensModel::Brown});
    ASSERT_TRUE(found.ok()) << found.error().message;
    ASSERT_TRUE(found->is_bent());
    EXPECT_NEAR(found->board.bend_height(), what.board.bend_height(), 0.1 * what.board.bend_height());
    EXPECT_NEAR(found->adjusted.sigma_px, 0.1, 0.006) << "the noise that was put in";
    EXPECT_TRUE(found->rejected_views.empty());
    const auto as_plane = adjust_lens(plane, views, runtime::lens_values(lens), {});
    ASSERT_TRUE(as_plane.ok());
    for (std::size_t i = 0; i < 4; ++i) {
      const int at = static_cast<int>(i);
      const double error = found->adjusted.lens.parameters()[i] - truth[i];
      ratio2 += error * error / found->adjusted.covariance(at, at) / (4 * kRuns);
      error2 += error * error;
      as_plane2 += std::pow(as_plane->lens.parameters()[i] - truth[i], 2);
    }
  }
  EXPECT_LT(std::sqrt(ratio2), 1.3) << "errors divided by what was stated";
  EXPECT_GT(std::sqrt(ratio2), 0.3) << "a sigma so large is met by anything";
  EXPECT_GT(std::sqrt(as_plane2), 10 * std::sqrt(error2)) << "px, if the board is taken for plane";
}

TEST(LensCalibration, APlaneBoardIsNotTakenForABentOne) {
  for (const auto& lens : {plane_lens(), fisheye_lens()})
    for (std::uint32_t seed = 1; seed <= 5; ++seed) {
      const auto found =
          calibrate_lens(test::SimulatedBoards{}.board, simulate_boards(lens, {.views = 10, .seed = seed}), lens.width,
                         lens.height, {.model = runtime::lens_values(lens).model});
      ASSERT_TRUE(found.ok()) << found.error().message;
      EXPECT_FALSE(found->is_bent()) << found->board.bend_height();
    }
}

TEST(LensCalibration, NamesTheViewsOfTwoLenses) {
  auto lens = plane_lens();
  std::mt19937 random(12);
  test::SimulatedBoards what = test::good_views();
  what.board = test::SimulatedBoards{}.board;
  what.views = 12;
  auto views = simulate_boards(lens, what);
  bend(views, what.board.columns, 0.3, random);
  const auto one = calibrate_lens(what.board, views, lens.width, lens.height, {.model = LensModel::Brown});
  ASSERT_TRUE(one.ok()) << one.error().message;
  EXPECT_FALSE(one->two_lenses) << one->two_lenses->words();

  lens.principal_point_px += Eigen::Vector2d(20, -12);
  what.views = 7;
  what.seed = 2;
  auto others = simulate_boards(lens, what);
  bend(others, what.board.columns, 0.3, random);
  for (BoardView& view : others) views.push_back({"other " + view.name, view.corners});
  const auto found = calibrate_lens(what.board, views, lens.width, lens.height, {.model = LensModel::Brown});
  ASSERT_TRUE(found.ok()) << found.error().message;
  ASSERT_TRUE(found->two_lenses);
  const auto& [a, b] = found->two_lenses->lenses;
  const auto& second = a.views.size() < b.views.size() ? a : b;
  EXPECT_THAT(second.views, testing::Each(testing::StartsWith("other ")));
  EXPECT_EQ(second.views.size(), 7u);
  EXPECT_LT((second.lens.principal_point_px - lens.principal_point_px).norm(), 6);
}

TEST(LensCalibration, ViewsWithNoiseAloneDoNotDisagree) {
  test::SimulatedBoards what = test::good_views();
  what.board = test::SimulatedBoards{}.board;
  for (const auto& lens : {plane_lens(), fisheye_lens()}) {
    const auto found = adjust_lens(what.board, simulate_boards(lens, what), runtime::lens_values(lens), {});
    ASSERT_TRUE(found.ok()) << found.error().message;
    EXPECT_NEAR(found->disagreement, 1, 0.25);
    EXPECT_EQ(found->pulls.size(), static_cast<std::size_t>(what.views));
  }
}

TEST(LensCalibration, NamesBadViewsAndCorners) {
  const auto lens = plane_lens();
  auto views = simulate_boards(lens, {.views = 10});
  std::mt19937 random(5);
  std::normal_distribution<double> shake(0, 6);
  for (auto& corner : views[4].corners) corner.pixel += Eigen::Vector2d(shake(random), shake(random));
  views[9].corners[17].pixel += Eigen::Vector2d(4, -3);
  const auto found =
      calibrate_lens(test::SimulatedBoards{}.board, views, lens.width, lens.height, {.model = LensModel::Brown});
  ASSERT_TRUE(found.ok()) << found.error().message;
  ASSERT_EQ(found->rejected_views.size(), 1u);
  EXPECT_EQ(found->rejected_views[0].view, "view 5");
  const auto bad = std::find_if(found->rejected_corners.begin(), found->rejected_corners.end(),
                                [](const RejectedCorner& c) { return c.view == "view 10" && c.index == 17; });
  ASSERT_NE(bad, found->rejected_corners.end());
  EXPECT_NEAR(bad->error_px, 5, 1);
  EXPECT_NEAR(found->adjusted.sigma_px, 0.1, 0.01);
}

TEST(LensCalibration, RefusesWhatDoesNotFixALens) {
  const auto lens = plane_lens();
  const Board board = test::SimulatedBoards{}.board;
  auto views = simulate_boards(lens, {.views = 2});
  EXPECT_THAT(calibrate_lens(board, views, lens.width, lens.height, {}).error().message,
              testing::HasSubstr("3 are needed"));
  // The same view many times does not separate focal length from distance.
  views = simulate_boards(lens, {.views = 1, .tilt_deg = 0});
  views.resize(6, views[0]);
  EXPECT_FALSE(calibrate_lens(board, views, lens.width, lens.height, {.model = LensModel::Brown}).ok())
      << "a lens out of nothing";
  views = simulate_boards(lens, {.views = 5});
  views[1].corners[3].index = 999;
  EXPECT_THAT(calibrate_lens(board, views, lens.width, lens.height, {}).error().message,
              testing::HasSubstr("none of the board's"));
}

}  // namespace
}  // namespace hueline::calibration
