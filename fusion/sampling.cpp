// This file is compiled once for each instruction set that the compiler supports. The program selects the best set of
// the processor at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "fusion/sampling.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <limits>

#include "fusion/pixel_sampler.hpp"

#ifndef HUELINE_FUSION_SAMPLING_ONCE
#define HUELINE_FUSION_SAMPLING_ONCE
namespace hueline::fusion {
/// A mosaic whose red pixels have the parity (red_x, red_y).
struct Mosaic {
  const std::uint8_t* data;
  std::int32_t stride, red_x, red_y;
};
}  // namespace hueline::fusion
#endif

HWY_BEFORE_NAMESPACE();
namespace hueline::fusion::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D = hn::CappedTag<float, 16>;
using V = hn::Vec<D>;
using W = hn::RebindToSigned<D>;
using I = hn::Vec<W>;

I times(int factor, I v) { return hn::Mul(hn::Set(W(), factor), v); }

I reversed_bytes(I word) {
  const W d;
  const I middle = hn::Or(hn::And(hn::ShiftLeft<8>(word), hn::Set(d, 0xFF0000)),
                          hn::And(hn::ShiftRight<8>(word), hn::Set(d, 0xFF00)));
  return hn::Or(hn::Or(hn::ShiftLeft<24>(word), middle), hn::And(hn::ShiftRight<24>(word), hn::Set(d, 0xFF)));
}

/// The 6 x 6 pixels around as many places as a vector has lanes, so turned that the red one of the middle four is in
/// column 0 and row 0. The filters are those of detail::Surroundings.
class Neighbourhoods {
 public:
  Neighbourhoods(const Mosaic& image, I x, I y, I right, I below) {
    const W d;
    const I two = hn::Set(d, 2), stride = hn::Set(d, image.stride);
    const auto is_mirrored = hn::Gt(right, hn::Zero(d));
    const I down = hn::Sub(stride, hn::Mul(times(2, below), stride));  // to the next row
    I offset = hn::Add(hn::Mul(hn::Add(y, below), stride), hn::Sub(x, two));
    offset = hn::Sub(offset, times(2, down));
    const auto* base = reinterpret_cast<const std::int32_t*>(image.data);
    for (auto& row : words_) {
      const I left = hn::GatherOffset(d, base, offset), other = hn::GatherOffset(d, base, hn::Add(offset, two));
      hn::Store(hn::IfThenElse(is_mirrored, reversed_bytes(other), left), d, row[0].data());
      hn::Store(hn::IfThenElse(is_mirrored, reversed_bytes(left), other), d, row[1].data());
      offset = hn::Add(offset, down);
    }
  }
  I own(int column, int row) const {
    const W d;
    const bool is_left = column < 2;
    const auto& words = words_[static_cast<std::size_t>(row + 2)][is_left ? 0 : 1];
    return hn::And(hn::ShiftRightSame(hn::Load(d, words.data()), 8 * (is_left ? column + 2 : column)), hn::Set(d, 255));
  }
  I sixteenfold(int x, int y) const { return hn::ShiftLeft<4>(own(x, y)); }
  I green(int x, int y) const {
    const I near = hn::Add(beside(x, y, 1), above(x, y, 1)), far = hn::Add(beside(x, y, 2), above(x, y, 2));
    return hn::Sub(hn::Add(hn::ShiftLeft<3>(own(x, y)), hn::ShiftLeft<2>(near)), hn::ShiftLeft<1>(far));
  }
  I opposite(int x, int y) const {
    const I far = hn::Add(beside(x, y, 2), above(x, y, 2));
    return hn::Sub(hn::Add(times(12, own(x, y)), hn::ShiftLeft<2>(corners(x, y))), times(3, far));
  }
  I of_row(int x, int y) const { return along(x, y, beside(x, y, 1), beside(x, y, 2), above(x, y, 2)); }
  I of_column(int x, int y) const { return along(x, y, above(x, y, 1), above(x, y, 2), beside(x, y, 2)); }

 private:
  I beside(int x, int y, int far) const { return hn::Add(own(x - far, y), own(x + far, y)); }
  I above(int x, int y, int far) const { return hn::Add(own(x, y - far), own(x, y + far)); }
  I corners(int x, int y) const { return hn::Add(beside(x, y - 1, 1), beside(x, y + 1, 1)); }
  I along(int x, int y, I next, I second, I across) const {
    const I near = hn::Add(times(10, own(x, y)), hn::ShiftLeft<3>(next));
    return hn::Add(hn::Sub(near, hn::ShiftLeft<1>(hn::Add(corners(x, y), second))), across);
  }
  /// For each row the columns -2 to 1 and 0 to 3, a byte each. Vectors whose length only the processor knows cannot be
  /// members.
  alignas(64) std::array<std::array<std::array<std::int32_t, 16>, 2>, 6> words_;
};

