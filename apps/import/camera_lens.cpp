#include "apps/import/camera_lens.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string_view>
#include <tuple>
#include <utility>

#include "apps/colour/published_lens.hpp"
#include "config/section.hpp"

namespace hueline::apps {
namespace {

constexpr std::size_t kMostDistortion = 64;

bool all_finite(const auto& values) {
  return std::ranges::all_of(values, [](double value) { return std::isfinite(value); });
}

std::string parent_of(const std::string& topic) { return topic.substr(0, topic.rfind('/') + 1); }

/// One axis of an image: from the whole image of the calibration to the pixels that were sent.
struct Axis {
  double whole, begin, part, joined, sent;  ///< px of the whole, but for `sent`

  double expected() const { return part / joined; }
  /// The last pixels of a part that cannot be joined are left out.
  bool is_as_expected() const { return std::abs(sent - expected()) < 1; }
  double scale() const { return is_as_expected() ? 1 / joined : sent / part; }
  double place(double px) const { return (px - begin + 0.5) * scale() - 0.5; }  // pixel centres have whole numbers
};

Axis axis_of(std::uint32_t whole, std::uint32_t begin, std::uint32_t part, std::uint32_t binning, std::uint32_t sent) {
  const std::uint32_t size = whole == 0 ? sent : whole;
  return {double(size), double(begin), double(part == 0 ? size : part), double(std::max(binning, 1u)), double(sent)};
}

/// Makes a lens, and throws as take_lens(). Adds to `remark` what a user must know of it.
fusion::CameraIntrinsics made_lens(const PublishedLens& said, std::string& remark) {
  ShotCalibration out;
  take_lens(said, "its CameraInfo", "K", out);
  if (!out.lens_note.empty()) remark += "; " + out.lens_note.substr(0, out.lens_note.find('\n'));
  return *out.intrinsics;
}

/// Makes the lens of a whole image of `width` x `height` px. Where its distortion is not read it has none, and `why`
/// says so. Throws as take_lens() if the matrix is not one of a camera.
fusion::CameraIntrinsics whole_lens(const CameraFacts& facts, bool is_rectified, std::uint32_t width,
                                    std::uint32_t height, ImportedLens& out) {
  PublishedLens said;
  said.K.assign(facts.K.begin(), facts.K.end());
  said.width = facts.width == 0 ? width : facts.width;
  said.height = facts.height == 0 ? height : facts.height;
  if (is_rectified) {
    if (facts.P[0] > 0) said.K = {facts.P[0], 0, facts.P[2], 0, facts.P[5], facts.P[6], 0, 0, 1};
    return made_lens(said, out.remark);
  }
  const fusion::CameraIntrinsics plain = made_lens(said, out.remark);
  // Drivers have words of their own for a fisheye, and call a projection through one point what has no model.
  const std::string loose = loose_model(facts.model);
  said.model = loose == "equidistant" ? loose : lower_case(facts.model) == "pinhole" ? "" : facts.model;
  said.distortion = facts.distortion;
  try {
    return made_lens(said, out.remark);
  } catch (const config::ConfigError& e) {
    out.why = e.what();
    return plain;
  }
}

/// Says what rectified images have beside a lens without distortion: their camera is turned by R, and P places that of
/// a stereo pair's second one beside the first. Programs differ in which of them the frame of the images has.
std::string doubt_of(const CameraFacts& facts) {
  constexpr double kDegree = std::numbers::pi / 180, kSmallTurn = 0.02 * kDegree, kSmallWay_m = 1e-3;
  std::string out;
  const double trace = facts.R[0] + facts.R[4] + facts.R[8];
  const double turn = trace == 0 ? 0 : std::acos(std::clamp((trace - 1) / 2, -1.0, 1.0));
  if (turn > kSmallTurn)
    out = fmt::format("they are turned by {:.2f} deg against the camera (R of its CameraInfo)", turn / kDegree);
  const double x = facts.P[0] > 0 ? 0 - facts.P[3] / facts.P[0] : 0,
               y = facts.P[5] > 0 ? 0 - facts.P[7] / facts.P[5] : 0;
  if (std::max(std::abs(x), std::abs(y)) > kSmallWay_m)
    out += fmt::format("{}P of its CameraInfo places them {:.3f} m to the right of and {:.3f} m below the first camera",
                       out.empty() ? "" : ", and ", x, y);
  if (out.empty()) return out;
  return "its images are rectified: " + out +
         ". The frame of the images is taken for that of the rectified images; if it is that of the camera (or of the "
         "first one), enter T_head_lens";
}

fusion::CameraIntrinsics guess(std::uint32_t width, std::uint32_t height) {
  fusion::CameraIntrinsics out;
  out.focal_px.fill(width);
  out.principal_point_px = {width * 0.5, height * 0.5};
  return out;
}

/// Fits the lens of a whole image to that part of it which was sent, and says what was done.
void fit(const CameraFacts& facts, ImportedLens& out) {
  const std::uint32_t width = out.lens.width, height = out.lens.height;
  const Axis x = axis_of(facts.width, facts.part_x, facts.part_width, facts.binning_x, width);
  const Axis y = axis_of(facts.height, facts.part_y, facts.part_height, facts.binning_y, height);
  if (x.begin + x.part > x.whole || y.begin + y.part > y.whole) {
    out.why = fmt::format("the part of {} x {} px from ({}, {}) on that its CameraInfo names lies outside its {} x {}",
                          x.part, y.part, x.begin, y.begin, x.whole, y.whole);
    return;
  }
  out.lens.focal_px.array() *= Eigen::Array2d(x.scale(), y.scale());
  out.lens.principal_point_px = {x.place(out.lens.principal_point_px.x()), y.place(out.lens.principal_point_px.y())};
  if (x.begin > 0 || y.begin > 0)
    out.remark += fmt::format("; it is the part of {} x {} px from ({}, {}) on", x.part, y.part, x.begin, y.begin);
  if (x.scale() == 1 && y.scale() == 1) return;
  out.remark += fmt::format("; scaled from {} x {} px", x.part, y.part);
  constexpr double kSameShape = 0.01;
  if (std::abs(x.scale() / y.scale() / (y.joined / x.joined) - 1) > kSameShape)
    out.why = fmt::format("its CameraInfo is that of {} x {} px, an image of another shape: the images were cut",
                          x.part, y.part);
}

}  // namespace

CameraFacts take_camera_info(drivers::RosReader in) {
  CameraFacts out;
  out.frame = in.take_header().frame;
  if (out.frame.starts_with('/')) out.frame.erase(0, 1);  // ROS 1's first tf wrote one
  out.height = in.take<std::uint32_t>();
  out.width = in.take<std::uint32_t>();
  out.model = in.take_string();
  const std::uint32_t count = in.take_count(8);
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto value = in.take<double>();
    if (i < kMostDistortion || value != 0) out.distortion.push_back(value);
  }
  for (double& value : out.K) value = in.take<double>();
  for (double& value : out.R) value = in.take<double>();
  for (double& value : out.P) value = in.take<double>();
  for (std::uint32_t* value : {&out.binning_x, &out.binning_y, &out.part_x, &out.part_y})
    *value = in.take<std::uint32_t>();
  out.part_height = in.take<std::uint32_t>();
  out.part_width = in.take<std::uint32_t>();
  if (!in.ok())
    out.why = "it does not have the form of its type";
  else if (!all_finite(out.K) || !all_finite(out.R) || !all_finite(out.P) || !all_finite(out.distortion))
    out.why = "some of its values are no numbers";
  else if (out.K[0] <= 0 || out.K[4] <= 0)
    out.why = "its focal lengths are 0, as of a camera that was not calibrated";
  return out;
}

