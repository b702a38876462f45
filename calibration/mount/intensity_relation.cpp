#include "calibration/mount/intensity_relation.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/angle.hpp"

namespace hueline::calibration {
namespace {

constexpr int kPatchesAcross = 38;  // most patches across an image
constexpr float kPatchOfBlur = 5;   // least width of a patch in blurs; a smaller patch has no edges left
// Mean number of samples of a patch if they are spread evenly, which gives the patch's width.
constexpr double kMeanSamples = 25;
constexpr std::size_t kFewestSamples = 15;  // least number of samples of a patch
// Least F value: variance that the grey level explains, over the remaining variance of a sample. 9 is three sigma.
constexpr double kLeastRatio = 9;
constexpr double kLeastShare = 0.15;  // least share of the variance that the grey level explains
constexpr double kFloor = 0.02;       // least residual of a patch, in rank
constexpr double kRobust = 2.4;       // Cauchy weight with 95 % efficiency
constexpr int kReweightings = 3;
constexpr double kHiddenCell_deg = 1.0;  // something nearer within one and a half cells hides ...
// ... a sample that is farther away by this factor and this distance.
constexpr float kHiddenShare = 1.2F, kHidden_m = 0.3F;

/// One sample in an image.
struct Hit {
  std::uint32_t sample;
  float u, v, grey;
};

/// The derivatives of a pixel with respect to rotation and time.
class PixelMotion {
 public:
  PixelMotion(const AlignmentLens& lens, const AlignmentShot& shot, const Transform<CameraHead, Body>& T_head_body,
              const FastLens& fast)
      : fast_(fast),
        R_lens_head_(lens.T_head_lens.rotation.conjugate().toRotationMatrix()),
        R_lens_body_(fast.R_lens_body.cast<double>()),
        T_head_body_(T_head_body),
        velocity_(shot.velocity_body),
        turn_rate_(shot.turn_rate_body) {}

  /// Returns the derivatives of u (first row) and v (second row).
  Eigen::Matrix<double, 2, 4> at(const Eigen::Vector3f& p_body) const {
    // Step of the difference quotient as a share of the range; exact enough for the iteration.
    constexpr float kShare = 2e-3F;
    const Eigen::Vector3f p_lens = fast_.R_lens_body * p_body + fast_.t_lens_body;
    const float h = kShare * p_lens.norm();
    Eigen::Matrix<double, 2, 3> of_lens;
    for (int i = 0; i < 3; ++i) {
      float u0, v0, u1, v1;
      if (!fast_.project_lens(p_lens - h * Eigen::Vector3f::Unit(i), u0, v0) ||
          !fast_.project_lens(p_lens + h * Eigen::Vector3f::Unit(i), u1, v1))
        return Eigen::Matrix<double, 2, 4>::Zero();
      of_lens.col(i) = Eigen::Vector2f(u1 - u0, v1 - v0).cast<double>() / (2 * static_cast<double>(h));
    }
    Eigen::Matrix<double, 2, 4> out;
    const Eigen::Vector3d p = p_body.cast<double>(), p_head = T_head_body_.rotation * p + T_head_body_.translation;
    for (int i = 0; i < 3; ++i)
      out.col(i) = of_lens * (R_lens_head_ * p_head.cross(Eigen::Vector3d::Unit(i)));  // exp(-turn) p_head
    out.col(3) = -of_lens * (R_lens_body_ * (velocity_ + turn_rate_.cross(p)));
    return out;
  }

