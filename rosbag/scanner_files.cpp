#include "rosbag/scanner_files.hpp"

#include <algorithm>
#include <optional>
#include <set>
#include <utility>

#include "core/output_file.hpp"
#include "drivers/ros/ros_datagrams.hpp"
#include "storage/pcap_writer.hpp"

namespace hueline::rosbag {
namespace {

/// The port to which a scanner of this message type usually sends. Decoders tell packets apart by content.
std::uint16_t usual_port(const std::string& type) { return type.find("ouster") == 0 ? 7502 : 2368; }

/// A topic with the file that is written of it.
class TopicFile {
 public:
  TopicFile(BagTopic topic, std::filesystem::path path) : path_(std::move(path)) {
    count_.topic = std::move(topic);
    count_.name = path_.filename().string();
  }

  Status take(const BagMessage& message, std::uint64_t most_packets) {
    ++count_.messages;
    count_.bytes += message.data.size();
    const BagTopic& topic = count_.topic;
    if (!topic.trouble.empty()) return {};
    if (is_metadata()) return take_metadata(message);
    if (!drivers::carries_datagrams(topic.type) || is_full_) return {};
    datagrams_.clear();
    if (!drivers::take_datagrams(topic.type, {message.data.bytes(), topic.encoding}, datagrams_)) ++count_.broken;
    for (const drivers::RosDatagram& one : datagrams_) {
      if (count_.packets == most_packets) {
        is_full_ = true;
        return {};
      }
      if (Status done = write(one, message.received); !done.ok()) return done;
    }
    return {};
  }
  Status close() { return file_ ? file_->close() : Status(); }
  const TopicCount& count() const { return count_; }

 private:
  /// Drivers of Ouster publish the metadata as a text.
  bool is_metadata() const {
    return count_.topic.type == "std_msgs/String" && count_.topic.name.find("metadata") != std::string::npos;
  }
  Status take_metadata(const BagMessage& message) {
    if (!count_.file.empty()) return {};
    drivers::RosReader in(message.data.bytes(), count_.topic.encoding);
    const std::string text = in.take_string();
    if (!in.ok() || !text.starts_with('{')) {
      ++count_.broken;
      return {};
    }
    count_.file = path_.string() + ".json";
    return write_output(count_.file, text);
  }
  Status write(const drivers::RosDatagram& one, UnixTime received) {
    if (!file_) {
      count_.file = path_.string() + ".pcap";
      auto file = storage::PcapWriter::create(count_.file);
      if (!file.ok()) return file.error();
      file_ = std::move(*file);
    }
    Status done = file_->write(one.stamp.value_or(received), usual_port(count_.topic.type), one.bytes);
    const bool is_refused = !done.ok() && done.error().code == ErrorCode::Invalid;
    ++(is_refused ? count_.refused : count_.packets);
    return is_refused ? Status() : done;
  }

  std::filesystem::path path_;  // without its ending
  TopicCount count_;
  std::optional<storage::PcapWriter> file_;
  std::vector<drivers::RosDatagram> datagrams_;
  bool is_full_ = false;
};

}  // namespace

std::string plain_name(const std::string& topic) {
  std::string out;
  for (const char c : topic) {
    const bool is_capital = c >= 'A' && c <= 'Z';
    const bool is_plain = (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || is_capital;
    if (is_plain)
      out += static_cast<char>(is_capital ? c - 'A' + 'a' : c);
    else if (!out.empty() && out.back() != '_')
      out += '_';
  }
  while (out.ends_with('_')) out.pop_back();
  return out.empty() ? "topic" : out;
}

Result<ScannerFiles> write_scanner_files(const std::filesystem::path& path, const std::filesystem::path& folder,
                                         std::uint64_t most_packets) {
  auto bag = open_bag(path);
  if (!bag.ok()) return bag.error();
  ScannerFiles out;
  std::vector<TopicFile> files;
  std::set<std::string> names;
  for (;;) {
    const auto message = (*bag)->next();
    for (std::size_t i = files.size(); i < (*bag)->topics().size(); ++i) {
      const BagTopic& topic = (*bag)->topics()[i];
      std::string name = plain_name(topic.name);
      while (!names.insert(name).second) name += "_";
      files.emplace_back(topic, folder / name);
    }
    if (!message.ok()) {
      if (message.error().code == ErrorCode::EndOfData) break;
      if (message.error().code != ErrorCode::Malformed) {
        out.end = message.error();
        break;
      }
      if (out.damages++ == 0) out.first_damage = message.error().message;
      continue;
    }
    TopicFile& file = files[message->topic];
    if (Status done = file.take(*message, most_packets); !done.ok()) return done.error();
  }
  for (TopicFile& file : files) {
    if (Status closed = file.close(); !closed.ok()) return closed.error();
    out.topics.push_back(file.count());
  }
  return out;
}

}  // namespace hueline::rosbag
