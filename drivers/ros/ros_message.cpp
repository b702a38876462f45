#include "drivers/ros/ros_message.hpp"

namespace hueline::drivers {

const char* name(RosEncoding encoding) { return encoding == RosEncoding::Ros1 ? "ros1" : "cdr"; }

std::string ros_type(std::string_view written) {
  std::string out(written);
  if (const auto middle = out.find("/msg/"); middle != std::string::npos) out.erase(middle, 4);
  return out;
}

RosReader::RosReader(std::span<const std::byte> message, RosEncoding encoding) : bytes_(message), encoding_(encoding) {
  if (encoding == RosEncoding::Ros1) return;
  // The first two bytes, big endian: 0 and 1 are CDR, 6 and 7 its second version, in which nothing is aligned to eight
  // bytes; odd numbers are little endian. The offsets of aligned fields count from behind the four bytes.
  const std::span<const std::byte> head = take_bytes(4);
  if (!ok_) return;
  const auto high = std::to_integer<unsigned>(head[0]), kind = std::to_integer<unsigned>(head[1]);
  ok_ = high == 0 && (kind <= 1 || kind == 6 || kind == 7);
  is_big_endian_ = kind % 2 == 0;
  if (kind >= 6) most_alignment_ = 4;
  bytes_ = bytes_.subspan(4);
  at_ = 0;
}

void RosReader::align(std::size_t size) {
  if (encoding_ == RosEncoding::Ros1) return;
  const std::size_t to = size < most_alignment_ ? size : most_alignment_;
  take_bytes((to - at_ % to) % to);
}

std::span<const std::byte> RosReader::take_bytes(std::uint64_t size) {
  if (!ok_ || size > remaining()) {
    ok_ = false;
    return {};
  }
  const auto taken = bytes_.subspan(at_, static_cast<std::size_t>(size));
  at_ += static_cast<std::size_t>(size);
  return taken;
}

std::uint32_t RosReader::take_count(std::size_t element_bytes) {
  const auto count = take<std::uint32_t>();
  if (count > remaining() / element_bytes) ok_ = false;
  return ok_ ? count : 0;
}

std::string RosReader::take_string() {
  const std::span<const std::byte> text = take_byte_sequence();
  std::string out(reinterpret_cast<const char*>(text.data()), text.size());
  if (encoding_ == RosEncoding::Cdr && !out.empty() && out.back() == '\0')
    out.pop_back();  // CDR counts a zero at the end
  return out;
}

UnixTime RosReader::take_time() {
  // ROS 1 counts seconds without a sign, ROS 2 with one; both ends of time are far away.
  const std::int64_t seconds = encoding_ == RosEncoding::Ros1 ? take<std::uint32_t>() : take<std::int32_t>();
  const auto rest = take<std::uint32_t>();
  return UnixTime(std::chrono::seconds(seconds) + nanoseconds(rest));
}

RosHeader RosReader::take_header() {
  if (encoding_ == RosEncoding::Ros1) take<std::uint32_t>();  // running number, which ROS 2 has no more
  RosHeader out;
  out.stamp = take_time();
  out.frame = take_string();
  return out;
}

}  // namespace hueline::drivers
