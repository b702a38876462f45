#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace hueline::drivers {

/// Computes novatel_crc32() of ranges of one stream that may overlap. No byte is hashed more than twice, however far
/// the ranges overlap. That bounds the work for garbage that looks like thousands of headers, each of which claims the
/// same kilobytes.
///
/// A range that overlaps no earlier one is hashed directly. For the others the class keeps the CRC of every prefix of
/// the stretch. The CRC register is linear, so the CRC of [begin, end) is prefix(end) xor (prefix(begin) advanced by
/// end - begin zero bytes).
/// Thread safety: none; one thread calls all functions.
class OverlappingCrc {
 public:
  /// Returns the CRC of `bytes`, which begin at `position` of the stream and are at most 65599. `position` must not be
  /// smaller than in the call before.
  std::uint32_t of(std::span<const std::byte> bytes, std::uint64_t position);

  /// Returns the number of bytes hashed so far.
  std::uint64_t bytes_hashed() const { return bytes_hashed_; }

 private:
  std::uint64_t hashed_to_ = 0;  // end of the range that reaches farthest
  std::uint64_t first_ = 0;      // stream position of prefixes_[0]
  // [k] is the CRC of the stretch up to first_ + k. The place where the stretch began does not matter.
  std::vector<std::uint32_t> prefixes_;
  std::uint64_t bytes_hashed_ = 0;
};

}  // namespace hueline::drivers
