#pragma once

#include <google/protobuf/message.h>

#include <cstdint>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/time.hpp"

/// The fields of messages in Foxglove's schemas by their names, whether they came as protobuf or as JSON.
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

/// Return the part for a message, which must outlive it and all parts of it. The second throws WrongForm if `message`
/// is no object.
std::unique_ptr<FoxglovePart> part_of(const google::protobuf::Message& message);
std::unique_ptr<FoxglovePart> part_of(const nlohmann::json& message);

}  // namespace hueline::rosbag
