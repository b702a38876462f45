#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <span>

#include "core/portable_math.hpp"
#include "storage/cloud_crs.hpp"
#include "storage/cloud_picture.hpp"
#include "storage/las_fields.hpp"
#include "storage/point_canvas.hpp"
#include "storage/point_colour.hpp"
#include "storage/webp.hpp"

namespace hueline::storage {
namespace {

constexpr int kFiner = 2;       // each frame is drawn this many times larger, then reduced
constexpr double kLeast = 0.5;  // shortest duration of the drive, s

/// Times and brightness of a whole file.
struct Extent {
  double first = std::numeric_limits<double>::infinity(), last = -first;  // s, as stored
  std::uint16_t brightest_colour = 0, brightest_intensity = 0;
  Status read;
};

/// Calls `visit` for each point. Returns Truncated after all points of a cut file.
template <class Visit>
Status for_each_point(LasReader& reader, Visit&& visit) {
  reader.rewind();
  std::vector<LasPoint> batch;
  while (true) {
    if (Status read = reader.next(batch); !read) return read;
    if (batch.empty()) return {};
    for (const LasPoint& p : batch) visit(p);
  }
}

Result<Extent> extent_of(LasReader& reader) {
  Extent e;
  e.read = for_each_point(reader, [&e](const LasPoint& p) {
    if (p.time && std::isfinite(*p.time)) e.first = std::min(e.first, *p.time), e.last = std::max(e.last, *p.time);
    e.brightest_colour = std::max({e.brightest_colour, p.red, p.green, p.blue});
    e.brightest_intensity = std::max(e.brightest_intensity, p.intensity);
  });
  if (!e.read && e.read.error().code != ErrorCode::Truncated) return e.read.error();
  return e;
}

/// A return as it is drawn. Times are s since the picture begins, places are m from the first point that is held.
struct Shown {
  Eigen::Vector3f place;
  float fired, coloured;  // `coloured` is the time at which it takes `colour`
  std::uint32_t exposure;
  Rgb colour;
  std::uint8_t grey;  // of its echo; shown until then
};

/// Keeps every n-th of the points that it is offered, where n is the smallest power of two for which they fit. The
/// order of the points alone decides which are kept.
class EvenShare {
 public:
  explicit EvenShare(std::uint64_t most) : most_(most) {}
  void offer(const Shown& point) {
    if (offered_++ % every_ != 0) return;
    if (points_.size() == most_) {
      for (std::size_t i = 0; i < points_.size(); i += 2) points_[i / 2] = points_[i];
      points_.resize((points_.size() + 1) / 2);
      every_ *= 2;
      if ((offered_ - 1) % every_ != 0) return;
    }
    points_.push_back(point);
  }
  std::vector<Shown> take() { return std::move(points_); }

 private:
  std::uint64_t most_, every_ = 1, offered_ = 0;
  std::vector<Shown> points_;
};

/// The path of the vehicle over the ground, estimated from the returns alone.
class Way {
 public:
  /// `points` must be in the order of their times.
  explicit Way(const std::vector<Shown>& points) {
    constexpr double kStep = 0.25;  // s
    for (std::size_t begin = 0; begin < points.size();) {
      std::size_t end = begin;
      while (end < points.size() && points[end].fired < points[begin].fired + kStep) ++end;
      add({points.data() + begin, points.data() + end});
      begin = end;
    }
  }
  bool empty() const { return knots_.empty(); }

