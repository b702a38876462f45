// This file is compiled once for each instruction set that the compiler supports. The program selects the best set of
// the processor at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "fusion/sights.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <array>

#include "core/coloured_point.hpp"
#include "fusion/head_projector.hpp"

HWY_BEFORE_NAMESPACE();
namespace hueline::fusion::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D = hn::CappedTag<float, 16>;
using V = hn::Vec<D>;

/// Returns the product of three numbers in a row of a matrix with a vector.
V row(const std::array<float, 9>& R, std::size_t k, V a, V b, V c) {
  const D d;
  return hn::Add(hn::Add(hn::Mul(hn::Set(d, R[k]), a), hn::Mul(hn::Set(d, R[k + 1]), b)),
                 hn::Mul(hn::Set(d, R[k + 2]), c));
}

V norm(V a, V b, V c) { return hn::Sqrt(hn::Add(hn::Add(hn::Mul(a, a), hn::Mul(b, b)), hn::Mul(c, c))); }

/// Finds the places in a lens's own frame, and their distances. Vectors whose length only the processor knows cannot be
/// members, so the results are apart.
void in_lens(const FloatLens& lens, V x, V y, V z, V& lx, V& ly, V& lz, V& distance) {
  const D d;
  const auto along = [&](std::size_t i) {
    return hn::Add(row(lens.R_lens_head, 3 * i, x, y, z), hn::Set(d, lens.t_lens_head[i]));
  };
  lx = along(0);
  ly = along(1);
  lz = along(2);
  distance = norm(lx, ly, lz);
}

/// Whether places of a lens's frame lie within its field of view; its image may be smaller.
hn::Mask<D> is_before(const FloatLens& lens, V lz, V distance) {
  const D d;
  return hn::And(hn::Ge(lz, hn::Mul(hn::Set(d, lens.cosine_limit), distance)), hn::Gt(distance, hn::Zero(d)));
}

/// FloatLens::project() for one vector of places of the lens's frame within the field of view. The operations are the
/// same, in the same order, so the results have the same bits.
void project_vector(const FloatLens& lens, V lx, V ly, V lz, V distance, V& sight_x, V& sight_y, V& border) {
  const D d;
  const auto set = [d](float value) { return hn::Set(d, value); };
  const auto times = [&](float factor, V v) { return hn::Mul(set(factor), v); };
  const V one = set(1.0f);
  V across, down;
  if (lens.is_plane) {
    const V inverse = hn::Div(one, lz), ax = hn::Mul(lx, inverse), ay = hn::Mul(ly, inverse),
            r2 = hn::Add(hn::Mul(ax, ax), hn::Mul(ay, ay));
    const auto& [k1, k2, p1, p2, k3] = lens.distortion;
    const V inner = hn::Add(set(k2), hn::Mul(r2, set(k3)));
    const V radial = hn::Add(one, hn::Mul(r2, hn::Add(set(k1), hn::Mul(r2, inner))));
    const V cross = hn::Mul(times(2.0f, ax), ay);
    across =
        hn::Add(hn::Add(hn::Mul(ax, radial), times(p1, cross)), times(p2, hn::Add(r2, hn::Mul(times(2.0f, ax), ax))));
    down =
        hn::Add(hn::Add(hn::Mul(ay, radial), times(p2, cross)), times(p1, hn::Add(r2, hn::Mul(times(2.0f, ay), ay))));
  } else {
    const V inverse = hn::Div(one, distance);
    const V u = hn::Add(hn::Mul(hn::Mul(lz, inverse), set(lens.series_scale)), set(lens.series_shift));
    V ratio = hn::Zero(d);
    for (std::size_t i = lens.series.size(); i-- > 0;) ratio = hn::Add(hn::Mul(ratio, u), set(lens.series[i]));
    across = hn::Mul(hn::Mul(lx, inverse), ratio);
    down = hn::Mul(hn::Mul(ly, inverse), ratio);
  }
  sight_x = hn::Add(hn::Mul(across, set(lens.focal_x)), set(lens.centre_x));
  sight_y = hn::Add(hn::Mul(down, set(lens.focal_y)), set(lens.centre_y));
  border = hn::Min(hn::Min(sight_x, hn::Sub(set(lens.last_x), sight_x)),
                   hn::Min(sight_y, hn::Sub(set(lens.last_y), sight_y)));
}

/// HeadProjector::see() for one vector of places, with the lens whose axis is nearest. The results have the same bits.
struct VectorOfSights {
  std::array<float, 16> x, y, border_px;
  std::array<std::int32_t, 16> lens;  ///< -1: the lens does not show the place
};

