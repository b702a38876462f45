#include "apps/cloud_print.hpp"

#include <bit>

namespace hueline::apps {

/// FNV-1a over 64-bit words, twice from different beginnings.
void CloudPrint::add(const ColouredPoint& p) {
  ++points_;
  const auto word = [this](std::uint64_t w) {
    for (std::uint64_t& h : value_) {
      h = (h ^ w) * 0x100000001B3ull;
      h ^= h >> 29;
    }
  };
  for (const double x : {p.east, p.north, p.up}) word(std::bit_cast<std::uint64_t>(x));
  word(static_cast<std::uint64_t>(count_ns(p.time)));
  word(std::uint64_t{std::bit_cast<std::uint32_t>(p.u)} << 32 | std::bit_cast<std::uint32_t>(p.v));
  word(std::uint64_t{p.exposure} << 32 | std::bit_cast<std::uint32_t>(p.sigma_m));
  word(std::uint64_t{p.red} | std::uint64_t{p.green} << 8 | std::uint64_t{p.blue} << 16 | std::uint64_t{static_cast<std::uint8_t>(p.state)} << 24 |
       std::uint64_t{p.lens} << 32 | std::uint64_t{p.quality} << 40 | std::uint64_t{p.reflectivity} << 48);
  word(std::uint64_t{p.return_number} | std::uint64_t{p.return_count} << 8 | std::uint64_t{p.channel} << 16 | std::uint64_t{p.sensor} << 32);
}

}  // namespace hueline::apps