 private:
  const FastLens& fast_;
  Eigen::Matrix3d R_lens_head_, R_lens_body_;
  Transform<CameraHead, Body> T_head_body_;
  Eigen::Vector3d velocity_, turn_rate_;
};

/// The robust relation intensity = a + b grey over the samples of a patch.
struct Relation {
  double b = 0, variance = 0, mean_grey = 0, mean_intensity = 0, spread = 0;
  std::vector<double> weights;
  bool is_there = false;
};

Relation relation_of(const std::vector<Hit>& hits, const std::vector<std::size_t>& of_patch,
                     const std::vector<LaserSample>& samples) {
  Relation out;
  out.weights.assign(of_patch.size(), 1.0);
  for (int pass = 0; pass < kReweightings; ++pass) {
    double sum = 0, x = 0, g = 0, xx = 0, gg = 0, xg = 0;
    for (std::size_t i = 0; i < of_patch.size(); ++i) {
      const Hit& hit = hits[of_patch[i]];
      sum += out.weights[i];
      x += out.weights[i] * static_cast<double>(samples[hit.sample].intensity);
      g += out.weights[i] * static_cast<double>(hit.grey);
    }
    out.mean_intensity = x / sum;
    out.mean_grey = g / sum;
    for (std::size_t i = 0; i < of_patch.size(); ++i) {
      const Hit& hit = hits[of_patch[i]];
      const double dx = static_cast<double>(samples[hit.sample].intensity) - out.mean_intensity,
                   dg = static_cast<double>(hit.grey) - out.mean_grey;
      xx += out.weights[i] * dx * dx;
      gg += out.weights[i] * dg * dg;
      xg += out.weights[i] * dx * dg;
    }
    if (!(gg > 1e-9) || !(xx > 1e-9) || !(sum > 4)) return out;
    out.b = xg / gg;
    out.spread = gg;
    const double left = std::max(0.0, xx - xg * out.b), share = 1 - left / xx;
    out.variance = std::max(left / (sum - 2), kFloor * kFloor);
    out.is_there = share > kLeastShare && share * (sum - 2) > kLeastRatio * (1 - share);
    if (pass + 1 == kReweightings) break;
    for (std::size_t i = 0; i < of_patch.size(); ++i) {
      const Hit& hit = hits[of_patch[i]];
      const double r = static_cast<double>(samples[hit.sample].intensity) - out.mean_intensity -
                       out.b * (static_cast<double>(hit.grey) - out.mean_grey);
      out.weights[i] = 1 / (1 + r * r / (kRobust * kRobust * out.variance));
    }
  }
  return out;
}

/// Returns the samples that the lens can see: within its image or `margin_deg` beside it, and not hidden by something
/// nearer.
std::vector<std::uint32_t> seen_by(const AlignmentLens& lens, const AlignmentShot& shot,
                                   const Transform<CameraHead, Body>& T_head_body, double margin_deg) {
  const FastLens fast = fast_lens(lens, T_head_body, shot, 0);
  const float cell = std::max(2.0F, fast.fx * static_cast<float>(kHiddenCell_deg * kRadPerDeg)),
              margin = fast.fx * static_cast<float>(margin_deg * kRadPerDeg) + 2 * cell;
  const int columns = static_cast<int>((static_cast<float>(shot.image.width) + 2 * margin) / cell) + 3,
            rows = static_cast<int>((static_cast<float>(shot.image.height) + 2 * margin) / cell) + 3;
  std::vector<float> nearest(static_cast<std::size_t>(columns * rows), 1e9F);
  struct Candidate {
    std::uint32_t sample;
    int column, row;
    float range;
  };
  std::vector<Candidate> candidates;
  for (std::uint32_t i = 0; i < shot.samples->size(); ++i) {
    const Eigen::Vector3f& p = (*shot.samples)[i].p_body;
    float u, v;
    if (!fast.project(p, u, v) || u < -margin || v < -margin || u > static_cast<float>(shot.image.width) + margin ||
        v > static_cast<float>(shot.image.height) + margin)
      continue;
    const Candidate one{i, static_cast<int>((u + margin) / cell) + 1, static_cast<int>((v + margin) / cell) + 1,
                        (fast.R_lens_body * p + fast.t_lens_body).norm()};
    float& least = nearest[static_cast<std::size_t>(one.row * columns + one.column)];
    least = std::min(least, one.range);
    candidates.push_back(one);
  }
  std::vector<std::uint32_t> out;
  for (const Candidate& one : candidates) {
    float least = 1e9F;
    for (int r = one.row - 1; r <= one.row + 1; ++r)
      for (int c = one.column - 1; c <= one.column + 1; ++c)
        least = std::min(least, nearest[static_cast<std::size_t>(r * columns + c)]);
    if (one.range <= kHiddenShare * least + kHidden_m) out.push_back(one.sample);
  }
  return out;
}

}  // namespace

HeadNormals& HeadNormals::operator+=(const HeadNormals& other) {
  information += other.information;
  gradient += other.gradient;
  patches += other.patches;
  samples += other.samples;
  squares += other.squares;
  return *this;
}

IntensityRelation::IntensityRelation(const std::vector<AlignmentLens>& lenses, const std::vector<AlignmentShot>& shots,
                                     const Transform<Body, CameraHead>& T_body_head, double margin_deg)
    : lenses_(lenses), shots_(shots) {
  for (const AlignmentShot& shot : shots)
    visible_.push_back(seen_by(lenses[shot.lens], shot, T_body_head.inverse(), margin_deg));
}

HeadNormals IntensityRelation::normals(std::size_t index, const BlurredImage& picture,
                                       const Transform<Body, CameraHead>& T_body_head, double time_offset_s,
                                       std::size_t stride) const {
  const AlignmentShot& shot = shots_[index];
  const AlignmentLens& lens = lenses_[shot.lens];
  const std::vector<LaserSample>& samples = *shot.samples;
  const Transform<CameraHead, Body> T_head_body = T_body_head.inverse();
  const FastLens fast = fast_lens(lens, T_head_body, shot, time_offset_s);
  const PixelMotion motion(lens, shot, T_head_body, fast);
  std::vector<Hit> hits;
  for (std::size_t at = 0; at < visible_[index].size(); at += stride) {
    const std::uint32_t i = visible_[index][at];
    float u, v;
    if (fast.project(samples[i].p_body, u, v) && picture.contains(u, v)) hits.push_back({i, u, v, picture.at(u, v)});
  }
  if (hits.empty()) return {};
  const double full = std::sqrt(kMeanSamples * shot.image.width * shot.image.height / static_cast<double>(hits.size()));
  const int patch = std::max({shot.image.width / kPatchesAcross, static_cast<int>(kPatchOfBlur * picture.blur_px()),
                              std::min(static_cast<int>(full), shot.image.width)}),
            across = shot.image.width / patch + 1;
  std::vector<std::vector<std::size_t>> patches(static_cast<std::size_t>(across * (shot.image.height / patch + 1)));
  for (std::size_t i = 0; i < hits.size(); ++i)
    patches[static_cast<std::size_t>(static_cast<int>(hits[i].v) / patch * across +
                                     static_cast<int>(hits[i].u) / patch)]
        .push_back(i);
  HeadNormals out;
  for (const auto& of_patch : patches) {
    if (of_patch.size() < kFewestSamples) continue;
    const Relation relation = relation_of(hits, of_patch, samples);
    if (!relation.is_there) continue;
    // The slope of each residual, without the part that a and b absorb (Kaufman 1975).
    Eigen::Matrix<double, Eigen::Dynamic, 4> slopes(static_cast<Eigen::Index>(of_patch.size()), 4);
    Eigen::RowVector4d mean = Eigen::RowVector4d::Zero(), along = Eigen::RowVector4d::Zero();
    double sum = 0;
    for (std::size_t i = 0; i < of_patch.size(); ++i) {
      const Hit& hit = hits[of_patch[i]];
      const Eigen::RowVector2d slope(static_cast<double>(picture.slope_u(hit.u, hit.v)),
                                     static_cast<double>(picture.slope_v(hit.u, hit.v)));
      slopes.row(static_cast<Eigen::Index>(i)) = -relation.b * slope * motion.at(samples[hit.sample].p_body);
      mean += relation.weights[i] * slopes.row(static_cast<Eigen::Index>(i));
      sum += relation.weights[i];
    }
    mean /= sum;
    for (std::size_t i = 0; i < of_patch.size(); ++i) {
      slopes.row(static_cast<Eigen::Index>(i)) -= mean;
      along += relation.weights[i] * (static_cast<double>(hits[of_patch[i]].grey) - relation.mean_grey) *
               slopes.row(static_cast<Eigen::Index>(i));
    }
    along /= relation.spread;
    for (std::size_t i = 0; i < of_patch.size(); ++i) {
      const Hit& hit = hits[of_patch[i]];
      const double grey = static_cast<double>(hit.grey) - relation.mean_grey;
      const double residual =
          static_cast<double>(samples[hit.sample].intensity) - relation.mean_intensity - relation.b * grey;
      const Eigen::Vector4d slope = (slopes.row(static_cast<Eigen::Index>(i)) - grey * along).transpose();
      const double weight = relation.weights[i] / relation.variance;
      out.information += weight * slope * slope.transpose();
      out.gradient += weight * residual * slope;
      out.squares += weight * residual * residual;
    }
    ++out.patches;
    out.samples += of_patch.size();
  }
  return out;
}

}  // namespace hueline::calibration