bool is_rectified(const std::string& topic) {
  for (std::size_t begin = 0; begin < topic.size();) {
    const std::size_t end = std::min(topic.find_first_of("/_", begin), topic.size());
    const std::string_view word(topic.data() + begin, end - begin);
    if (word == "rect" || word == "rectified" || word == "undistorted") return true;
    begin = end + 1;
  }
  return false;
}

FoundFacts find_facts(const std::map<std::string, CameraFacts>& facts, const std::string& topic,
                      const std::string& frame, bool is_only_camera) {
  enum Nearness { None, Beside, Alone, SamePath, SameFrame };
  FoundFacts best;
  std::tuple<Nearness, std::size_t> nearest{None, 0};
  for (const auto& [name, one] : facts) {
    const std::string path = parent_of(name);
    const std::size_t common = topic.starts_with(path) ? path.size() : 0;
    const bool is_open = frame.empty() || one.frame.empty();
    Nearness nearness = None;
    if (!is_open && one.frame == frame)
      nearness = SameFrame;
    else if (is_open && common > 1)  // more than the slash that all have
      nearness = SamePath;
    else if (is_open && facts.size() == 1 && is_only_camera)
      nearness = Alone;
    else if (!is_open && common > 1 && name.ends_with("/camera_info"))
      nearness = Beside;
    if (nearness == None || std::tuple(nearness, common) <= nearest) continue;
    nearest = {nearness, common};
    best = {name, nearness != Beside};
  }
  return best;
}

ImportedLens lens_of(const CameraFacts* facts, bool is_rectified, std::uint32_t width, std::uint32_t height) {
  ImportedLens out;
  const auto give_up = [&](std::string why) {
    out.lens = guess(width, height);
    out.lens.width = width, out.lens.height = height;
    out.remark.clear();
    out.why = std::move(why);
    return out;
  };
  if (!facts) return give_up("the recording does not say its calibration");
  if (!facts->why.empty()) return give_up("its CameraInfo is not used: " + facts->why);
  try {
    out.lens = whole_lens(*facts, is_rectified, width, height, out);
  } catch (const config::ConfigError& e) {
    return give_up(e.what());
  }
  out.lens.width = width, out.lens.height = height;
  if (is_rectified) out.doubt = doubt_of(*facts);
  if (is_rectified && facts->P[0] > 0) out.remark += "; the images are rectified, so it is that of P";
  fit(*facts, out);
  if (out.why.empty() && is_rectified && facts->P[0] <= 0)
    out.why = "its images are rectified, and its CameraInfo has no P: the values are those of K";
  if (const auto wrong = out.lens.validate(); !wrong.empty()) return give_up("of its CameraInfo, " + wrong.text());
  if (!out.remark.empty()) out.remark.erase(0, 2);
  return out;
}

}  // namespace hueline::apps
