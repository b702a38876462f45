#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

/// Reads and writes little-endian values in byte arrays. MCAP, the fixed-size types of protobuf and LAS are all
/// little-endian, and so are the processors that this program is built for (x86-64, ARM64).
namespace hueline::storage {

static_assert(std::endian::native == std::endian::little, "the file formats are written by memcpy");

using Bytes = std::vector<std::byte>;
using ByteView = std::span<const std::byte>;

inline ByteView as_bytes(std::string_view text) { return std::as_bytes(std::span(text.data(), text.size())); }

inline void append(Bytes& out, ByteView bytes) {
  if (bytes.empty()) return;
  const std::size_t at = out.size();
  out.resize(at + bytes.size());
  std::memcpy(out.data() + at, bytes.data(), bytes.size());
}

/// Appends a number as it lies in memory.
template <class T>
requires std::is_arithmetic_v<T>
void append(Bytes& out, T value) {
  const std::size_t at = out.size();
  out.resize(at + sizeof value);
  std::memcpy(out.data() + at, &value, sizeof value);
}

/// Overwrites a number inside `out`. `at + sizeof value` must not exceed the size of `out`.
template <class T>
requires std::is_arithmetic_v<T>
void put(std::span<std::byte> out, std::size_t at, T value) { std::memcpy(out.data() + at, &value, sizeof value); }

/// Reads numbers one after another and never reads past the end. After the first read that does not fit, `ok()` returns
/// false and every further read returns 0.
class ByteReader {
 public:
  explicit ByteReader(ByteView bytes) : bytes_(bytes) {}

  template <class T>
  requires std::is_arithmetic_v<T> T take() {
    T value{};
    const ByteView from = take_bytes(sizeof value);
    if (from.size() == sizeof value) std::memcpy(&value, from.data(), sizeof value);
    return value;
  }
  /// Returns the next `size` bytes, which are not copied; nothing if fewer are left.
  ByteView take_bytes(std::uint64_t size) {
    if (!ok_ || size > bytes_.size() - at_) {
      ok_ = false;
      return {};
    }
    const ByteView taken = bytes_.subspan(at_, static_cast<std::size_t>(size));
    at_ += static_cast<std::size_t>(size);
    return taken;
  }
  /// Reads a string that is preceded by its u32 length.
  std::string take_string() {
    const ByteView text = take_bytes(take<std::uint32_t>());
    return std::string(reinterpret_cast<const char*>(text.data()), text.size());
  }

  /// Returns false after a read that did not fit.
  bool ok() const { return ok_; }
  /// Returns the number of bytes read so far.
  std::size_t position() const { return at_; }
  std::size_t remaining() const { return bytes_.size() - at_; }

 private:
  ByteView bytes_;
  std::size_t at_ = 0;
  bool ok_ = true;
};

}  // namespace hueline::storage
