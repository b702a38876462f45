#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

#include "core/time.hpp"

/// Messages of the Robot Operating System (ROS), as recordings of others hold them.
namespace hueline::drivers {

/// How the fields of a message lie in its bytes.
enum class RosEncoding : std::uint8_t {
  Ros1,  ///< ROS 1: little endian, one field behind the other
  Cdr,   ///< ROS 2: four bytes that name byte order and version, then fields that are aligned to their size
};
/// Returns the word for it in recordings: "ros1" or "cdr".
const char* name(RosEncoding encoding);

/// Returns the name of a message type without the "msg" in the middle that ROS 2 has: "sensor_msgs/Imu".
std::string ros_type(std::string_view written);

/// What std_msgs/Header says: to which time and to which place on the vehicle the message belongs.
struct RosHeader {
  UnixTime stamp{};   ///< by the clock of the computer that ran the driver, unless the driver took another one
  std::string frame;  ///< name of the coordinate frame
};

/// Reads the fields of a message one after another and never reads past its end. After the first read that does not
/// fit, ok() returns false and every further read returns 0 or nothing. Sources: the ROS wiki's description of message
/// serialization; OMG, Common Data Representation (CORBA 3.1, 15.3) and DDS-XTypes 1.3, 7.4.
/// Thread safety: none.
class RosReader {
 public:
  /// `message` must stay valid as long as this object.
  RosReader(std::span<const std::byte> message, RosEncoding encoding);

  template <class T>
  requires std::is_arithmetic_v<T> T take() {
    align(sizeof(T));
    const std::span<const std::byte> from = take_bytes(sizeof(T));
    if (from.size() != sizeof(T)) return T{};
    std::byte turned[sizeof(T)];
    for (std::size_t i = 0; i < sizeof(T); ++i) turned[i] = from[is_big_endian_ ? sizeof(T) - 1 - i : i];
    T value{};
    std::memcpy(&value, turned, sizeof value);
    return value;
  }
  /// Returns the next `size` bytes, which are not copied; nothing if fewer are left.
  std::span<const std::byte> take_bytes(std::uint64_t size);
  /// Reads the number of elements of a sequence, each of which takes at least `element_bytes`. A number that cannot be
  /// true because of that makes ok() false.
  std::uint32_t take_count(std::size_t element_bytes);
  /// Reads a sequence of bytes; they are not copied.
  std::span<const std::byte> take_byte_sequence() { return take_bytes(take_count(1)); }
  std::string take_string();
  UnixTime take_time();
  RosHeader take_header();

  /// Returns false after a read that did not fit.
  bool ok() const { return ok_; }
  std::size_t remaining() const { return bytes_.size() - at_; }
  RosEncoding encoding() const { return encoding_; }
  bool is_big_endian() const { return is_big_endian_; }

 private:
  void align(std::size_t size);

  std::span<const std::byte> bytes_;
  RosEncoding encoding_;
  std::size_t at_ = 0;
  std::size_t most_alignment_ = 8;
  bool is_big_endian_ = false, ok_ = true;
};

}  // namespace hueline::drivers
