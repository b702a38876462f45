#include "rosbag/foxglove_part.hpp"

#include <google/protobuf/descriptor.h>

#include <utility>

#include "core/base64.hpp"

namespace hueline::rosbag {
namespace {

namespace pb = google::protobuf;

class ProtobufPart final : public FoxglovePart {
 public:
  explicit ProtobufPart(const pb::Message& message) : message_(&message), of_(message.GetReflection()) {}

  double number(const std::string& name) const override {
    const pb::FieldDescriptor* field = find(name, false);
    return field ? value(*field, -1, name) : 0;
  }
  std::string text(const std::string& name) const override { return bytes(name); }
  std::string bytes(const std::string& name) const override {
    const pb::FieldDescriptor* field = find(name, false);
    if (!field) return {};
    if (field->cpp_type() != pb::FieldDescriptor::CPPTYPE_STRING) throw WrongForm{name};
    return of_->GetString(*message_, field);
  }
  UnixTime time(const std::string& name) const override {
    const pb::Message* found = message(name);
    if (!found) return {};
    const ProtobufPart stamp(*found);
    return foxglove_time(stamp.integer("seconds"), stamp.integer("nanos"));
  }
  std::vector<double> numbers(const std::string& name) const override {
    const pb::FieldDescriptor* field = find(name, true);
    std::vector<double> out;
    for (int i = 0; field && i < of_->FieldSize(*message_, field); ++i) out.push_back(value(*field, i, name));
    return out;
  }
  std::unique_ptr<FoxglovePart> part(const std::string& name) const override {
    const pb::Message* found = message(name);
    return found ? std::make_unique<ProtobufPart>(*found) : nullptr;
  }
  std::vector<std::unique_ptr<FoxglovePart>> parts(const std::string& name) const override {
    const pb::FieldDescriptor* field = find(name, true);
    if (field && field->cpp_type() != pb::FieldDescriptor::CPPTYPE_MESSAGE) throw WrongForm{name};
    std::vector<std::unique_ptr<FoxglovePart>> out;
    for (int i = 0; field && i < of_->FieldSize(*message_, field); ++i)
      out.push_back(std::make_unique<ProtobufPart>(of_->GetRepeatedMessage(*message_, field, i)));
    return out;
  }

 private:
  /// Reading a field as what it is not would end the program.
  const pb::FieldDescriptor* find(const std::string& name, bool is_repeated) const {
    const pb::FieldDescriptor* field = message_->GetDescriptor()->FindFieldByName(name);
    if (field && field->is_repeated() != is_repeated) throw WrongForm{name};
    return field;
  }
  const pb::Message* message(const std::string& name) const {
    const pb::FieldDescriptor* field = find(name, false);
    if (!field) return nullptr;
    if (field->cpp_type() != pb::FieldDescriptor::CPPTYPE_MESSAGE) throw WrongForm{name};
    return of_->HasField(*message_, field) ? &of_->GetMessage(*message_, field) : nullptr;
  }
  std::int64_t integer(const std::string& name) const {
    const pb::FieldDescriptor* field = find(name, false);
    if (!field) return 0;
    if (field->cpp_type() == pb::FieldDescriptor::CPPTYPE_INT64) return of_->GetInt64(*message_, field);
    if (field->cpp_type() == pb::FieldDescriptor::CPPTYPE_INT32) return of_->GetInt32(*message_, field);
    throw WrongForm{name};
  }
  /// `at`: of a repeated field; -1: it is none.
  double value(const pb::FieldDescriptor& field, int at, const std::string& name) const {
    const bool is_one = at < 0;
    const pb::Message& m = *message_;
    switch (field.cpp_type()) {
      case pb::FieldDescriptor::CPPTYPE_INT32:
        return is_one ? of_->GetInt32(m, &field) : of_->GetRepeatedInt32(m, &field, at);
      case pb::FieldDescriptor::CPPTYPE_UINT32:
        return is_one ? of_->GetUInt32(m, &field) : of_->GetRepeatedUInt32(m, &field, at);
      case pb::FieldDescriptor::CPPTYPE_DOUBLE:
        return is_one ? of_->GetDouble(m, &field) : of_->GetRepeatedDouble(m, &field, at);
      case pb::FieldDescriptor::CPPTYPE_FLOAT:
        return static_cast<double>(is_one ? of_->GetFloat(m, &field) : of_->GetRepeatedFloat(m, &field, at));
      case pb::FieldDescriptor::CPPTYPE_ENUM:
        return is_one ? of_->GetEnumValue(m, &field) : of_->GetRepeatedEnumValue(m, &field, at);
      default:
        throw WrongForm{name};
    }
  }

