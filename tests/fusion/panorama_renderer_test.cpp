#include "fusion/panorama_renderer.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "fusion/head_motion.hpp"
#include "fusion/worker_pool.hpp"
#include "tests/fusion/drive.hpp"

namespace hueline::fusion {
namespace {

using namespace hueline::test;
using std::numbers::pi;

/// Where a ray from inside a box around the head's centre ends.
Vector3 on_wall(const Vector3& from, const Vector3& direction) {
  const Vector3 half(2.2, 2.5, 2.0);
  double along = 1e9;
  for (int i = 0; i < 3; ++i)
    if (direction[i] != 0) along = std::min(along, ((direction[i] > 0 ? half[i] : -half[i]) - from[i]) / direction[i]);
  return from + along * direction;
}

/// A soft pattern on the walls, 40 to 200.
double paint(const Vector3& p, int channel) {
  return 120 + 40 * std::sin(9 * p.x() + channel) + 40 * std::sin(8 * p.y() + 7 * p.z() + 2 * channel);
}

PanoramaView view_of_width(std::uint32_t width) {
  PanoramaView view;
  view.shape.width = width;
  view.shape.height = width / 2;
  return view;
}
const PanoramaView kView = view_of_width(640);

constexpr PixelFormat kFormat = PixelFormat::Rgb8;
struct Room {
  RigGeometry rig = ladybug_rig(LensModel::KannalaBrandt);
  Image image;
  std::vector<Eigen::Vector3f> points;

