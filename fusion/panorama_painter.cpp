#include <algorithm>
#include <cmath>

#include "fusion/panorama_scene.hpp"
#include "fusion/sight_sampler.hpp"

namespace hueline::fusion {
namespace {

/// Lenses mix where the cosines of the angles between their axes and the direction differ by less than this: details,
/// and coarse differences of brightness. Between two lenses 72 degrees apart the bands are 3 and 19 degrees wide.
constexpr float kNarrow = 0.03f, kWide = 0.2f;

/// Divides a pixel among the lenses of one moment: first among those whose cosine is within `band` of the best, each as
/// far as its ramp allows; what these leave goes to the others. Returns the sum, 0 to 1, of what is written to
/// `weights`.
template <class Seer>
float divide(std::span<const Seer> seen, float band, float* weights) {
  float best = -2, in_band = 0, first = 0, rest = 0;
  for (const Seer& seer : seen) best = std::max(best, seer.cosine);
  const auto nearly = [&](const Seer& seer) { return std::max(0.0f, 1 - (best - seer.cosine) / band); };
  for (const Seer& seer : seen) in_band += nearly(seer);
  for (const Seer& seer : seen) {
    first += nearly(seer) / in_band * seer.ramp;
    rest += (1 - nearly(seer)) * seer.ramp;
  }
  const float left = (1 - first) / std::max(1.0f, rest);
  float sum = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const float b = nearly(seen[i]);
    weights[i] = seen[i].ramp * (b / in_band + left * (1 - b));
    sum += weights[i];
  }
  return sum;
}

}  // namespace

PanoramaPainter::PanoramaPainter(const PanoramaScene& scene, const PanoramaRenderer::Config& config, float hole_cosine)
    : scene_(scene),
      config_(config),
      hole_cosine_(hole_cosine),
      looks_(scene.eyes.size()),
      orders_(scene.eyes.size()),
      sums_(scene.view.shape.width),
      found_(scene.view.shape.width) {
  for (Order& order : orders_) {
    order.places.resize(kPiece);
    order.weight.resize(kPiece);
    order.column.resize(kPiece);
  }
}

/// Lets the eyes of a rank look at places.
void PanoramaPainter::look(int rank, const PanoramaPlaces& places) {
  looking_.clear();
  for (std::size_t e = 0; e < scene_.eyes.size(); ++e)
    if (scene_.eyes[e].rank == rank && looks_[e].look(scene_.eyes[e], places))
      looking_.push_back(static_cast<std::uint32_t>(e));
}

/// Finds the eyes of a rank that may take part in the colour of a place, and adds them to `seers`. Returns whether one
/// sees it well inside its image: then eyes of later ranks are not asked.
bool PanoramaPainter::choose(std::size_t at, Seers& seers) const {
  float full = -2;  // cosine of the best lens that sees the place well inside its image
  for (const std::uint32_t e : looking_)
    if (looks_[e].ramp[at] >= 1) full = std::max(full, looks_[e].sights.cosine[at]);
  const bool blends = config_.blend == PanoramaBlend::Bands;
  for (const std::uint32_t e : looking_) {
    const PanoramaLook& look = looks_[e];
    if (!(look.ramp[at] > 0) || look.sights.cosine[at] < full - kWide) continue;
    const Seer seer{e, look.sights.x[at], look.sights.y[at], look.sights.cosine[at], look.ramp[at]};
    if (!blends && seers.count > 0) {
      if (seer.cosine > seers.each[0].cosine) seers.each[0] = seer;
    } else if (seers.count < kMostSeers) {
      seers.each[seers.count++] = seer;
    }
  }
  return blends ? full > -2 : seers.count > 0;
}

void PanoramaPainter::order(std::uint32_t column, const Seer& seer, float weight) {
  Order& order = orders_[seer.eye];
  const PlaceInImage place = place_in_image(scene_.eyes[seer.eye].lens, seer.x, seer.y);
  order.places.x[order.count] = place.x;
  order.places.y[order.count] = place.y;
  order.places.fx[order.count] = place.fx;
  order.places.fy[order.count] = place.fy;
  order.weight[order.count] = weight;
  order.column[order.count++] = column;
}