  const pb::Message* message_;
  const pb::Reflection* of_;
};

class JsonPart final : public FoxglovePart {
 public:
  explicit JsonPart(const nlohmann::json& json) : json_(&json) {
    if (!json.is_object()) throw WrongForm{"an object"};
  }

  double number(const std::string& name) const override {
    const nlohmann::json* found = find(name);
    return found ? value(*found, name) : 0;
  }
  std::string text(const std::string& name) const override {
    const nlohmann::json* found = find(name);
    if (!found) return {};
    if (!found->is_string()) throw WrongForm{name};
    return found->get<std::string>();
  }
  std::string bytes(const std::string& name) const override {
    auto bytes = from_base64(text(name));
    if (!bytes) throw WrongForm{name};
    return std::move(*bytes);
  }
  UnixTime time(const std::string& name) const override {
    const auto stamp = part(name);
    if (!stamp) return {};
    return foxglove_time(std::int64_t{stamp->whole("sec")}, std::int64_t{stamp->whole("nsec")});
  }
  std::vector<double> numbers(const std::string& name) const override {
    std::vector<double> out;
    for (const nlohmann::json& one : array(name)) out.push_back(value(one, name));
    return out;
  }
  std::unique_ptr<FoxglovePart> part(const std::string& name) const override {
    const nlohmann::json* found = find(name);
    return found ? std::make_unique<JsonPart>(*found) : nullptr;
  }
  std::vector<std::unique_ptr<FoxglovePart>> parts(const std::string& name) const override {
    std::vector<std::unique_ptr<FoxglovePart>> out;
    for (const nlohmann::json& one : array(name)) out.push_back(std::make_unique<JsonPart>(one));
    return out;
  }

 private:
  const nlohmann::json* find(const std::string& name) const {
    const auto found = json_->find(name);
    return found == json_->end() || found->is_null() ? nullptr : &*found;
  }
  const nlohmann::json& array(const std::string& name) const {
    static const nlohmann::json kNone = nlohmann::json::array();
    const nlohmann::json* found = find(name);
    if (found && !found->is_array()) throw WrongForm{name};
    return found ? *found : kNone;
  }
  static double value(const nlohmann::json& json, const std::string& name) {
    if (!json.is_number()) throw WrongForm{name};
    return json.get<double>();
  }

  const nlohmann::json* json_;
};

}  // namespace

UnixTime foxglove_time(std::int64_t seconds, std::int64_t nanos) {
  constexpr std::int64_t kMost = 4'294'967'295, kSecond_ns = 1'000'000'000;  // what a stamp of ROS can hold
  if (seconds < 0 || seconds > kMost || nanos < 0 || nanos >= kSecond_ns) throw WrongForm{"timestamp"};
  return UnixTime(nanoseconds(seconds * kSecond_ns + nanos));
}

std::unique_ptr<FoxglovePart> part_of(const pb::Message& message) { return std::make_unique<ProtobufPart>(message); }
std::unique_ptr<FoxglovePart> part_of(const nlohmann::json& message) { return std::make_unique<JsonPart>(message); }

}  // namespace hueline::rosbag
