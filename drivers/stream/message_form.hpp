#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

/// How a protocol marks its messages in a stream of bytes.
namespace hueline::drivers {

/// What the bytes from one position of a stream on are.
struct Judgement {
  enum class Verdict : std::uint8_t {
    Noise,     ///< no message of this form begins here
    NeedMore,  ///< one may begin here; more bytes are needed
    Broken,    ///< one begins here, but its length or its check sum is wrong
    Whole,     ///< a message of `bytes` bytes
  };
  Verdict verdict = Verdict::Noise;
  std::size_t bytes = 0;
};

/// One protocol's way to mark the beginning, the length and the check sum of a message. A form knows nothing of what
/// messages mean. The amount of its work must be in proportion to the bytes of the stream, also for garbage: see
/// OverlappingHash.
/// Thread safety: none; one framer uses a form.
class MessageForm {
 public:
  virtual ~MessageForm() = default;
  /// Judges the bytes from `position` of the stream on. `rest` is not empty. `is_boundary`: the stream begins here, or
  /// a message or a line has just ended. Positions never decrease from call to call.
  virtual Judgement judge(std::span<const std::byte> rest, std::uint64_t position, bool is_boundary) = 0;
};

/// Returns the field at a byte offset, in the byte order of this computer, which is little endian (novatel/wire.hpp
/// checks it). The caller has checked that it lies inside `bytes`.
template <class T>
T stream_field(std::span<const std::byte> bytes, std::size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof(T));
  return value;
}
/// Returns the big-endian field at a byte offset.
template <class T>
T stream_field_big(std::span<const std::byte> bytes, std::size_t offset) {
  std::byte turned[sizeof(T)];
  for (std::size_t i = 0; i < sizeof(T); ++i) turned[i] = bytes[offset + sizeof(T) - 1 - i];
  T value;
  std::memcpy(&value, turned, sizeof(T));
  return value;
}

}  // namespace hueline::drivers