/// Divides a column's sample among the eyes that see it.
void PanoramaPainter::give(std::uint32_t column, const Seers& seers) {
  if (seers.count == 0) return;
  const std::uint32_t pixel = scene_.pixel_of_column[column];
  ++found_[pixel][0];
  found_[pixel][1] += scene_.eyes[seers.each[0].eye].rank == 0;
  if (seers.count == 1) return order(column, seers.each[0], 1);
  const std::span seen(seers.each.data(), seers.count);
  std::array<float, kMostSeers> narrow, wide;
  float narrow_left = 1, wide_left = 1, narrow_sum = 0, wide_sum = 0;
  for (std::size_t from = 0, to = 0; from < seen.size(); from = to) {
    while (to < seen.size() && scene_.eyes[seen[to].eye].rank == scene_.eyes[seen[from].eye].rank) ++to;
    const float of_narrow = divide(seen.subspan(from, to - from), kNarrow, &narrow[from]),
                of_wide = divide(seen.subspan(from, to - from), kWide, &wide[from]);
    for (std::size_t i = from; i < to; ++i) narrow[i] *= narrow_left, wide[i] *= wide_left;
    narrow_sum += narrow_left * of_narrow, wide_sum += wide_left * of_wide;
    narrow_left *= 1 - of_narrow, wide_left *= 1 - of_wide;
  }
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const float detail = narrow[i] / narrow_sum, coarse = wide[i] / wide_sum - detail;
    if (detail > 0) order(column, seen[i], detail);
    if (std::abs(coarse) <= 1e-4f) continue;
    const PanoramaEye& eye = scene_.eyes[seen[i].eye];
    const Rgb c = eye.low->at(seen[i].x, seen[i].y);
    Rgb& sum = sums_[pixel];
    sum.red += coarse * eye.gain[0] * c.red;
    sum.green += coarse * eye.gain[1] * c.green;
    sum.blue += coarse * eye.gain[2] * c.blue;
  }
}

void PanoramaPainter::sample_orders() {
  for (std::size_t e = 0; e < orders_.size(); ++e) {
    Order& order = orders_[e];
    if (order.count == 0) continue;
    const PanoramaEye& eye = scene_.eyes[e];
    order.places.resize(order.count);
    samples_of_eye_.resize(order.count);
    sample_each(eye.image, order.places, samples_of_eye_.data());
    for (std::size_t i = 0; i < order.count; ++i) {
      const Rgb& c = samples_of_eye_[i];
      Rgb& sum = sums_[scene_.pixel_of_column[order.column[i]]];
      sum.red += order.weight[i] * eye.gain[0] * c.red;
      sum.green += order.weight[i] * eye.gain[1] * c.green;
      sum.blue += order.weight[i] * eye.gain[2] * c.blue;
    }
    order.places.resize(kPiece);
    order.count = 0;
  }
}

/// Adds the samples of one row of the columns from `first` on.
void PanoramaPainter::add_piece(std::size_t first, std::size_t count, const PanoramaLine& row) {
  places_.find(scene_, scene_.columns, first, count, row);
  look(0, places_);
  left_.clear();
  seers_.clear();
  for (std::size_t i = 0; i < count; ++i) {
    Seers seers;
    const bool in_hole = -places_.rise[i] >= hole_cosine_;
    // The hole lies below the head. Above it, what no lens sees is mostly sky, of which other places know nothing.
    if ((!in_hole && choose(i, seers)) || places_.rise[i] >= 0 || scene_.ranks == 1) {
      give(static_cast<std::uint32_t>(first + i), seers);
    } else {
      left_.push_back(static_cast<std::uint32_t>(i));
      seers_.push_back(seers);
    }
  }
  for (int rank = 1; rank < scene_.ranks && !left_.empty(); ++rank) {
    left_places_.take(places_, left_);
    look(rank, left_places_);
    std::size_t kept = 0;
    for (std::size_t i = 0; i < left_.size(); ++i) {
      if (choose(i, seers_[i]) || rank + 1 == scene_.ranks) {
        give(static_cast<std::uint32_t>(first + left_[i]), seers_[i]);
      } else {
        left_[kept] = left_[i];
        seers_[kept++] = seers_[i];
      }
    }
    left_.resize(kept);
    seers_.resize(kept);
  }
  sample_orders();
}

void PanoramaPainter::paint(std::uint32_t from, std::uint32_t to, RgbRaster& out, std::uint64_t& seen,
                            std::uint64_t& filled) {
  for (std::uint32_t v = from; v < to; ++v) {
    std::fill(sums_.begin(), sums_.end(), Rgb{});
    std::fill(found_.begin(), found_.end(), std::array<int, 2>{});
    for (int j = 0; j < scene_.samples; ++j) {
      const PanoramaLine row = scene_.row(v + (j + 0.5) / scene_.samples - 0.5);
      for (std::size_t first = 0; first < scene_.columns.size(); first += kPiece)
        add_piece(first, std::min(kPiece, scene_.columns.size() - first), row);
    }
    std::uint8_t* pixel = &out.pixels[3 * std::size_t{v} * out.width];
    for (std::uint32_t u = 0; u < out.width; ++u, pixel += 3) {
      if (found_[u][0] == 0) {
        std::copy(config_.fill.begin(), config_.fill.end(), pixel);
        continue;
      }
      ++(found_[u][1] > 0 ? seen : filled);
      const float scale = 1.0f / static_cast<float>(found_[u][0]);
      const std::array<float, 3> mean{sums_[u].red * scale, sums_[u].green * scale, sums_[u].blue * scale};
      for (std::size_t c = 0; c < 3; ++c)
        pixel[c] = static_cast<std::uint8_t>(std::clamp(mean[c] + 0.5f, 0.0f, 255.0f));
    }
  }
}

}  // namespace hueline::fusion
