#include "rosbag/ordered_bag.hpp"

#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

#include "core/input_file.hpp"
#include "storage/file_writer.hpp"

namespace hueline::rosbag {
namespace {

/// Where a message lies in the copy.
struct Place {
  UnixTime received;
  std::size_t topic;
  std::uint64_t offset;
  std::size_t size;
};

class OrderedBag final : public Bag {
 public:
  OrderedBag(std::vector<BagTopic> topics, std::vector<Place> places, std::vector<Error> damages, Error end,
             InputFile copy)
      : topics_(std::move(topics)),
        places_(std::move(places)),
        damages_(std::move(damages)),
        end_(std::move(end)),
        copy_(std::move(copy)),
        pool_(std::numeric_limits<std::size_t>::max() / 2) {}

  const std::vector<BagTopic>& topics() const override { return topics_; }
  Result<BagMessage> next() override {
    if (told_ < damages_.size()) return damages_[told_++];
    if (at_ == places_.size()) return end_;
    const Place& place = places_[at_++];
    MutableBuffer data = pool_.acquire(place.size);
    if (Status done = copy_.read(place.offset, data.bytes()); !done.ok()) {
      at_ = places_.size();
      end_ = done.error();
      return end_;
    }
    return BagMessage{place.topic, place.received, std::move(data).share()};
  }

 private:
  std::vector<BagTopic> topics_;
  std::vector<Place> places_;
  std::vector<Error> damages_;
  Error end_;
  InputFile copy_;
  BufferPool pool_;
  std::size_t at_ = 0, told_ = 0;
};

}  // namespace

Result<std::unique_ptr<Bag>> in_order(Bag& bag, const std::filesystem::path& copy, const TimeOfMessage& time_of) {
  auto writer = storage::FileWriter::create(copy, IfExists::Replace);
  if (!writer.ok()) return writer.error();
  std::vector<Place> places;
  std::vector<Error> damages;
  for (;;) {
    const auto message = bag.next();
    if (!message.ok() && message.error().code == ErrorCode::Malformed) {
      damages.push_back(message.error());
      continue;
    }
    if (!message.ok()) {
      if (Status closed = writer->close(); !closed.ok()) return closed.error();
      auto file = InputFile::open(copy);
      if (!file.ok()) return file.error();
      std::ranges::stable_sort(places, {}, &Place::received);
      return std::unique_ptr<Bag>(std::make_unique<OrderedBag>(bag.topics(), std::move(places), std::move(damages),
                                                               message.error(), std::move(*file)));
    }
    const auto time = time_of(bag.topics()[message->topic], *message);
    if (!time) continue;
    places.push_back({*time, message->topic, writer->size(), message->data.size()});
    if (Status done = writer->write(message->data.bytes()); !done.ok()) return done.error();
  }
}

}  // namespace hueline::rosbag