  /// `dim` is the factor on the light of lens 2.
  explicit Room(double dim = 1) {
    photograph({}, 1, dim);
    for (double polar = 0.005; polar < pi; polar += 0.01)
      for (double azimuth = 0; azimuth < 2 * pi; azimuth += 0.01 / std::sin(polar))
        points.push_back(on_wall({0, 0, 0}, Vector3(std::sin(polar) * std::cos(azimuth),
                                                    std::sin(polar) * std::sin(azimuth), std::cos(polar)))
                             .cast<float>());
  }
  /// Takes the image of a head at another place in the room. The light of all lenses is multiplied by `light`. The head
  /// moves and turns in its own axes, m/s and rad/s, while the rows of a rolling shutter are exposed.
  void photograph(const Transform<CameraHead, CameraHead>& T_room_head, double light, double dim = 1,
                  const Vector3& velocity = Vector3::Zero(), const Vector3& turning = Vector3::Zero()) {
    const auto& lenses = rig.head.lenses;
    std::vector<CameraModel> models;
    for (const LensMount& lens : lenses) models.emplace_back(lens.intrinsics);
    std::vector<std::optional<Vector3>> seen(std::size_t{306} * 256 * 6);
    for (std::uint32_t y = 0; y < 256 * 6; ++y)
      for (std::uint32_t x = 0; x < 306; ++x)
        if (const auto ray = models[y / 256].unproject({double(x), double(y % 256)})) {
          const double dt = to_seconds(lenses[y / 256].row_time) * (y % 256 - 127.5);
          Transform<CameraHead, CameraHead> moved;
          moved.translation = velocity * dt;
          moved.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(turning.norm() * dt, turning.stableNormalized()));
          const auto T = T_room_head * moved * lenses[y / 256].T_head_lens;
          seen[std::size_t{y} * 306 + x] = on_wall(T.translation, T.rotation * ray->xyz);
        }
    image = make_image(306, 256 * 6, kFormat, [&](std::uint32_t x, std::uint32_t y, int c) {
      const auto& p = seen[std::size_t{y} * 306 + x];
      return p ? (y / 256 == 2 ? dim : 1.0) * light * paint(*p, c) : 0.0;
    });
  }
  RenderedPanorama render(const PanoramaRenderer::Config& config, bool use_depth, int threads = 2,
                          const PanoramaView& view = kView) const {
    WorkerPool pool(threads);
    DepthPanorama depth({.width = 1024});
    std::vector<Eigen::Vector3f> turned;
    for (const auto& p : points) turned.push_back(view.R_head_view.conjugate().cast<float>() * p);
    depth.add(turned, pool);
    depth.close(pool);
    const RawView raw = view_of(image);
    return PanoramaRenderer(rig.head, config)
        .render(view, {std::span(&raw, 1)}, {}, use_depth ? &depth : nullptr, pool);
  }
};

/// The mean difference from what is seen from the head's centre, over pixels above the hole.
double error(const RenderedPanorama& made, const PanoramaView& view) {
  const Panorama panorama(view.shape);
  double sum = 0;
  int count = 0;
  for (std::uint32_t v = 10; v < made.picture.height * 6 / 10; ++v)
    for (std::uint32_t u = 0; u < made.picture.width; ++u) {
      const Vector3 direction = view.R_head_view * panorama.direction_of({double(u), double(v)}).xyz;
      const Vector3 p = on_wall({0, 0, 0}, direction);
      for (int c = 0; c < 3; ++c, ++count)
        sum +=
            std::abs(made.picture.pixels[3 * (std::size_t{v} * made.picture.width + u) + static_cast<std::size_t>(c)] -
                     paint(p, c));
    }
  return sum / count;
}

TEST(PanoramaRenderer, ShowsWhatTheCentreOfTheHeadSees) {
  const Room room;
  const double with_depth = error(room.render({}, true), kView), on_sphere = error(room.render({}, false), kView);
  EXPECT_LT(with_depth, 2.0);
  EXPECT_GT(on_sphere, 3 * with_depth);
}

TEST(PanoramaRenderer, TurnsTheView) {
  const Room room;
  PanoramaView view = kView;
  view.shape.forward_column = 100;
  view.R_head_view = Eigen::AngleAxisd(0.7, Vector3(0.1, -0.2, 1).normalized());
  EXPECT_LT(error(room.render({}, true, 2, view), view), 2.0);
  view.shape.is_clockwise = false;
  EXPECT_LT(error(room.render({}, true, 2, view), view), 2.0);
}

TEST(PanoramaRenderer, MakesLensesEvenWhereTheyOverlap) {
  const Room dim(0.7);
  const auto even = dim.render({}, true);
  EXPECT_NEAR(even.gains[2][1] / even.gains[1][1], 1 / 0.7, 0.03);
  EXPECT_NEAR(even.gains[3][0] / even.gains[1][0], 1, 0.02);
  double product = 1;
  for (const auto& gain : even.gains) product *= gain[1];
  EXPECT_NEAR(product, 1, 0.01);
  for (const auto& gain : dim.render({.even_gains = false}, true).gains) EXPECT_EQ(gain[1], 1.0f);
  for (const auto& gain : Room().render({}, true).gains) EXPECT_NEAR(gain[1], 1, 0.02);
}

TEST(PanoramaRenderer, GivesTheSameBytesWithAnyNumberOfThreads) {
  const Room room(0.8);
  EXPECT_EQ(room.render({}, true, 1).picture.pixels, room.render({}, true, 3).picture.pixels);
}

TEST(PanoramaRenderer, FillsWhatNoLensSeesAndLeavesOutMasksAndMissingImages) {
  Room room;
  const PanoramaRenderer::Config config{.fill = {1, 2, 3}};
  const auto pixel = [](const RenderedPanorama& made, std::uint32_t u, std::uint32_t v) {
    const auto* p = &made.picture.pixels[3 * (std::size_t{v} * made.picture.width + u)];
    return std::array<std::uint8_t, 3>{p[0], p[1], p[2]};
  };
  const std::array<std::uint8_t, 3> fill{1, 2, 3};
  const auto whole = room.render(config, true);
  EXPECT_EQ(pixel(whole, 320, 318), fill);
  EXPECT_NE(pixel(whole, 320, 160), fill);
  EXPECT_NE(pixel(whole, 320, 2), fill);
  // The zenith, which only lens 5 sees.
  room.rig.head.lenses[5].masks = {{{100, 80}, {200, 80}, {200, 180}, {100, 180}}};
  EXPECT_EQ(pixel(room.render(config, true), 320, 2), fill);
  PanoramaRenderer::Config shown = config;
  shown.hide_vehicle = false;
  EXPECT_EQ(pixel(room.render(shown, true), 320, 2), pixel(whole, 320, 2));

  const RawView nothing;
  WorkerPool pool(1);
  const auto missing =
      PanoramaRenderer(room.rig.head, config).render(kView, {std::span(&nothing, 1)}, {}, nullptr, pool);
  EXPECT_EQ(missing.seen_share, 0);
  EXPECT_EQ(pixel(missing, 320, 160), fill);
  const RawView raw = view_of(room.image);
  const auto blind =
      PanoramaRenderer(room.rig.head, config).render(kView, {std::span(&raw, 1), 1u << 5}, {}, nullptr, pool);
  EXPECT_EQ(pixel(blind, 320, 2), fill);
}

TEST(PanoramaRenderer, FillsTheHoleFromAnotherPlace) {
  const Room room;
  // The same room, seen by a head that stood 0.6 m ahead and 0.3 m to the left, turned and darker.
  Room other;
  HeadShot shot;
  shot.T_shot_head.rotation = Eigen::AngleAxisd(0.4, Vector3(0.1, 0.9, 0.2).normalized());
  shot.T_shot_head.translation = -(shot.T_shot_head.rotation * Vector3(0.6, 0.3, 0));
  other.photograph(shot.T_shot_head.inverse(), 0.8);
  const RawView own_image = view_of(room.image), other_image = view_of(other.image);
  shot.images = std::span(&other_image, 1);
  WorkerPool pool(2);
  DepthPanorama depth({.width = 1024});
  depth.add(room.points, pool);
  depth.close(pool);
  const PanoramaRenderer renderer(room.rig.head, {});
  const auto hidden = renderer.render(kView, {std::span(&own_image, 1)}, {}, &depth, pool);
  const auto filled = renderer.render(kView, {std::span(&own_image, 1)}, std::span(&shot, 1), &depth, pool);
  EXPECT_EQ(hidden.filled_share, 0);
  EXPECT_EQ(filled.seen_share, hidden.seen_share);
  EXPECT_GT(filled.filled_share, 0.05);
  // Only what was not seen has changed, beside what fades.
  double sum = 0;
  int count = 0;
  const Panorama panorama(kView.shape);
  for (std::uint32_t v = 200; v < 320; ++v)
    for (std::uint32_t u = 0; u < 640; ++u) {
      const std::size_t at = 3 * (std::size_t{v} * 640 + u);
      if (hidden.picture.pixels[at] != 64 || filled.picture.pixels[at] == 64) continue;
      const Vector3 p = on_wall({0, 0, 0}, panorama.direction_of({double(u), double(v)}).xyz);
      for (int c = 0; c < 3; ++c, ++count)
        sum += std::abs(filled.picture.pixels[at + static_cast<std::size_t>(c)] - paint(p, c));
    }
  ASSERT_GT(count, 10'000);
  EXPECT_LT(sum / count, 4);
}

TEST(PanoramaRenderer, RowsOfARollingShutterShowWhereTheySawThePlaces) {
  Room room;
  for (LensMount& lens : room.rig.head.lenses) lens.row_time = nanoseconds(80'000);
  const Vector3 velocity(12, 1, -0.5), turning(0.3, -0.2, 0.9);
  room.photograph({}, 1, 1, velocity, turning);
  const RawView image = view_of(room.image);
  WorkerPool pool(2);
  DepthPanorama depth({.width = 1024});
  depth.add(room.points, pool);
  depth.close(pool);
  const PanoramaRenderer renderer(room.rig.head, {});
  HeadMotion motion;
  for (std::size_t i = 0; i < 3; ++i) {
    motion.velocity[i] = static_cast<float>(velocity[static_cast<int>(i)]);
    motion.rate[i] = -static_cast<float>(turning[static_cast<int>(i)]);
  }
  const HeadShot still{.images = std::span(&image, 1)}, moving{.images = std::span(&image, 1), .motion = motion};
  const double with_motion = error(renderer.render(kView, moving, {}, &depth, pool), kView),
               without = error(renderer.render(kView, still, {}, &depth, pool), kView);
  EXPECT_LT(with_motion, 2.0);
  EXPECT_GT(without, 3 * with_motion);
}

TEST(HeadMotion, IsTheSameInAnotherFrameOfTheHead) {
  const HeadMotion motion{.velocity = {14, 0.3f, -0.2f}, .rate = {0.1f, -0.2f, 0.6f}};
  Transform<CameraHead, CameraHead> T;
  T.rotation = Eigen::AngleAxisd(0.7, Vector3(0.3, 0.8, -0.2).normalized());
  T.translation = Vector3(5, -2, 0.5);
  const HeadMotion seen = motion_from(motion, T);
  for (const Vector3& p : {Vector3(1, 2, 3), Vector3(-20, 4, 0.5), Vector3(0, 0, -2)}) {
    const Vector3 q = T.rotation * p + T.translation;
    const auto as_floats = [](const Vector3& v) { return v.cast<float>().eval(); };
    const Eigen::Vector3f from = as_floats(p), to = as_floats(q);
    const auto moved = seen.place_after(from.x(), from.y(), from.z(), 0.01f),
               expected = motion.place_after(to.x(), to.y(), to.z(), 0.01f);
    const Vector3 back = T.rotation * Vector3(moved[0], moved[1], moved[2]) + T.translation;
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(back[i], expected[static_cast<std::size_t>(i)], 1e-5);
  }
}

TEST(PanoramaRenderer, AveragesWhereThePanoramaIsCoarserThanTheLenses) {
  Room room;
  // Stripes of one pixel: a single sample would show them as noise.
  room.image =
      make_image(306, 256 * 6, kFormat, [](std::uint32_t x, std::uint32_t, int) { return x % 2 ? 200.0 : 100.0; });
  const auto made = room.render({.even_gains = false}, true, 1, view_of_width(128));
  for (std::uint32_t u = 0; u < 128; ++u)
    EXPECT_NEAR(made.picture.pixels[3 * (std::size_t{32} * 128 + u)], 150, 25) << u;
}

}  // namespace
}  // namespace hueline::fusion