void see_vector(const std::vector<FloatLens>& lenses, std::uint32_t blind, std::uint32_t usable, float hole_cosine,
                const RelativeHead& head, const HeadMotion& motion, const float* px, const float* py, const float* pz,
                VectorOfSights& out) {
  const D d;
  const hn::RebindToSigned<D> whole;
  const auto set = [d](float value) { return hn::Set(d, value); };
  const auto times = [&](float factor, V v) { return hn::Mul(set(factor), v); };
  const V dx = hn::Add(hn::LoadU(d, px), set(head.origin[0])), dy = hn::Add(hn::LoadU(d, py), set(head.origin[1])),
          dz = hn::Add(hn::LoadU(d, pz), set(head.origin[2]));
  const V x = row(head.R_head_enu, 0, dx, dy, dz), y = row(head.R_head_enu, 3, dx, dy, dz),
          z = row(head.R_head_enu, 6, dx, dy, dz);
  const auto is_in_hole = hn::Ge(hn::Sub(hn::Zero(d), z), times(hole_cosine, norm(x, y, z)));
  V best = set(-1e30f), index = set(-1.0f);
  for (const FloatLens& lens : lenses) {
    if ((blind >> lens.index & 1u) != 0) continue;
    const V along = hn::Add(hn::Add(times(lens.axis[0], x), times(lens.axis[1], y)), times(lens.axis[2], z));
    const auto is_better = hn::Gt(along, best);
    best = hn::IfThenElse(is_better, along, best);
    index = hn::IfThenElse(is_better, set(static_cast<float>(lens.index)), index);
  }
  index = hn::IfThenElse(is_in_hole, set(-1.0f), index);
  V sight_x = hn::Zero(d), sight_y = hn::Zero(d), border = hn::Zero(d), found = set(-1.0f);
  for (const FloatLens& lens : lenses) {
    if ((usable >> lens.index & 1u) == 0) continue;
    const V number = set(static_cast<float>(lens.index));
    const auto is_of_lens = hn::Eq(index, number);
    if (hn::AllFalse(d, is_of_lens)) continue;
    V sx = hn::Zero(d), sy = hn::Zero(d), edge = hn::Zero(d);
    auto is_seen = is_of_lens;
    V mx = x, my = y, mz = z;
    const float late = motion.lateness[lens.index];
    for (int step = 0, last = lens.steps_in_time(late); step <= last; ++step) {
      if (step > 0) {
        const V dt = hn::Add(set(late), hn::Mul(set(lens.row_time), hn::Sub(sy, set(lens.middle_row))));
        const auto after = [&](V from, V a, std::size_t i, V b, std::size_t k, std::size_t along) {
          const V turned = hn::Sub(times(motion.rate[i], a), times(motion.rate[k], b));
          return hn::Add(from, hn::Mul(dt, hn::Sub(turned, set(motion.velocity[along]))));
        };
        mx = after(x, z, 1, y, 2, 0);
        my = after(y, x, 2, z, 0, 1);
        mz = after(z, y, 0, x, 1, 2);
      }
      V lx, ly, lz, distance;
      in_lens(lens, mx, my, mz, lx, ly, lz, distance);
      project_vector(lens, lx, ly, lz, distance, sx, sy, edge);
      is_seen = hn::And(is_seen, hn::And(is_before(lens, lz, distance), hn::Gt(edge, set(kLeastBorder_px))));
    }
    sight_x = hn::IfThenElse(is_seen, sx, sight_x);
    sight_y = hn::IfThenElse(is_seen, sy, sight_y);
    border = hn::IfThenElse(is_seen, edge, border);
    found = hn::IfThenElse(is_seen, number, found);
  }
  hn::StoreU(sight_x, d, out.x.data());
  hn::StoreU(sight_y, d, out.y.data());
  hn::StoreU(border, d, out.border_px.data());
  hn::StoreU(hn::ConvertTo(whole, found), whole, out.lens.data());
}

