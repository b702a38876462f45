#include "drivers/novatel/overlapping_crc.hpp"

#include <algorithm>
#include <array>

#include "drivers/novatel/crc32.hpp"

namespace hueline::drivers {
namespace {

constexpr std::uint32_t kPolynomial = 0xEDB88320;  // reflected: the coefficient of x^0 is the highest bit

/// Returns a * b modulo the polynomial. It uses masks instead of branches, because the bits cannot be predicted.
constexpr std::uint32_t multiply(std::uint32_t a, std::uint32_t b) {
  std::uint32_t product = 0;
  for (int bit = 31; bit >= 0; --bit) {
    product ^= b & (0u - (a >> bit & 1u));
    b = (b >> 1) ^ (kPolynomial & (0u - (b & 1u)));
  }
  return product;
}

/// Returns base^0, base^1, ...
template <std::size_t N>
constexpr std::array<std::uint32_t, N> powers(std::uint32_t base) {
  std::array<std::uint32_t, N> all{};
  all[0] = 0x80000000u;
  for (std::size_t i = 1; i < N; ++i) all[i] = multiply(all[i - 1], base);
  return all;
}
constexpr std::uint32_t kByte = 0x00800000u;  // x^8: what one zero byte does to the register
constexpr auto kBytes = powers<257>(kByte);
constexpr auto kPages = powers<258>(kBytes[256]);  // 256 bytes each

/// Returns the register after `count` zero bytes.
constexpr std::uint32_t moved_on(std::uint32_t crc, std::size_t count) {
  return multiply(multiply(crc, kBytes[count % 256]), kPages[count / 256]);
}

constexpr auto kStep = [] {
  std::array<std::uint32_t, 256> table{};
  for (std::uint32_t i = 0; i < table.size(); ++i) table[i] = multiply(i, kByte);
  return table;
}();

}  // namespace

std::uint32_t OverlappingCrc::of(std::span<const std::byte> bytes, std::uint64_t position) {
  const std::uint64_t end = position + bytes.size();
  if (position >= hashed_to_) {
    hashed_to_ = end;
    bytes_hashed_ += bytes.size();
    prefixes_.clear();
    return novatel_crc32(bytes);
  }
  hashed_to_ = std::max(hashed_to_, end);
  if (prefixes_.empty() || position >= first_ + prefixes_.size()) {
    first_ = position;
    prefixes_.assign(1, 0);
  }
  // Earlier prefixes are not needed again. They are removed only when they are more than half, so that moving the rest
  // costs little for each byte.
  if (const std::size_t unused = position - first_; unused > prefixes_.size() / 2) {
    prefixes_.erase(prefixes_.begin(), prefixes_.begin() + static_cast<std::ptrdiff_t>(unused));
    first_ = position;
  }
  for (std::uint64_t at = first_ + prefixes_.size() - 1; at < end; ++at) {
    const std::uint32_t crc = prefixes_.back();
    prefixes_.push_back(kStep[(crc ^ static_cast<std::uint32_t>(bytes[at - position])) & 0xFF] ^ (crc >> 8));
    ++bytes_hashed_;
  }
  return prefixes_[end - first_] ^ moved_on(prefixes_[position - first_], bytes.size());
}

}  // namespace hueline::drivers
