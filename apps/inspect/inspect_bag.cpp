#include <algorithm>
#include <map>

#include "apps/inspect/inspect.hpp"
#include "core/calendar.hpp"
#include "core/utc_text.hpp"
#include "rosbag/bag.hpp"

namespace hueline::apps {

Inspection inspect_bag(const std::string& path) {
  auto bag = rosbag::open_bag(path);
  if (!bag.ok()) return {nullptr, bag.error()};
  Inspection out;
  struct Count {
    std::uint64_t messages = 0, bytes = 0;
  };
  std::map<std::size_t, Count> counts;
  std::uint64_t messages = 0, damages = 0;
  UnixTime first{}, last{};
  for (;;) {
    const auto message = (*bag)->next();
    if (!message.ok()) {
      if (message.error().code == ErrorCode::EndOfData) break;
      if (out.trouble.ok()) out.trouble = message.error();
      if (message.error().code != ErrorCode::Malformed) break;
      ++damages;
      continue;
    }
    if (messages++ == 0) first = last = message->received;
    first = std::min(first, message->received);
    last = std::max(last, message->received);
    Count& count = counts[message->topic];
    ++count.messages;
    count.bytes += message->data.size();
  }
  out.found = std::make_unique<nlohmann::ordered_json>();
  nlohmann::ordered_json& json = *out.found;
  const auto& known = (*bag)->topics();
  const bool is_foreign =
      !known.empty() && std::ranges::none_of(known, [](const rosbag::BagTopic& one) { return one.trouble.empty(); });
  json["format"] = is_foreign ? "recording, none of whose messages is read" : "recording of ROS";
  json["messages"] = messages;
  if (messages > 0) {
    json["begin"] = iso_utc(from_unix(first));
    json["duration_s"] = to_seconds(last - first);
  }
  if (damages > 0) json["damaged_parts"] = damages;
  auto& topics = json["topics"] = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < (*bag)->topics().size(); ++i) {
    const rosbag::BagTopic& topic = (*bag)->topics()[i];
    nlohmann::ordered_json one = {{"topic", topic.name},
                                  {"type", topic.written_type.empty() ? topic.type : topic.written_type},
                                  {"messages", counts[i].messages},
                                  {"bytes", counts[i].bytes}};
    if (!topic.trouble.empty()) one["not_readable"] = topic.trouble;
    topics.push_back(std::move(one));
  }
  return out;
}

}  // namespace hueline::apps
