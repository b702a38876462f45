#include <map>
#include <memory>
#include <string>
#include <utility>

#include "rosbag/bag.hpp"
#include "rosbag/foxglove_message.hpp"
#include "rosbag/packed_message.hpp"
#include "storage/journal_header.hpp"
#include "storage/mcap_reader.hpp"

namespace hueline::rosbag {
namespace {

class McapBag final : public Bag {
 public:
  explicit McapBag(storage::McapReader reader) : reader_(std::move(reader)) {}

  const std::vector<BagTopic>& topics() const override { return topics_.all(); }
  Result<BagMessage> next() override {
    auto message = reader_.next();
    if (!message.ok()) {
      // The channels without a message are topics, too: who looks for one learns that nothing came.
      if (message.error().code == ErrorCode::EndOfData)
        for (const auto& [number, channel] : reader_.channels()) topic_of(number);
      return message.error();
    }
    const auto topic = topic_of(message->channel);
    if (!topic) return Error{ErrorCode::Malformed, "a message of one topic too many was skipped"};
    const UnixTime received(nanoseconds(static_cast<std::int64_t>(message->log_time)));
    if (const auto foxglove = foxglove_.find(*topic); foxglove != foxglove_.end()) {
      auto turned = foxglove->second->turned(message->data.bytes());
      if (turned.ok()) return BagMessage{*topic, received, std::move(*turned)};
      return skipped(*topic, turned.error().message);
    }
    if (topics_.all()[*topic].encoding != drivers::RosEncoding::Cdr || !is_packed(message->data.bytes()))
      return BagMessage{*topic, received, std::move(message->data)};
    auto whole = unpacked(message->data.bytes());
    if (!whole.ok()) return skipped(*topic, whole.error().message);
    return BagMessage{*topic, received, std::move(*whole)};
  }

 private:
  Error skipped(std::size_t topic, const std::string& why) const {
    return {ErrorCode::Malformed, "a message of " + topics_.all()[topic].name + ": " + why + "; it is skipped"};
  }
  std::optional<std::size_t> topic_of(std::uint16_t number) {
    const storage::McapChannel& channel = reader_.channels().at(number);
    const auto known = by_channel_.find(number);
    if (known != by_channel_.end() && topics_.all()[known->second].name == channel.topic) return known->second;
    BagTopic topic{channel.topic, {}, drivers::RosEncoding::Cdr, {}};
    const auto schema = reader_.schemas().find(channel.schema_id);
    if (schema != reader_.schemas().end()) topic.type = drivers::ros_type(schema->second.name);
    if (channel.message_encoding == "ros1")
      topic.encoding = drivers::RosEncoding::Ros1;
    else if (topic.type == storage::kRawPacketSchema)
      topic.trouble = kIsOfDrive;
    else if (channel.message_encoding != "cdr")
      return foxglove_topic(number, channel,
                            schema == reader_.schemas().end() ? storage::McapSchema() : schema->second);
    const auto index = topics_.add(std::move(topic));
    if (index) by_channel_[number] = *index;
    return index;
  }
  std::optional<std::size_t> foxglove_topic(std::uint16_t number, const storage::McapChannel& channel,
                                            const storage::McapSchema& schema) {
    BagTopic topic{channel.topic, schema.name, drivers::RosEncoding::Ros1, {}};
    const bool is_of_view = reader_.library().starts_with("hueline") && reader_.profile().empty();
    auto reader = is_of_view ? Result<std::unique_ptr<FoxgloveReader>>(Error{ErrorCode::Unsupported, kIsOfView})
                             : FoxgloveReader::make(schema, channel.message_encoding);
    if (reader.ok()) {
      topic.type = (*reader)->type();
      topic.written_type = schema.name;
    } else {
      topic.trouble = reader.error().message;
    }
    const auto index = topics_.add(std::move(topic));
    if (!index) return {};
    by_channel_[number] = *index;
    if (reader.ok()) foxglove_[*index] = std::move(*reader);
    return index;
  }

  storage::McapReader reader_;
  TopicList topics_;
  std::map<std::uint16_t, std::size_t> by_channel_;
  std::map<std::size_t, std::unique_ptr<FoxgloveReader>> foxglove_;  // by topic
};

}  // namespace

Result<std::unique_ptr<Bag>> open_mcap_bag(const std::filesystem::path& path) {
  auto reader = storage::McapReader::open(path);
  if (!reader.ok()) return reader.error();
  return std::unique_ptr<Bag>(std::make_unique<McapBag>(std::move(*reader)));
}

}  // namespace hueline::rosbag
