#include "calibration/mount/alignment_score.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace hueline::calibration {
namespace {

constexpr int kBins = 24;
constexpr float kOutline = 0.25F;  // fainter outlines are not used
// Samples fired farther from the exposure are not used: the lens may not see what the scanner saw from another place.
constexpr float kNear_s = 0.11F;

}  // namespace

AlignmentScore::AlignmentScore(const std::vector<AlignmentLens>& lenses, const std::vector<AlignmentShot>& shots,
                               const std::vector<std::size_t>& which, const Transform<Body, CameraHead>& start,
                               const AlignmentConfig& config, float blur_px, std::size_t most_samples)
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
    // Keeps only samples that may come into the image of this lens.
    const FastLens lens = fast_lens(lenses[shot.lens], start.inverse(), shot, 0);
    const float margin = static_cast<float>(config.search_deg * 1.8 * 0.01745) * lens.fx + 4 * blur_px;
    for (const LaserSample& sample : *shot.samples) {
      if (std::abs(sample.apart_s) > kNear_s) continue;
      float u, v;
      if (!lens.project(sample.p_body, u, v) || u < -margin || v < -margin ||
          u > static_cast<float>(shot.image.width) + margin || v > static_cast<float>(shot.image.height) + margin)
        continue;
      if (config.use_outlines && sample.outline >= kOutline) one.outlines.push_back(sample);
      if (config.use_intensity) one.others.push_back(sample);
    }
    outlines_ += one.outlines.size();
    samples_ += one.others.size();
    prepared_.push_back(std::move(one));
  }
  const auto thin = [&](std::vector<LaserSample> Prepared::*what, std::size_t& count) {
    const std::size_t stride = (count + most_samples - 1) / std::max<std::size_t>(1, most_samples);
    if (stride < 2) return;
    count = 0;
    std::size_t skip = 0;
    for (Prepared& one : prepared_) {
      std::erase_if(one.*what, [&](const LaserSample&) { return skip++ % stride != 0; });
      count += (one.*what).size();
    }
  };
  thin(&Prepared::outlines, outlines_);
  thin(&Prepared::others, samples_);
}

double AlignmentScore::score(const HeadCorrection& correction) const {
  const auto T_head_body = corrected(start_, correction).inverse();
  double edge = 0, weight = 0;
  std::array<double, kBins * kBins> joint{};
  double count = 0;
  for (const Prepared& one : prepared_) {
    const FastLens lens = fast_lens(lenses_[one.shot->lens], T_head_body, *one.shot, correction[3]);
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
      // A value is shared between the two nearest bins of the picture's axis, so that the score is continuous.
      const float place = value * ((kBins - 1) / 255.0F);
      const int bin = std::min(static_cast<int>(place), kBins - 2),
                row = std::min(static_cast<int>(sample.intensity * kBins), kBins - 1);
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
        if (p > 0)
          information += p * std::log(p * count * count /
                                      (rows[static_cast<std::size_t>(r)] * columns[static_cast<std::size_t>(c)]));
      }
    out += information;
  }
  return out;
}

}  // namespace hueline::calibration