  /// Returns the place of the vehicle on the ground: the value at `time` of a straight line that is fitted to the knots
  /// around it. A mean of the knots would be too far inside at both ends.
  Eigen::Vector3d at(double time) const {
    constexpr double kSmoothing = 1.2;  // s, one sigma
    Eigen::Vector3d sum = Eigen::Vector3d::Zero(), sum_t = Eigen::Vector3d::Zero();
    double weights = 0, t1 = 0, t2 = 0;
    for (const Knot& k : knots_) {
      const double dt = k.time - time, w = portable::exp(-0.5 * dt * dt / (kSmoothing * kSmoothing)) + 1e-12;
      weights += w, t1 += w * dt, t2 += w * dt * dt;
      sum += w * k.ground, sum_t += w * dt * k.ground;
    }
    const double determinant = weights * t2 - t1 * t1;
    if (determinant < 1e-9 * weights * weights) return sum / weights;
    return (t2 * sum - t1 * sum_t) / determinant;
  }
  /// Returns the direction from the place `behind` m back on the path to the place at `time`, rad, clockwise from grid
  /// north. If the path does not reach back so far, it is the direction of the whole path.
  double heading(double time, double behind) const {
    const Eigen::Vector3d here = at(time);
    Eigen::Vector3d way = knots_.back().ground - knots_.front().ground;
    for (double back = time; back > knots_.front().time; back -= 0.1)
      if (const Eigen::Vector3d gone = here - at(back); gone.head<2>().norm() >= std::max(behind, 1.0)) {
        way = gone;
        break;
      }
    return portable::atan2(way.x(), way.y());
  }

 private:
  struct Knot {
    double time;
    Eigen::Vector3d ground;
  };
  /// Adds the place of the vehicle while `points` were measured. The height below which a twentieth of the points lies
  /// is taken as the ground; the place is the median of the points within 0.5 m of it.
  void add(std::span<const Shown> points) {
    if (points.size() < 20) return;
    std::vector<float> heights;
    for (const Shown& p : points) heights.push_back(p.place.z());
    const auto low = heights.begin() + static_cast<std::ptrdiff_t>(heights.size() / 20);
    std::nth_element(heights.begin(), low, heights.end());
    const float ground = *low;
    std::vector<float> east, north;
    for (const Shown& p : points)
      if (std::abs(p.place.z() - ground) < 0.5f) east.push_back(p.place.x()), north.push_back(p.place.y());
    const auto median = [](std::vector<float>& values) {
      const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
      std::nth_element(values.begin(), middle, values.end());
      return static_cast<double>(*middle);
    };
    knots_.push_back({(points.front().fired + points.back().fired) / 2.0, {median(east), median(north), ground}});
  }

