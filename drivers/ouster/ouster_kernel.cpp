#include "drivers/ouster/ouster_kernel.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>

#include "core/angle.hpp"
#include "core/portable_math.hpp"

namespace hueline::drivers {
namespace {

constexpr double kTwoPi = 2 * std::numbers::pi;

/// Columns of one packet are fired within milliseconds. If their times differ by more, one of them is wrong.
constexpr std::uint64_t kLongestPacketNs = 1'000'000'000;

/// Returns the angle in [0, 2 pi).
double whole_turn(double angle) {
  const double rest = std::fmod(angle, kTwoPi);
  return rest < 0 ? rest + kTwoPi : rest;
}

}  // namespace

OusterKernel::OusterKernel(const OusterMetadata& metadata, double min_range_m, double max_range_m)
    : metadata_(metadata),
      channels_(static_cast<std::size_t>(metadata.channels)),
      nearest_mm_(std::max(1, static_cast<std::int32_t>(std::ceil(min_range_m * 1e3 - 1e-6)))),
      farthest_mm_(static_cast<std::int32_t>(std::floor(std::min(max_range_m, 2000.0) * 1e3 + 1e-6))),
      beam_m_(static_cast<float>(portable::hypot(metadata.beam_x_m, metadata.beam_z_m))),
      scratch_(2 * channels_ * static_cast<std::size_t>(metadata.columns_per_packet) + 1) {
  count_.fill(1);
  // The maker's sensor frame has x forward and y left.
  Eigen::Matrix3d R_scanner_sensor;
  R_scanner_sensor << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  const Eigen::Matrix3d R = R_scanner_sensor * metadata.R_sensor_lidar;
  up_ = R.col(2).cast<float>();
  for (int column = 0; column < metadata.columns_per_frame; ++column) {
    // The encoder counts clockwise seen from above.
    const double encoder = -kTwoPi * column / metadata.columns_per_frame;
    const Eigen::Vector3d along = R * Eigen::Vector3d(portable::cos(encoder), portable::sin(encoder), 0);
    Turn turn;
    turn.along = along.cast<float>();
    turn.left = (R * Eigen::Vector3d(-portable::sin(encoder), portable::cos(encoder), 0)).cast<float>();
    turn.origin = (along * metadata.beam_x_m + R.col(2) * metadata.beam_z_m).cast<float>();
    turn.azimuth = static_cast<float>(whole_turn(portable::atan2(along.x(), along.y())));
    turns_.push_back(turn);
  }
  for (std::size_t c = 0; c < channels_; ++c) {
    const double altitude = metadata.altitudes_deg[c] * kRadPerDeg, azimuth = metadata.azimuths_deg[c] * kRadPerDeg;
    beams_.along[c] = static_cast<float>(portable::cos(altitude) * portable::cos(azimuth));
    beams_.left[c] = static_cast<float>(-portable::cos(altitude) * portable::sin(azimuth));
    beams_.up[c] = static_cast<float>(portable::sin(altitude));
    beams_.azimuth[c] = static_cast<float>(azimuth);
    beams_.ring[c] = static_cast<std::uint32_t>(
        std::ranges::count_if(metadata.altitudes_deg, [&](double other) { return other < metadata.altitudes_deg[c]; }));
  }
}

OusterColumns OusterKernel::decode(std::span<const std::byte> bytes, std::vector<LaserReturn>& returns) {
  OusterColumns result;
  const std::size_t stride = metadata_.column_bytes();
  const auto column_at = [&](int i) {
    return bytes.data() + metadata_.head_bytes() + stride * static_cast<std::size_t>(i);
  };
  // A clock that is set back within a packet is no reason for times before the packet's.
  bool has_time = false;
  result.first_ns = decode_ouster_column(column_at(0), metadata_).time_ns;
  for (int i = 0; i < metadata_.columns_per_packet; ++i) {
    const OusterColumn column = decode_ouster_column(column_at(i), metadata_);
    if (!column.is_valid) continue;
    result.first_ns = has_time ? std::min(result.first_ns, column.time_ns) : column.time_ns;
    has_time = true;
  }
  LaserReturn* out = scratch_.data();
  for (int i = 0; i < metadata_.columns_per_packet; ++i) {
    const std::byte* bytes_of_column = column_at(i);
    const OusterColumn column = decode_ouster_column(bytes_of_column, metadata_);
    if (!column.is_valid) {
      ++result.invalid;
      continue;
    }
    const std::uint64_t since_first = column.time_ns - result.first_ns;
    if (column.number >= metadata_.columns_per_frame || since_first > kLongestPacketNs) {
      ++result.malformed;
      continue;
    }
    const Turn turn = turns_[static_cast<std::size_t>(column.number)];
    const auto time_ns = static_cast<std::int32_t>(since_first);
    read_channels(bytes_of_column + metadata_.column_head_bytes());
    if (metadata_.profile->is_dual) {
      order_returns();
      fill_lanes<false>(turn, time_ns);
      fill_lanes<true>(turn, time_ns);
      out = write_returns(near_lanes_, far_lanes_, channels_, out);
    } else {
      fill_lanes<false>(turn, time_ns);
      out = write_returns(near_lanes_, channels_, out);
    }
  }
  returns.assign(scratch_.data(), out);
  return result;
}

/// Reads the first return of each channel into `near_` and the second into `far_`, as they are sent.
void OusterKernel::read_channels(const std::byte* channels) {
  const OusterProfile profile = *metadata_.profile;
  const std::size_t count = channels_;
  if (profile.pixel_bytes == 4) {
    std::memcpy(first_words_.data(), channels, 4 * count);
  } else {
    for (std::size_t c = 0; c < count; ++c) {
      const std::byte* pixel = channels + profile.pixel_bytes * c;
      std::memcpy(&first_words_[c], pixel, 4);
      std::memcpy(&second_words_[c], pixel + 4, 4);
    }
  }
  const std::uint32_t mask = profile.range_mask;
  const int range_shift = profile.range_shift;
  const std::size_t reflectivity_at = profile.reflectivity_at + (metadata_.has_wide_reflectivity ? 1 : 0);
  const auto reflectivity_shift = static_cast<int>(8 * (reflectivity_at % 4));
  for (std::size_t c = 0; c < count; ++c)
    near_.range_mm[c] = static_cast<std::int32_t>((first_words_[c] & mask) << range_shift);
  if (reflectivity_at < 4)
    for (std::size_t c = 0; c < count; ++c) near_.reflectivity[c] = first_words_[c] >> reflectivity_shift & 0xFFU;
  else
    for (std::size_t c = 0; c < count; ++c) near_.reflectivity[c] = second_words_[c] >> reflectivity_shift & 0xFFU;
  if (!profile.is_dual) return;
  for (std::size_t c = 0; c < count; ++c) {
    far_.range_mm[c] = static_cast<std::int32_t>((second_words_[c] & mask) << range_shift);
    far_.reflectivity[c] = second_words_[c] >> reflectivity_shift & 0xFFU;
  }
}

/// Puts the nearer return of each channel into `near_`. Equal ones are one.
void OusterKernel::order_returns() {
  constexpr std::int32_t kNone = std::numeric_limits<std::int32_t>::max();  // behind every return
  const std::size_t count = channels_;
  for (std::size_t c = 0; c < count; ++c) {
    const std::int32_t first = near_.range_mm[c], second = far_.range_mm[c];
    const std::uint32_t of_first = near_.reflectivity[c], of_second = far_.reflectivity[c];
    // All bits or none, because the compiler makes no vectors of branches.
    const std::int32_t a = first | (-static_cast<std::int32_t>(first == 0) & kNone);
    const std::int32_t b = second | (-static_cast<std::int32_t>(second == 0) & kNone);
    const std::int32_t swaps = -static_cast<std::int32_t>(b < a), is_one = -static_cast<std::int32_t>(a == b);
    const std::int32_t exchanged = (a ^ b) & swaps, near = a ^ exchanged, far = b ^ exchanged;
    const std::int32_t no_far = is_one | -static_cast<std::int32_t>(far == kNone);
    const std::uint32_t reflectivities = (of_first ^ of_second) & static_cast<std::uint32_t>(swaps);
    near_.range_mm[c] = near & ~-static_cast<std::int32_t>(near == kNone);
    near_.reflectivity[c] = of_first ^ reflectivities;
    far_.range_mm[c] = far & ~no_far;
    far_.reflectivity[c] = of_second ^ reflectivities;
    count_[c] = static_cast<std::uint32_t>(2 + no_far);
  }
}

/// Fills the lanes of the nearer or the farther returns. The lanes are chosen here and not given, so that the compiler
/// sees that no two arrays overlap.
template <bool kIsFar>
void OusterKernel::fill_lanes(const Turn& turn, std::int32_t time_ns) {
  const Echoes& echoes = kIsFar ? far_ : near_;
  auto& lanes = kIsFar ? far_lanes_ : near_lanes_;
  const float ax = turn.along.x(), ay = turn.along.y(), az = turn.along.z();
  const float lx = turn.left.x(), ly = turn.left.y(), lz = turn.left.z();
  const float ux = up_.x(), uy = up_.y(), uz = up_.z();
  const float ox = turn.origin.x(), oy = turn.origin.y(), oz = turn.origin.z();
  const float beam_m = beam_m_, azimuth = turn.azimuth;
  const std::int32_t nearest = nearest_mm_, farthest = farthest_mm_;
  const std::size_t count = channels_;
  for (std::size_t c = 0; c < count; ++c) {
    const float range = static_cast<float>(echoes.range_mm[c]) * 1e-3f;
    const float beam = range - beam_m;
    const float along = beam * beams_.along[c], left = beam * beams_.left[c], up = beam * beams_.up[c];
    lanes.x[c] = along * ax + left * lx + up * ux + ox;
    lanes.y[c] = along * ay + left * ly + up * uy + oy;
    lanes.z[c] = along * az + left * lz + up * uz + oz;
    lanes.range[c] = range;
    lanes.azimuth[c] = in_circle(azimuth + beams_.azimuth[c]);
    lanes.time_ns[c] = time_ns;
    lanes.tags[c] = tags_of(beams_.ring[c], echoes.reflectivity[c], kIsFar ? 2 : 1);
    lanes.return_count[c] = count_[c];
    // Both differences are negative if the range is kept; the sign is the topmost bit.
    const std::int32_t before = nearest - 1 - echoes.range_mm[c], behind = echoes.range_mm[c] - farthest - 1;
    lanes.keep[c] = static_cast<std::uint32_t>(before & behind) >> 31U;
  }
}

}  // namespace hueline::drivers
