#include "calibration/mount/alignment_score.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace hueline::calibration {
namespace {

constexpr int kBins = 24;
constexpr float kOutline = 0.25F;  // fainter ones are not looked at

/// Projection of a lens in float, for millions of points: project_with without its checks.
struct FastLens {
  LensModel model;
  float fx, fy, cx, cy, cosine;
  float k[5];
  Eigen::Matrix3f R_lens_body;
  Eigen::Vector3f t_lens_body;

  bool project(const Eigen::Vector3f& p_body, float& u, float& v) const {
    const Eigen::Vector3f p = R_lens_body * p_body + t_lens_body;
    const float r2 = p.x() * p.x() + p.y() * p.y(), length = std::sqrt(r2 + p.z() * p.z());
    if (!(p.z() > cosine * length) || !(length > 0.3F)) return false;
    if (model == LensModel::Brown) {
      const float a = p.x() / p.z(), b = p.y() / p.z(), s = a * a + b * b;
      const float radial = 1 + s * (k[0] + s * (k[1] + s * k[4]));
      u = fx * (a * radial + 2 * k[2] * a * b + k[3] * (s + 2 * a * a)) + cx;
      v = fy * (b * radial + k[2] * (s + 2 * b * b) + 2 * k[3] * a * b) + cy;
      return true;
    }
    const float across = std::sqrt(r2), angle = std::atan2(across, p.z()), a2 = angle * angle;
    const float scale = across > 1e-9F ? angle * (1 + a2 * (k[0] + a2 * (k[1] + a2 * (k[2] + a2 * k[3])))) / across : 1.0F;
    u = fx * p.x() * scale + cx;
    v = fy * p.y() * scale + cy;
    return true;
  }
};

FastLens fast(const AlignmentLens& lens, const Transform<CameraHead, Body>& T_head_body, const AlignmentShot& shot, double time_offset_s) {
  // The image was made later than said: by then the vehicle has gone on, and what stands still lies farther back in Body.
  const Eigen::Vector3d turn = shot.turn_rate_body * time_offset_s;
  const double angle = turn.norm();
  const Eigen::Quaterniond gone = angle > 0 ? Eigen::Quaterniond(Eigen::AngleAxisd(-angle, turn / angle)) : Eigen::Quaterniond::Identity();
  const Transform<Body, Body> later{gone, -(gone * (shot.velocity_body * time_offset_s))};
  const Transform<Lens, Body> T = lens.T_head_lens.inverse() * T_head_body * later;
  FastLens out;
  out.model = lens.values.model;
  out.fx = static_cast<float>(lens.values.focal_px.x());
  out.fy = static_cast<float>(lens.values.focal_px.y());
  out.cx = static_cast<float>(lens.values.principal_point_px.x());
  out.cy = static_cast<float>(lens.values.principal_point_px.y());
  out.cosine = static_cast<float>(std::cos(std::min(lens.max_angle, lens.values.model == LensModel::Brown ? 1.4 : 3.0)));
  for (std::size_t i = 0; i < 5; ++i) out.k[i] = static_cast<float>(lens.values.distortion[i]);
  out.R_lens_body = T.rotation.toRotationMatrix().cast<float>();
  out.t_lens_body = T.translation.cast<float>();
  return out;
}

}  // namespace

Transform<Body, CameraHead> corrected(const Transform<Body, CameraHead>& start, const HeadCorrection& correction) {
  const Eigen::Vector3d turn = correction.head<3>();
  const double angle = turn.norm();
  if (!(angle > 0)) return start;
  return {(start.rotation * Eigen::Quaterniond(Eigen::AngleAxisd(angle, turn / angle))).normalized(), start.translation};
}