  std::vector<Knot> knots_;
};

struct Scene {
  std::vector<Shown> points;  // in the order of their times
  Way way;
  Status read;
};

/// Returns the points that the picture needs, from `begin` - before_s to `begin` + `length`.
Result<Scene> scene_of(LasReader& reader, const CrsInMetres& metric, const Extent& extent, double begin, double length,
                       const MovingViewConfig& config) {
  const LasExtraField* state = reader.extra_field(las_extra_name<&ColouredPoint::state>());
  const LasExtraField* exposure = reader.extra_field(las_extra_name<&ColouredPoint::exposure>());
  const PointColour colour(reader, extent.brightest_colour < 256, extent.brightest_intensity);
  const double brightest = std::max<std::uint16_t>(1, extent.brightest_intensity);
  std::map<std::uint32_t, float> ends;  // for each exposure, the time when the last return that belongs to it was fired
  EvenShare share(config.most_points);
  std::optional<Eigen::Vector3d> base;
  std::array<std::uint8_t, 256> lifted;
  for (std::size_t v = 0; v < lifted.size(); ++v)
    lifted[v] = static_cast<std::uint8_t>(
        std::lround(255 * portable::pow(static_cast<double>(v) / 255, 1 / config.brightening)));
  const auto lift = [&lifted](Rgb c) { return Rgb{lifted[c[0]], lifted[c[1]], lifted[c[2]]}; };
  const Status read = for_each_point(reader, [&](const LasPoint& p) {
    if (!p.time) return;
    const double t = *p.time - begin;
    if (!(t >= -config.before_s && t <= length + 3)) return;  // the path beyond the end still turns the eye
    const Eigen::Vector3d place = metric.place(p);
    if (!place.allFinite()) return;
    if (!base) base = place;
    Shown shown{(place - *base).cast<float>(),
                static_cast<float>(t),
                static_cast<float>(t),
                kNoExposure,
                lift(colour(p)),
                static_cast<std::uint8_t>(120 + 130 * std::sqrt(p.intensity / brightest))};
    if (state && exposure && colour.is_coloured(p)) {
      const double number = LasReader::extra(p, *exposure);
      if (number >= 0 && number < kNoExposure) shown.exposure = static_cast<std::uint32_t>(number);
      if (shown.exposure != kNoExposure && LasReader::extra(p, *state) == static_cast<double>(ColourState::Direct)) {
        const auto [at, is_new] = ends.try_emplace(shown.exposure, shown.fired);
        if (!is_new) at->second = std::max(at->second, shown.fired);
      }
    }
    share.offer(shown);
  });
  if (!read && read.error().code != ErrorCode::Truncated) return read.error();
  std::vector<Shown> points = share.take();
  std::stable_sort(points.begin(), points.end(), [](const Shown& a, const Shown& b) { return a.fired < b.fired; });
  for (Shown& p : points)
    if (const auto end = ends.find(p.exposure); end != ends.end()) p.coloured = std::max(p.fired, end->second);
  Way way(points);
  if (way.empty()) return Error{ErrorCode::Invalid, "too few points for a moving picture at that place"};
  // Points far from the vehicle are sparse and show little.
  std::vector<Eigen::Vector3d> places;
  constexpr double kStep = 0.1;
  for (double t = -config.before_s; t <= length + kStep; t += kStep) places.push_back(way.at(t));
  std::erase_if(points, [&](const Shown& p) {
    if (p.fired > length) return true;
    const auto i = static_cast<std::size_t>((p.fired + config.before_s) / kStep);
    return (p.place.cast<double>() - places[std::min(i, places.size() - 1)]).head<2>().norm() > config.reach_m;
  });
  return Scene{std::move(points), std::move(way), read};
}

Rgb background(int row, int height) {
  const double down = static_cast<double>(row) / height;
  const auto mix = [down](int top, int bottom) { return static_cast<std::uint8_t>(top + (bottom - top) * down); };
  return {mix(12, 34), mix(16, 40), mix(26, 50)};
}

RgbImage frame_at(const Scene& scene, double now, const MovingViewConfig& config) {
  const int margin = 8 * kFiner;  // so that pixels at the border have neighbours outside
  const int width = config.width * kFiner + 2 * margin, height = config.height * kFiner + 2 * margin;
  const double focal = config.width * kFiner / 2.0 / portable::tan(config.horizontal_view / 2);
  const double heading = scene.way.heading(now, config.behind_m);
  const Eigen::Vector3d eye = scene.way.at(now) -
                              config.behind_m * Eigen::Vector3d(portable::sin(heading), portable::cos(heading), 0) +
                              Eigen::Vector3d(0, 0, config.above_m);
  const double pitch = -portable::atan2(config.above_m, config.behind_m + config.ahead_m);
  const PointView view(eye, heading, pitch, focal, width, height);

  const double nearest = 0.3 * portable::hypot(config.behind_m, config.above_m);  // nearer walls would hide the street
  PointCanvas canvas(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) canvas.image.at(x, y) = background(y, height);
  const auto draw = [&](const Shown& p, Rgb colour, double splat_m, double nearer) {
    const PointView::Seen seen = view.project(p.place.cast<double>());
    if (!(seen.depth > nearest)) return;
    const double radius_m = std::max(splat_m, 0.0012 * seen.depth);
    const double radius_px = std::min(focal * radius_m / seen.depth, 12.0 * kFiner);
    if (seen.x < -radius_px || seen.y < -radius_px || seen.x > width + radius_px || seen.y > height + radius_px) return;
    draw_disc(canvas, seen.x, seen.y, radius_px, seen.depth - nearer, radius_m, colour);
  };
  const auto end = std::upper_bound(scene.points.begin(), scene.points.end(), static_cast<float>(now),
                                    [](float t, const Shown& p) { return t < p.fired; });
  for (auto p = scene.points.begin(); p != end; ++p)
    if (p->coloured <= now) draw(*p, p->colour, 0.055, 0);
  close_gaps(canvas, 3.0, 32);
  close_gaps(canvas, 7.0, 64);
  for (auto p = scene.points.begin(); p != end; ++p)
    if (p->coloured > now) draw(*p, {p->grey, p->grey, p->grey}, 0.02, 0.3);

  RgbImage frame(config.width, config.height, {});
  for (int y = 0; y < config.height; ++y)
    for (int x = 0; x < config.width; ++x) {
      int sum[3] = {0, 0, 0};
      for (int j = 0; j < kFiner; ++j)
        for (int i = 0; i < kFiner; ++i)
          for (std::size_t k = 0; k < 3; ++k)
            sum[k] += canvas.image.at(margin + x * kFiner + i, margin + y * kFiner + j)[k];
      for (std::size_t k = 0; k < 3; ++k) frame.at(x, y)[k] = static_cast<std::uint8_t>(sum[k] / (kFiner * kFiner));
    }
  return frame;
}

}  // namespace

std::string MovingViewConfig::validate() const {
  const auto within = [](double value, double least, double most) { return value >= least && value <= most; };
  if (!within(start, 0, 0.95)) return "start must be from 0 to 0.95";
  if (!within(drive_s, kLeast, 60)) return "drive_s must be from 0.5 to 60 s";
  if (!within(speed, 0.5, 20)) return "speed must be from 0.5 to 20";
  if (!within(frames_per_s, 1, 50)) return "frames_per_s must be from 1 to 50";
  if (!within(width, 16, 4096) || !within(height, 16, 4096)) return "width and height must be from 16 to 4096";
  if (!within(quality, 0, 100)) return "quality must be from 0 to 100";
  if (!within(brightening, 0.2, 5)) return "brightening must be from 0.2 to 5";
  if (!within(horizontal_view, 0.2, 2.6)) return "horizontal_view must be from 0.2 to 2.6 rad";
  if (!within(behind_m, -1000, 1000) || !within(above_m, 0.5, 1000) || !within(ahead_m, -1000, 1000))
    return "behind_m and ahead_m must be within 1000 m, above_m from 0.5 to 1000 m";
  if (!(reach_m > 0 && before_s >= 0)) return "reach_m must be above 0, before_s not below";
  if (most_points < 1000) return "most_points must be 1000 or more";
  return {};
}

Result<MovingView> picture_while_driving(const std::filesystem::path& las, const MovingViewConfig& config) {
  if (std::string wrong = config.validate(); !wrong.empty()) return Error{ErrorCode::Invalid, wrong};
  Result<LasReader> reader = LasReader::open(las);
  if (!reader) return reader.error();
  const auto about = [&las](Error error) { return Error{error.code, las.string() + ": " + error.message}; };
  const Result<CrsInMetres> metric = crs_in_metres(*reader);
  if (!metric) return about(metric.error());
  const Result<Extent> extent = extent_of(*reader);
  if (!extent) return extent.error();
  if (extent->first > extent->last)
    return about({ErrorCode::Unsupported, "a moving picture needs points with times, and it has none"});
  const double begin = extent->first + config.start * (extent->last - extent->first);
  const double length = std::min(config.drive_s, extent->last - begin);
  if (length < kLeast) return about({ErrorCode::Invalid, "less than 0.5 s of drive from that place on"});
  const Result<Scene> scene = scene_of(*reader, *metric, *extent, begin, length, config);
  if (!scene) return scene.error().code == ErrorCode::Invalid ? about(scene.error()) : scene.error();

  Result<WebpAnimation> animation = WebpAnimation::create(config.width, config.height, config.quality);
  if (!animation) return animation.error();
  const int frames = std::max(1, static_cast<int>(std::lround(length / config.speed * config.frames_per_s)));
  const auto shown_at = [&](int frame) { return static_cast<int>(std::lround(frame * 1000 / config.frames_per_s)); };
  constexpr int kRestMs = 800;  // the last frame stays for people to look at
  for (int i = 0; i < frames; ++i) {
    const double now = std::min(length, i * config.speed / config.frames_per_s);
    const int duration = shown_at(i + 1) - shown_at(i) + (i + 1 == frames ? kRestMs : 0);
    if (Status added = animation->add(frame_at(*scene, now, config), duration); !added) return added.error();
  }
  Result<Bytes> webp = animation->finish();
  if (!webp) return webp.error();
  return MovingView{std::move(*webp), frames, scene->read};
}

}  // namespace hueline::storage