/// detail::sample_mosaic() for one vector of places. The filters are symmetric, so a place whose red pixel is on the
/// right or below is seen in a mirror. The operations on what the filters give are the same, in the same order, so the
/// results have the same bits.
void sample_vector(const Mosaic& image, const std::int32_t* px, const std::int32_t* py, const float* pfx,
                   const float* pfy, Rgb* out) {
  const D d;
  const W whole;
  const I x = hn::LoadU(whole, px), y = hn::LoadU(whole, py), one = hn::Set(whole, 1);
  const I right = hn::And(hn::Xor(x, hn::Set(whole, image.red_x)), one),
          below = hn::And(hn::Xor(y, hn::Set(whole, image.red_y)), one);
  const Neighbourhoods p(image, x, y, right, below);
  const V fx = hn::LoadU(d, pfx), fy = hn::LoadU(d, pfy), unit = hn::Set(d, 1.0f);
  const auto is = [&](I flag) { return hn::RebindMask(d, hn::Eq(flag, one)); };
  const V column = hn::IfThenElse(is(right), fx, hn::Sub(unit, fx)),
          line = hn::IfThenElse(is(below), fy, hn::Sub(unit, fy));
  const V of_red = hn::Mul(column, line), of_beside = hn::Mul(hn::Sub(unit, column), line),
          of_above = hn::Mul(column, hn::Sub(unit, line)),
          of_blue = hn::Mul(hn::Sub(unit, column), hn::Sub(unit, line));
  const auto mix = [&](I at_red, I at_beside, I at_above, I at_blue) {
    const auto value = [&](I times_16) {
      return hn::ConvertTo(d, hn::Min(hn::Max(times_16, hn::Zero(whole)), hn::Set(whole, 16 * 255)));
    };
    const V sum = hn::Add(hn::Add(hn::Mul(of_red, value(at_red)), hn::Mul(of_beside, value(at_beside))),
                          hn::Mul(of_above, value(at_above)));
    return hn::Mul(hn::Add(sum, hn::Mul(of_blue, value(at_blue))), hn::Set(d, 1 / 16.0f));
  };
  static_assert(sizeof(Rgb) == 3 * sizeof(float));
  hn::StoreInterleaved3(mix(p.sixteenfold(0, 0), p.of_row(1, 0), p.of_column(0, 1), p.opposite(1, 1)),
                        mix(p.green(0, 0), p.sixteenfold(1, 0), p.sixteenfold(0, 1), p.green(1, 1)),
                        mix(p.opposite(0, 0), p.of_column(1, 0), p.of_row(0, 1), p.sixteenfold(1, 1)), d, &out->red);
}

void sample_each(const Mosaic& image, const ImagePlaces& places, Rgb* out) {
  const std::size_t lanes = hn::Lanes(D()), count = places.size();
  std::size_t i = 0;
  for (; i + lanes <= count; i += lanes)
    sample_vector(image, places.x.data() + i, places.y.data() + i, places.fx.data() + i, places.fy.data() + i, out + i);
  if (i == count) return;
  // Lanes beyond the last place sample the last one again.
  std::array<std::int32_t, 16> x, y;
  std::array<float, 16> fx, fy;
  std::array<Rgb, 16> some;
  for (std::size_t k = 0; k < lanes; ++k) {
    const std::size_t from = std::min(i + k, count - 1);
    x[k] = places.x[from];
    y[k] = places.y[from];
    fx[k] = places.fx[from];
    fy[k] = places.fy[from];
  }
  sample_vector(image, x.data(), y.data(), fx.data(), fy.data(), some.data());
  std::copy_n(some.begin(), count - i, out + i);
}

}  // namespace hueline::fusion::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hueline::fusion {
HWY_EXPORT(sample_each);

void sample_each(const RawView& image, const ImagePlaces& places, Rgb* out) {
  const auto parity = red_parity(image.format);
  const bool is_indexable = image.stride * image.height <= std::numeric_limits<std::int32_t>::max();
  if (!parity || !is_indexable) {
    for (std::size_t i = 0; i < places.size(); ++i)
      out[i] = sample(image, places.x[i], places.y[i], places.fx[i], places.fy[i]);
    return;
  }
  const Mosaic mosaic{image.data, static_cast<std::int32_t>(image.stride), parity->x, parity->y};
  HWY_DYNAMIC_DISPATCH(sample_each)(mosaic, places, out);
}

}  // namespace hueline::fusion
#endif
