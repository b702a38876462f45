#include "drivers/hesai/hesai_kernel.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>

#include "core/angle.hpp"
#include "core/portable_math.hpp"

namespace hueline::drivers {
namespace {

constexpr int kCircle = 36000;  // in 0.01 degrees
constexpr float kRadPerCount = static_cast<float>(2 * std::numbers::pi / kCircle);

unsigned u16(const std::byte* p) { return static_cast<unsigned>(p[0]) | static_cast<unsigned>(p[1]) << 8U; }

}  // namespace

HesaiKernel::HesaiKernel(const HesaiDecoder::Config& config)
    : table_(hesai_table(config.model)),
      min_range_m_(config.min_range_m),
      max_range_m_(config.max_range_m.value_or(1e9)),
      sin_(kCircle),
      cos_(kCircle),
      scratch_(table_.beams.size() * static_cast<std::size_t>(table_.blocks) + 1) {
  for (int i = 0; i < kCircle; ++i) {
    sin_[static_cast<std::size_t>(i)] = static_cast<float>(portable::sin(2 * std::numbers::pi * i / kCircle));
    cos_[static_cast<std::size_t>(i)] = static_cast<float>(portable::cos(2 * std::numbers::pi * i / kCircle));
  }
  const auto beam = [&](std::size_t c) {
    if (config.elevations_deg.empty()) return table_.beams[c];
    return HesaiBeam{config.elevations_deg[c], config.azimuths_deg[c]};
  };
  for (std::size_t c = 0; c < table_.beams.size(); ++c) {
    const double elevation = beam(c).elevation_deg * kRadPerDeg, azimuth = beam(c).azimuth_deg * kRadPerDeg;
    std::uint32_t ring = 0;
    for (std::size_t other = 0; other < table_.beams.size(); ++other)
      ring += beam(other).elevation_deg < beam(c).elevation_deg ? 1 : 0;
    channels_.sin_elevation[c] = static_cast<float>(portable::sin(elevation));
    channels_.cos_elevation[c] = static_cast<float>(portable::cos(elevation));
    channels_.sin_azimuth[c] = static_cast<float>(portable::sin(azimuth));
    channels_.cos_azimuth[c] = static_cast<float>(portable::cos(azimuth));
    channels_.azimuth[c] = static_cast<float>(azimuth);
    channels_.time_ns[c] = table_.times[c];
    channels_.time_of_second_ns[c] = table_.times_of_second.empty() ? table_.times[c] : table_.times_of_second[c];
    channels_.ring[c] = ring;
  }
}

/// Returns the time of a block after the packet's time. The blocks of the same firings have the same.
std::int32_t HesaiKernel::block_ns(int block, int returns) const {
  if (table_.first_block != 0) return table_.first_block + table_.block_period * (block / returns);
  return table_.last_block - table_.block_period * ((table_.blocks - block - 1) / returns);
}

HesaiBlocks HesaiKernel::decode(std::span<const std::byte> bytes, const HesaiPacket& packet,
                                std::vector<LaserReturn>& returns) {
  range_step_ = static_cast<float>(packet.range_step_m);
  // A distance of 0 means "no return", whatever the configuration says.
  nearest_ = std::max(1, static_cast<std::int32_t>(std::ceil(min_range_m_ / packet.range_step_m - 1e-6)));
  span_ =
      static_cast<std::int32_t>(std::min(65535.0, std::floor(max_range_m_ / packet.range_step_m + 1e-6))) - nearest_;

  HesaiBlocks result;
  const auto shortest = *std::min_element(table_.times.begin(), table_.times.end());
  const std::int32_t first_ns = block_ns(0, packet.returns) + shortest;
  result.first_firing = nanoseconds(first_ns);
  LaserReturn* out = scratch_.data();
  for (int b = 0; b < table_.blocks; b += packet.returns) {
    const std::byte* first = bytes.data() + table_.head + table_.block_bytes() * static_cast<std::size_t>(b);
    const auto azimuth = static_cast<int>(u16(first + table_.flag));
    bool is_good = azimuth < kCircle;
    for (int i = 0; i < packet.returns; ++i) {
      const std::byte* block = first + table_.block_bytes() * static_cast<std::size_t>(i);
      is_good &= std::memcmp(block, first, table_.flag + 2) == 0;
      is_good &= table_.flag == 0 || u16(block) == 0xEEFF;
    }
    if (!is_good) {
      result.malformed += packet.returns;
      continue;
    }
    const bool is_second = !table_.times_of_second.empty() && (packet.returns == 1 ? b % 2 != 0 : packet.is_second);
    out = decode_group(first, packet.returns, azimuth, block_ns(b, packet.returns) - first_ns, is_second, out);
  }
  returns.assign(scratch_.data(), out);
  return result;
}

/// Fills the lanes of one block.
void HesaiKernel::fill_lanes(const std::byte* units, int azimuth, std::int32_t block_ns, bool is_second) {
  const std::size_t count = table_.beams.size(), unit = table_.unit;
  alignas(16) std::array<std::uint32_t, kMost> words{};
  for (std::size_t c = 0; c < count; ++c) std::memcpy(&words[c], units + unit * c, 3);
  const float sin_block = sin_[static_cast<std::size_t>(azimuth)], cos_block = cos_[static_cast<std::size_t>(azimuth)];
  const float block_rad = static_cast<float>(azimuth) * kRadPerCount, range_step = range_step_;
  const std::int32_t nearest = nearest_, span = span_;
  const auto& times = is_second ? channels_.time_of_second_ns : channels_.time_ns;
  for (std::size_t c = 0; c < count; ++c) {
    const auto distance = static_cast<std::int32_t>(words[c] & 0xFFFFU);
    const float range = static_cast<float>(distance) * range_step;
    const float flat = range * channels_.cos_elevation[c];
    lanes_.x[c] = flat * (sin_block * channels_.cos_azimuth[c] + cos_block * channels_.sin_azimuth[c]);
    lanes_.y[c] = flat * (cos_block * channels_.cos_azimuth[c] - sin_block * channels_.sin_azimuth[c]);
    lanes_.z[c] = range * channels_.sin_elevation[c];
    lanes_.range[c] = range;
    lanes_.azimuth[c] = in_circle(block_rad + channels_.azimuth[c]);
    lanes_.time_ns[c] = block_ns + times[c];
    lanes_.tags[c] = tags_of(channels_.ring[c], words[c] >> 16U & 0xFFU, 1);
    lanes_.return_count[c] = 1;
    const std::int32_t past = distance - nearest;
    lanes_.keep[c] = static_cast<std::uint32_t>(past >= 0) & static_cast<std::uint32_t>(past <= span);
  }
}

/// Decodes the blocks of the same firings.
LaserReturn* HesaiKernel::decode_group(const std::byte* first, int returns, int azimuth, std::int32_t block_ns,
                                       bool is_second, LaserReturn* out) {
  const std::size_t units = table_.flag + 2;
  fill_lanes(first + units, azimuth, block_ns, is_second);
  if (returns == 1) return write_returns(lanes_, table_.beams.size(), out);

  for (std::size_t c = 0; c < table_.beams.size(); ++c) {
    struct Echo {
      std::int32_t distance;
      std::uint32_t reflectivity;
    };
    std::array<Echo, 3> echoes{};
    std::size_t count = 0;
    for (int i = 0; i < returns; ++i) {
      const std::byte* unit = first + table_.block_bytes() * static_cast<std::size_t>(i) + units + table_.unit * c;
      const Echo echo{static_cast<std::int32_t>(u16(unit)), static_cast<std::uint32_t>(unit[2])};
      const bool is_new = std::none_of(echoes.begin(), echoes.begin() + static_cast<std::ptrdiff_t>(count),
                                       [&](const Echo& other) { return other.distance == echo.distance; });
      if (echo.distance != 0 && is_new) echoes[count++] = echo;
    }
    std::sort(echoes.begin(), echoes.begin() + static_cast<std::ptrdiff_t>(count),
              [](const Echo& a, const Echo& b) { return a.distance < b.distance; });
    for (std::size_t k = 0; k < count; ++k) {
      const std::int32_t past = echoes[k].distance - nearest_;
      if (past < 0 || past > span_) continue;
      // The lanes hold the first block's distance; the direction is the same.
      const float range = static_cast<float>(echoes[k].distance) * range_step_,
                  flat = range * channels_.cos_elevation[c];
      const float sin_block = sin_[static_cast<std::size_t>(azimuth)];
      const float cos_block = cos_[static_cast<std::size_t>(azimuth)];
      out->x = flat * (sin_block * channels_.cos_azimuth[c] + cos_block * channels_.sin_azimuth[c]);
      out->y = flat * (cos_block * channels_.cos_azimuth[c] - sin_block * channels_.sin_azimuth[c]);
      out->z = range * channels_.sin_elevation[c];
      out->range_m = range;
      out->azimuth = lanes_.azimuth[c];
      out->time_offset_ns = lanes_.time_ns[c];
      out->channel = static_cast<std::uint16_t>(channels_.ring[c]);
      out->reflectivity = static_cast<std::uint8_t>(echoes[k].reflectivity);
      out->return_number = static_cast<std::uint8_t>(k + 1);
      out->return_count = static_cast<std::uint8_t>(count);
      ++out;
    }
  }
  return out;
}

}  // namespace hueline::drivers
