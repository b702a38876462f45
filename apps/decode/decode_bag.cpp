#include "apps/decode/decode_bag.hpp"

#include <fmt/format.h>
#include <stdlib.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <optional>
#include <system_error>
#include <utility>

#include "apps/decode/decode_clouds.hpp"
#include "core/output_file.hpp"
#include "core/printable.hpp"
#include "drivers/ros/ros_cloud.hpp"
#include "drivers/ros/ros_datagrams.hpp"

namespace hueline::apps {
namespace {

/// A folder that is removed with everything in it.
class PassingFolder {
 public:
  static Result<PassingFolder> make(const std::filesystem::path& beside) {
    std::string name = beside.string() + ".packets-XXXXXX";
    if (!::mkdtemp(name.data()))
      return output_error("cannot make a folder for packets beside " + beside.string(), errno);
    return PassingFolder(name);
  }
  PassingFolder(PassingFolder&& other) noexcept : path_(std::exchange(other.path_, {})) {}
  PassingFolder& operator=(PassingFolder&&) = delete;
  ~PassingFolder() {
    std::error_code ignored;
    if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  explicit PassingFolder(std::filesystem::path path) : path_(std::move(path)) {}
  std::filesystem::path path_;
};

/// Takes over what topics gave.
void add(DecodedBag& out, DecodedCapture decoded) {
  for (DecodedScanner& scanner : decoded.scanners) out.decoded.scanners.push_back(std::move(scanner));
  for (std::string& one : decoded.not_supported) out.decoded.not_supported.push_back(std::move(one));
  out.decoded.used_descriptions.merge(decoded.used_descriptions);
  out.decoded.refused_descriptions.merge(decoded.refused_descriptions);
  if (out.decoded.written.ok()) out.decoded.written = decoded.written;
  if (out.decoded.trouble.ok()) out.decoded.trouble = decoded.trouble;
}

/// Learns the scanners among the packets of one topic. Nothing: there is none, and `out.unused` says why.
std::optional<KnownCapture> learn_packets(const DecodeOptions& options, const rosbag::TopicCount& topic,
                                          DecodedBag& out) {
  DecodeOptions one = options;
  one.capture = topic.file;
  auto known = KnownCapture::learn(one);
  if (known.ok() && known->has_devices()) return std::move(*known);
  out.unused[topic.topic.name] = known.ok() ? known->why_none_of_topic() : known.error().message;
  if (known.ok() && known->has_unknown_scanner())
    out.decoded.not_supported.push_back(topic.topic.name + ": " + known->why_none_of_topic());
  return {};
}

/// Writes the clouds of the packets of one topic.
void add_packets(DecodedBag& out, KnownCapture& known, const std::filesystem::path& cloud,
                 const rosbag::TopicCount& topic) {
  auto decoded = known.write(cloud);
  if (!decoded.ok()) {
    out.unused[topic.topic.name] = decoded.error().message;
    return;
  }
  const std::string folder = topic.file.parent_path().string() + "/";
  for (DecodedScanner& scanner : decoded->scanners) {
    scanner.address = topic.topic.name;
    // The folder passes; what is in it came from the recording.
    if (const auto at = scanner.note.find(folder); at != std::string::npos)
      scanner.note.replace(at, folder.size(), "the recording's ");
  }
  for (std::string& one : decoded->not_supported) one = topic.topic.name + ": " + one;
  add(out, std::move(*decoded));
}

bool has_packets(const rosbag::TopicCount& one) { return one.file.extension() == ".pcap"; }
bool has_clouds(const rosbag::TopicCount& one) {
  return one.topic.trouble.empty() && drivers::carries_cloud(one.topic.type);
}

}  // namespace

Result<DecodedBag> decode_bag(const DecodeOptions& options) {
  auto folder = PassingFolder::make(options.out);
  if (!folder.ok()) return folder.error();
  auto files = rosbag::write_scanner_files(options.capture, folder->path());
  if (!files.ok()) return files.error();
  DecodedBag out;
  out.read = std::move(*files);
  std::map<std::string, KnownCapture> packets;
  std::size_t scanners = 0;
  for (const rosbag::TopicCount& topic : out.read.topics) {
    scanners += has_clouds(topic) ? 1 : 0;
    if (topic.topic.trouble.empty() && drivers::carries_unknown_datagrams(topic.topic.type)) {
      out.unused[topic.topic.name] = "packets of a scanner that is not supported";
      out.decoded.not_supported.push_back(
          fmt::format("{}: the scanner of {}", topic.topic.name, printable(topic.topic.type)));
    }
    if (!has_packets(topic)) continue;
    if (auto known = learn_packets(options, topic, out)) {
      scanners += known->scanners();
      packets.emplace(topic.topic.name, std::move(*known));
    }
  }
  const auto file_of = [&](const rosbag::TopicCount& topic) {
    if (scanners <= 1) return options.out;
    return std::filesystem::path(options.out)
        .replace_filename(options.out.stem().string() + "-" + topic.name + options.out.extension().string());
  };
  std::map<std::string, std::filesystem::path> clouds;
  for (const rosbag::TopicCount& topic : out.read.topics) {
    if (has_clouds(topic)) clouds[topic.topic.name] = file_of(topic);
    if (const auto known = packets.find(topic.topic.name); known != packets.end())
      add_packets(out, known->second, file_of(topic), topic);
  }
  if (!clouds.empty()) {
    auto decoded = decode_clouds(options, clouds, out.unused);
    if (!decoded.ok()) return decoded.error();
    add(out, std::move(*decoded));
  }
  return out;
}

std::string topic_table(const std::vector<rosbag::TopicCount>& topics, const std::map<std::string, std::string>& used) {
  const auto type_of = [](const rosbag::TopicCount& one) {
    return printable(one.topic.written_type.empty() ? one.topic.type : one.topic.written_type);
  };
  std::size_t wide = 5, wide_type = 4;
  for (const rosbag::TopicCount& one : topics) {
    wide = std::max(wide, printable(one.topic.name).size());
    wide_type = std::max(wide_type, type_of(one).size());
  }
  std::string out = fmt::format("{:<{}}  {:<{}}  {:>9}  {}\n", "topic", wide, "type", wide_type, "messages", "became");
  for (const rosbag::TopicCount& one : topics) {
    const auto found = used.find(one.topic.name);
    std::string became = found != used.end() ? found->second : "not used";
    if (!one.topic.trouble.empty()) became = "not used: " + one.topic.trouble;
    if (one.broken > 0) became += fmt::format("; {} messages are broken", one.broken);
    if (one.refused > 0) became += fmt::format("; {} packets are larger than a datagram", one.refused);
    out += fmt::format("{:<{}}  {:<{}}  {:>9}  {}\n", printable(one.topic.name), wide, type_of(one), wide_type,
                       one.messages, printable(became));
  }
  return out;
}

}  // namespace hueline::apps
