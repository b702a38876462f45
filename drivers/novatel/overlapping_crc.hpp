#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace hueline::drivers {

/// novatel_crc32() of ranges of one stream that may overlap, at a cost that does not depend on how far they do: no byte
/// is hashed more than twice. Garbage can look like thousands of headers, each of which claims the same kilobytes.
///
/// A range that overlaps none before it is hashed directly. For others, the values of all prefixes of the stretch are
/// kept: the register is linear, so the value of [begin, end) is prefix(end) xor prefix(begin) moved on by end - begin
/// bytes of zero. Thread-bound.
class OverlappingCrc {
 public:
  /// Of `bytes`, which begin at `position` of the stream and are at most 65599. Positions of successive calls must not
  /// fall.
  std::uint32_t of(std::span<const std::byte> bytes, std::uint64_t position);

  /// Work done so far.
  std::uint64_t bytes_hashed() const { return bytes_hashed_; }

 private:
  std::uint64_t hashed_to_ = 0;  // end of the farthest range
  std::uint64_t first_ = 0;      // position of prefixes_[0]
  std::vector<std::uint32_t>
      prefixes_;  // [k]: of the stretch up to first_ + k; where the stretch began does not matter
  std::uint64_t bytes_hashed_ = 0;
};

}  // namespace hueline::drivers
