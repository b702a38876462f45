#pragma once

#include <google/protobuf/message.h>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "core/time.hpp"
#include "drivers/ros/ros_message.hpp"

/// The fields of messages in Foxglove's schemas by their names, whatever encoding they came in.
namespace hueline::rosbag {

/// What a message does not have, or has otherwise.
struct WrongForm {
  std::string what;
};

/// A message, or a part of it, whatever its encoding. A field that is not there has the value 0, as in protobuf.
/// Throws WrongForm where a field has another form.
class FoxglovePart {
 public:
  virtual ~FoxglovePart() = default;
  virtual double number(const std::string& field) const = 0;
  virtual std::string text(const std::string& field) const = 0;
  virtual std::string bytes(const std::string& field) const = 0;
  virtual UnixTime time(const std::string& field) const = 0;
  virtual std::vector<double> numbers(const std::string& field) const = 0;
  virtual std::unique_ptr<FoxglovePart> part(const std::string& field) const = 0;  ///< null: it is not there
  virtual std::vector<std::unique_ptr<FoxglovePart>> parts(const std::string& field) const = 0;

  std::uint32_t whole(const std::string& field) const {
    const double value = number(field);
    if (!(value >= 0) || value > std::numeric_limits<std::uint32_t>::max()) throw WrongForm{field};
    return static_cast<std::uint32_t>(value);
  }
};

/// Returns a stamp. Throws WrongForm if ROS cannot express it.
UnixTime foxglove_time(std::int64_t seconds, std::int64_t nanos);

/// Return the part for a message, which must outlive it and all parts of it. The second throws WrongForm if `message`
/// is no object.
std::unique_ptr<FoxglovePart> part_of(const google::protobuf::Message& message);
std::unique_ptr<FoxglovePart> part_of(const nlohmann::json& message);

// Messages whose bytes do not name their fields (foxglove_layout.cpp).

/// Returns the part for a message of foxglove_msgs, whose bytes must outlive it. `schema`: one of FoxgloveReader's
/// table, "PointCloud". Throws WrongForm if the message is shorter than its fields.
std::unique_ptr<FoxglovePart> part_of_ros(const std::string& schema, drivers::RosReader message);
/// Returns the part for a flatbuffer, which must outlive it and all parts of it. `schema` as above.
std::unique_ptr<FoxglovePart> part_of_flatbuffer(const std::string& schema, std::span<const std::byte> message);

}  // namespace hueline::rosbag