void see_each(const std::vector<FloatLens>& lenses, std::uint32_t blind, std::uint32_t usable, float hole_cosine,
              const RelativeHead& head, const HeadMotion& motion, const RelativePlaces& places, Sights& out) {
  const D d;
  const std::size_t lanes = hn::Lanes(d), count = places.size();
  std::array<float, 16> x{}, y{}, z{};
  VectorOfSights found;
  for (std::size_t i = 0; i < count; i += lanes) {
    const std::size_t left = std::min(lanes, count - i);
    const float *px = places.x.data() + i, *py = places.y.data() + i, *pz = places.z.data() + i;
    if (left < lanes) {
      std::copy_n(px, left, x.begin());
      std::copy_n(py, left, y.begin());
      std::copy_n(pz, left, z.begin());
      px = x.data();
      py = y.data();
      pz = z.data();
    }
    see_vector(lenses, blind, usable, hole_cosine, head, motion, px, py, pz, found);
    for (std::size_t k = 0; k < left; ++k) {
      out.x[i + k] = found.x[k];
      out.y[i + k] = found.y[k];
      out.border_px[i + k] = found.border_px[k];
      out.lens[i + k] = found.lens[k] < 0 ? kNoLens : static_cast<std::uint8_t>(found.lens[k]);
    }
  }
}

bool project_each(const FloatLens& lens, std::size_t count, const float* x, const float* y, const float* z,
                  LensSights& out) {
  const D d;
  const std::size_t lanes = hn::Lanes(d);
  bool any = false;
  const auto project = [&](const float* px, const float* py, const float* pz, float* sight_x, float* sight_y,
                           float* border_px, float* cosine) {
    V lx, ly, lz, distance;
    in_lens(lens, hn::LoadU(d, px), hn::LoadU(d, py), hn::LoadU(d, pz), lx, ly, lz, distance);
    const auto is_seen = is_before(lens, lz, distance);
    if (hn::AllFalse(d, is_seen)) {
      hn::StoreU(hn::Set(d, -1.0f), d, border_px);
      return;
    }
    any = true;
    V sx, sy, border;
    project_vector(lens, lx, ly, lz, distance, sx, sy, border);
    hn::StoreU(sx, d, sight_x);
    hn::StoreU(sy, d, sight_y);
    hn::StoreU(hn::IfThenElse(is_seen, border, hn::Set(d, -1.0f)), d, border_px);
    hn::StoreU(hn::Div(lz, distance), d, cosine);
  };
  std::size_t i = 0;
  for (; i + lanes <= count; i += lanes)
    project(x + i, y + i, z + i, &out.x[i], &out.y[i], &out.border_px[i], &out.cosine[i]);
  if (i == count) return any;
  std::array<float, 16> px{}, py{}, pz{}, sx{}, sy{}, border{}, cosine{};
  std::copy_n(x + i, count - i, px.begin());
  std::copy_n(y + i, count - i, py.begin());
  std::copy_n(z + i, count - i, pz.begin());
  project(px.data(), py.data(), pz.data(), sx.data(), sy.data(), border.data(), cosine.data());
  std::copy_n(sx.begin(), count - i, &out.x[i]);
  std::copy_n(sy.begin(), count - i, &out.y[i]);
  std::copy_n(border.begin(), count - i, &out.border_px[i]);
  std::copy_n(cosine.begin(), count - i, &out.cosine[i]);
  return any;
}

}  // namespace hueline::fusion::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hueline::fusion {
HWY_EXPORT(see_each);
HWY_EXPORT(project_each);

bool FloatLens::project_each(std::span<const float> places_x, std::span<const float> places_y,
                             std::span<const float> places_z, LensSights& out) const {
  out.resize(places_x.size());
  return HWY_DYNAMIC_DISPATCH(project_each)(*this, places_x.size(), places_x.data(), places_y.data(), places_z.data(),
                                            out);
}

void HeadProjector::see_each(const RelativeHead& head, const HeadMotion& motion, const RelativePlaces& places,
                             const std::uint8_t* has_image, std::uint32_t blind, Sights& out) const {
  out.x.resize(places.size());
  out.y.resize(places.size());
  out.border_px.resize(places.size());
  out.lens.assign(places.size(), kNoLens);
  if (method_ != ColourMethod::Lens) return;
  std::uint32_t usable = 0;
  for (const FloatLens& lens : lenses_)
    if (has_image[lens.camera] != 0 && (blind >> lens.index & 1u) == 0) usable |= 1u << lens.index;
  HWY_DYNAMIC_DISPATCH(see_each)(lenses_, blind, usable, hole_cosine_, head, motion, places, out);
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (out.lens[i] == kNoLens) continue;
    const PixelMask& mask = lenses_[out.lens[i]].mask;
    if (mask.covers(static_cast<std::uint32_t>(out.x[i] + 0.5f), static_cast<std::uint32_t>(out.y[i] + 0.5f)))
      out.lens[i] = kNoLens;
  }
}

}  // namespace hueline::fusion
#endif
