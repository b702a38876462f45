#include "storage/crc32.hpp"

#include <libdeflate.h>

#include <array>

namespace hueline::storage {
namespace {

constexpr std::uint32_t kPolynomial = 0xEDB88320u;  // reflected: bit 31 is x^0

/// Returns the product of two polynomials modulo the CRC's polynomial.
constexpr std::uint32_t multiply(std::uint32_t a, std::uint32_t b) {
  std::uint32_t product = 0;
  for (std::uint32_t bit = 1u << 31; bit != 0; bit >>= 1) {
    if (a & bit) product ^= b;
    b = (b & 1u) ? (b >> 1) ^ kPolynomial : b >> 1;
  }
  return product;
}

/// Returns x^(2^n) for n = 0 ... 63.
constexpr std::array<std::uint32_t, 64> powers() {
  std::array<std::uint32_t, 64> table{};
  std::uint32_t p = 1u << 30;  // x^1
  for (auto& entry : table) {
    entry = p;
    p = multiply(p, p);
  }
  return table;
}
constexpr auto kPowers = powers();

}  // namespace

std::uint32_t crc32(std::uint32_t crc, ByteView bytes) {
  if (bytes.empty()) return crc;  // libdeflate starts anew if it is given a null pointer
  return libdeflate_crc32(crc, bytes.data(), bytes.size());
}

std::uint32_t crc32_combine(std::uint32_t crc_a, std::uint32_t crc_b, std::uint64_t size_b) {
  std::uint32_t shift = 1u << 31;  // x^0
  // Multiplies by x^(8 * size_b), from the binary digits of size_b; a byte is 2^3 bits.
  for (std::size_t digit = 3; size_b != 0; size_b >>= 1, ++digit)
    if (size_b & 1u) shift = multiply(shift, kPowers[digit % 64]);
  return multiply(shift, crc_a) ^ crc_b;
}

}  // namespace hueline::storage