AlignmentScore::AlignmentScore(const std::vector<AlignmentLens>& lenses, const std::vector<AlignmentShot>& shots, const std::vector<std::size_t>& which,
                               const Transform<Body, CameraHead>& start, const AlignmentConfig& config, float blur_px, std::size_t stride)
    : lenses_(lenses), start_(start), config_(config) {
  for (const std::size_t index : which) {
    const AlignmentShot& shot = shots[index];
    Prepared one{&shot, {}, {}, 0, {}, {}};
    if (config.use_outlines) {
      one.edges = edge_picture(shot.image, blur_px);
      double sum = 0;
      for (const auto v : one.edges.values) sum += v;
      one.mean_edge = sum / static_cast<double>(one.edges.values.size());
    }
    if (config.use_intensity) one.grey = grey_picture(shot.image, blur_px);
    // Only what may come into this lens's image is kept.
    const FastLens lens = fast(lenses[shot.lens], start.inverse(), shot, 0);
    const float margin = static_cast<float>(config.search_deg * 1.8 * 0.01745) * lens.fx + 4 * blur_px;
    std::size_t skip = 0;
    for (const LaserSample& sample : shot.samples) {
      float u, v;
      if (!lens.project(sample.p_body, u, v) || u < -margin || v < -margin || u > static_cast<float>(shot.image.width) + margin ||
          v > static_cast<float>(shot.image.height) + margin)
        continue;
      if (config.use_outlines && sample.outline >= kOutline) one.outlines.push_back(sample);
      if (config.use_intensity && skip++ % stride == 0) one.others.push_back(sample);
    }
    outlines_ += one.outlines.size();
    samples_ += one.others.size();
    prepared_.push_back(std::move(one));
  }
}

double AlignmentScore::score(const HeadCorrection& correction) const {
  const auto T_head_body = corrected(start_, correction).inverse();
  double edge = 0, weight = 0;
  std::array<double, kBins * kBins> joint{};
  double count = 0;
  for (const Prepared& one : prepared_) {
    const FastLens lens = fast(lenses_[one.shot->lens], T_head_body, *one.shot, correction[3]);
    float u, v;
    for (const LaserSample& sample : one.outlines) {
      if (!lens.project(sample.p_body, u, v)) continue;
      const float value = one.edges.at(u, v);
      if (value < 0) continue;
      edge += static_cast<double>(sample.outline) * (static_cast<double>(value) - one.mean_edge);
      weight += static_cast<double>(sample.outline);
    }
    for (const LaserSample& sample : one.others) {
      if (!lens.project(sample.p_body, u, v)) continue;
      const float value = one.grey.at(u, v);
      if (value < 0) continue;
      // Shared between the two nearest bins of the picture's axis: the score has no steps.
      const float place = value * ((kBins - 1) / 255.0F);
      const int bin = std::min(static_cast<int>(place), kBins - 2), row = std::min(static_cast<int>(sample.intensity * kBins), kBins - 1);
      const double upper = static_cast<double>(place) - bin;
      joint[static_cast<std::size_t>(row * kBins + bin)] += 1 - upper;
      joint[static_cast<std::size_t>(row * kBins + bin + 1)] += upper;
      count += 1;
    }
  }
  double out = 0;
  if (weight > 0) out += edge / weight / 255.0;
  if (count > 0) {
    std::array<double, kBins> rows{}, columns{};
    for (int r = 0; r < kBins; ++r)
      for (int c = 0; c < kBins; ++c) {
        rows[static_cast<std::size_t>(r)] += joint[static_cast<std::size_t>(r * kBins + c)];
        columns[static_cast<std::size_t>(c)] += joint[static_cast<std::size_t>(r * kBins + c)];
      }
    double information = 0;
    for (int r = 0; r < kBins; ++r)
      for (int c = 0; c < kBins; ++c) {
        const double p = joint[static_cast<std::size_t>(r * kBins + c)] / count;
        if (p > 0) information += p * std::log(p * count * count / (rows[static_cast<std::size_t>(r)] * columns[static_cast<std::size_t>(c)]));
      }
    out += information;
  }
  return out;
}

}  // namespace hueline::calibration
