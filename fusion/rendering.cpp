// This file is compiled once for each instruction set that the compiler supports. The program selects the best set of
// the processor at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "fusion/rendering.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <array>

#include "fusion/radiometry.hpp"

HWY_BEFORE_NAMESPACE();
namespace hueline::fusion::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D = hn::CappedTag<float, 16>;
using V = hn::Vec<D>;

/// Radiometry::render() for as many pixels as a vector has lanes. The operations are the same, in the same order, so
/// the results have the same bits. Writes the index of each colour in the table of codes.
void render_vector(const RenderTables& tables, const HeadGains* gains, const Rgb* pixels, const std::int32_t* lens,
                   const float* off_axis, float adaptation, std::array<std::array<std::int32_t, 16>, 3>& out) {
  const D d;
  const hn::RebindToSigned<D> whole;
  const auto set = [d](float value) { return hn::Set(d, value); };
  const V zero = hn::Zero(d), one = set(1.0f);
  // Vectors whose length only the processor knows cannot be elements of arrays.
  V red, green, blue;
  hn::LoadInterleaved3(d, &pixels->red, red, green, blue);
  const auto linear = [&](V value) {
    const V x = hn::Min(hn::Max(value, zero), set(255.0f));
    const auto index = hn::ConvertTo(whole, x);
    const V low = hn::GatherIndex(d, tables.linear, index),
            high = hn::GatherIndex(d, tables.linear, hn::Add(index, hn::Set(whole, 1)));
    return hn::Add(low, hn::Mul(hn::Sub(x, hn::ConvertTo(d, index)), hn::Sub(high, low)));
  };
  red = linear(red);
  green = linear(green);
  blue = linear(blue);
  if (gains != nullptr) {
    const V q = hn::LoadU(d, off_axis);
    const auto first = hn::Mul(hn::LoadU(whole, lens), hn::Set(whole, 3));
    const auto at_reference = [&](V light, std::size_t c) {
      const auto& [a, b] = gains->falloff[c];
      const V u = hn::Mul(q, hn::Add(set(a), hn::Mul(q, set(b))));
      V passed = hn::Add(set(1 / 6.0f), hn::Mul(u, set(1 / 24.0f)));
      passed = hn::Add(set(0.5f), hn::Mul(u, passed));
      passed = hn::Add(one, hn::Mul(u, hn::Add(one, hn::Mul(u, passed))));
      const V scale =
          hn::GatherIndex(d, gains->lenses[0].scale.data(), hn::Add(first, hn::Set(whole, static_cast<int>(c))));
      return hn::Mul(light, hn::Mul(scale, passed));
    };
    red = at_reference(red, 0);
    green = at_reference(green, 1);
    blue = at_reference(blue, 2);
  }
  if (tables.is_evened) {
    const V given = set(adaptation), shoulder = set(RenderTables::kShoulder), rest = set(1 - RenderTables::kShoulder);
    const V brightest = hn::Mul(given, hn::Max(hn::Max(red, green), blue));
    const V over = hn::Div(hn::Sub(brightest, shoulder), rest);
    const V softened = hn::Div(hn::Add(shoulder, hn::Div(hn::Mul(rest, over), hn::Add(one, over))), brightest);
    const V factor = hn::IfThenElse(hn::Gt(brightest, shoulder), hn::Mul(given, softened), given);
    red = hn::Mul(red, factor);
    green = hn::Mul(green, factor);
    blue = hn::Mul(blue, factor);
  }
  const auto store = [&](V light, std::array<std::int32_t, 16>& index) {
    const V x = hn::Add(hn::Mul(hn::Min(hn::Max(light, zero), one), set(RenderTables::kLargest)), set(0.5f));
    hn::StoreU(hn::ConvertTo(whole, x), whole, index.data());
  };
  store(red, out[0]);
  store(green, out[1]);
  store(blue, out[2]);
}

void render_each(const RenderTables& tables, const HeadGains* gains, std::span<const Rgb> pixels,
                 const std::uint8_t* lens, const float* off_axis, float adaptation,
                 std::array<std::uint8_t, 3>* colours) {
  const D d;
  const std::size_t lanes = hn::Lanes(d), count = pixels.size();
  std::array<Rgb, 16> some;
  std::array<float, 16> q{};
  std::array<std::int32_t, 16> of_lens{};
  std::array<std::array<std::int32_t, 16>, 3> index;
  for (std::size_t i = 0; i < count; i += lanes) {
    const std::size_t left = std::min(lanes, count - i);
    for (std::size_t k = 0; k < left; ++k) of_lens[k] = lens[i + k];
    const bool is_whole = left == lanes;
    if (!is_whole) {
      std::copy_n(pixels.data() + i, left, some.begin());
      std::copy_n(off_axis + i, left, q.begin());
    }
    render_vector(tables, gains, is_whole ? pixels.data() + i : some.data(), of_lens.data(),
                  is_whole ? off_axis + i : q.data(), adaptation, index);
    for (std::size_t k = 0; k < left; ++k)
      for (std::size_t c = 0; c < 3; ++c) colours[i + k][c] = tables.coded[static_cast<std::size_t>(index[c][k])];
  }
}

}  // namespace hueline::fusion::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hueline::fusion {
HWY_EXPORT(render_each);

void Radiometry::render_each(std::span<const Rgb> pixels, const HeadGains* gains, const std::uint8_t* lens,
                             const float* off_axis, float adaptation, std::array<std::uint8_t, 3>* colours) const {
  if (config_.rendering == Rendering::AsDelivered) {
    for (std::size_t i = 0; i < pixels.size(); ++i)
      colours[i] = render(pixels[i], gains, lens[i], off_axis[i], adaptation);
    return;
  }
  const RenderTables tables{linear_.data(), coded_.data(), config_.rendering == Rendering::Evened};
  HWY_DYNAMIC_DISPATCH(render_each)(tables, gains, pixels, lens, off_axis, adaptation, colours);
}

}  // namespace hueline::fusion
#endif
