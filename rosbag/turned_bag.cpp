#include "rosbag/turned_bag.hpp"

#include <utility>
#include <vector>

#include "rosbag/foxglove_message.hpp"

namespace hueline::rosbag {
namespace {

class TurnedBag final : public Bag {
 public:
  explicit TurnedBag(std::unique_ptr<Bag> bag) : bag_(std::move(bag)) { take_topics(); }

  const std::vector<BagTopic>& topics() const override { return topics_; }
  Result<BagMessage> next() override {
    auto message = bag_->next();
    take_topics();
    if (!message.ok()) return message;
    const FoxgloveReader* reader = readers_[message->topic].get();
    if (!reader) return message;
    auto turned = reader->turned(message->data.bytes());
    if (!turned.ok())
      return Error{ErrorCode::Malformed,
                   "a message of " + topics_[message->topic].name + ": " + turned.error().message + "; it is skipped"};
    message->data = std::move(*turned);
    return message;
  }

 private:
  void take_topics() {
    for (std::size_t i = topics_.size(); i < bag_->topics().size(); ++i) {
      BagTopic topic = bag_->topics()[i];
      readers_.push_back(topic.trouble.empty() ? FoxgloveReader::of_ros(topic.type, topic.encoding) : nullptr);
      if (const auto& reader = readers_.back()) {
        topic.written_type = std::exchange(topic.type, reader->type());
        topic.encoding = drivers::RosEncoding::Ros1;
      }
      topics_.push_back(std::move(topic));
    }
  }

  std::unique_ptr<Bag> bag_;
  std::vector<BagTopic> topics_;
  std::vector<std::unique_ptr<FoxgloveReader>> readers_;  // of each topic; null: its messages stay
};

}  // namespace

std::unique_ptr<Bag> turned_bag(std::unique_ptr<Bag> bag) { return std::make_unique<TurnedBag>(std::move(bag)); }

}  // namespace hueline::rosbag
