#include "apps/score/cloud_print.hpp"

#include <cstring>

#include "core/point_fields.hpp"

namespace hueline::apps {

/// FNV-1a over 64-bit words, twice with different start values.
void CloudPrint::add(const ColouredPoint& p) {
  ++points_;
  const auto word = [this](std::uint64_t w) {
    for (std::uint64_t& h : value_) {
      h = (h ^ w) * 0x100000001B3ull;
      h ^= h >> 29;
    }
  };
  constexpr std::size_t kBytes = [] {
    std::size_t bytes = 0;
    for_each_field<kPointFields>([&](auto field) { bytes += sizeof(typename decltype(field)::Number); });
    return bytes;
  }();
  std::array<std::uint64_t, (kBytes + 7) / 8> words{};
  auto* at = reinterpret_cast<std::byte*>(words.data());
  for_each_field<kPointFields>([&](auto field) {
    const auto number = field.number(p);
    std::memcpy(at, &number, sizeof number);
    at += sizeof number;
  });
  for (const std::uint64_t w : words) word(w);
}

}  // namespace hueline::apps
