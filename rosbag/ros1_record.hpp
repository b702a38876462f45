#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "storage/byte_order.hpp"

/// Records of ROS 1's recording format, version 2.0: a header of fields and data, each behind its length.
namespace hueline::rosbag {

constexpr std::uint32_t kLargestRos1Header = 1u << 20;

/// What a record is.
enum class Ros1Op : std::uint8_t { Message = 2, FileHeader = 3, Index = 4, Chunk = 5, ChunkInfo = 6, Connection = 7 };

/// The fields of a record's header: "name=value", each behind its length.
class Ros1Header {
 public:
  explicit Ros1Header(storage::ByteView header) {
    storage::ByteReader in(header);
    while (in.ok() && in.remaining() > 0) {
      const std::string field = in.take_string();
      const auto equals = field.find('=');
      if (!in.ok() || equals == std::string::npos) {
        is_sound_ = false;
        return;
      }
      values_[field.substr(0, equals)] = field.substr(equals + 1);
    }
  }
  bool is_sound() const { return is_sound_; }
  std::string text(const std::string& name) const {
    const auto found = values_.find(name);
    return found == values_.end() ? std::string() : found->second;
  }
  template <class T>
  std::optional<T> number(const std::string& name) const {
    const auto found = values_.find(name);
    if (found == values_.end() || found->second.size() != sizeof(T)) return {};
    return storage::ByteReader(storage::as_bytes(found->second)).take<T>();
  }
  std::optional<Ros1Op> op() const {
    const auto value = number<std::uint8_t>("op");
    return value ? std::optional(static_cast<Ros1Op>(*value)) : std::nullopt;
  }

 private:
  std::map<std::string, std::string> values_;
  bool is_sound_ = true;
};

}  // namespace hueline::rosbag
