#include "apps/decode/decode_bag.hpp"

#include <fmt/format.h>
#include <stdlib.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <system_error>
#include <utility>

#include "core/output_file.hpp"
#include "core/printable.hpp"

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

/// Takes over what one topic gave.
void add(DecodedBag& out, const rosbag::TopicCount& topic, DecodedCapture decoded) {
  for (DecodedScanner& scanner : decoded.scanners) {
    scanner.address = topic.topic.name;
    out.decoded.scanners.push_back(std::move(scanner));
  }
  for (const std::string& one : decoded.not_supported)
    out.decoded.not_supported.push_back(topic.topic.name + ": " + one);
  if (out.decoded.written.ok()) out.decoded.written = decoded.written;
  if (out.decoded.trouble.ok()) out.decoded.trouble = decoded.trouble;
}

}  // namespace

Result<DecodedBag> decode_bag(const DecodeOptions& options) {
  auto folder = PassingFolder::make(options.out);
  if (!folder.ok()) return folder.error();
  auto files = rosbag::write_scanner_files(options.capture, folder->path());
  if (!files.ok()) return files.error();
  DecodedBag out;
  out.read = std::move(*files);
  const auto scanners = std::ranges::count_if(
      out.read.topics, [](const rosbag::TopicCount& one) { return one.file.extension() == ".pcap"; });
  for (const rosbag::TopicCount& topic : out.read.topics) {
    if (topic.file.extension() != ".pcap") continue;
    DecodeOptions one = options;
    one.capture = topic.file;
    if (scanners > 1)
      one.out.replace_filename(options.out.stem().string() + "-" + topic.file.stem().string() +
                               options.out.extension().string());
    auto decoded = decode_capture(one);
    if (decoded.ok()) {
      add(out, topic, std::move(*decoded));
      continue;
    }
    std::string why = decoded.error().message;
    if (why.starts_with(one.capture)) why.erase(0, one.capture.size() + 2);
    out.unused[topic.topic.name] = why;
  }
  return out;
}

std::string topic_table(const std::vector<rosbag::TopicCount>& topics, const std::map<std::string, std::string>& used) {
  std::size_t wide = 5, wide_type = 4;
  for (const rosbag::TopicCount& one : topics) {
    wide = std::max(wide, printable(one.topic.name).size());
    wide_type = std::max(wide_type, printable(one.topic.type).size());
  }
  std::string out = fmt::format("{:<{}}  {:<{}}  {:>9}  {}\n", "topic", wide, "type", wide_type, "messages", "became");
  for (const rosbag::TopicCount& one : topics) {
    const auto found = used.find(one.topic.name);
    std::string became = found != used.end() ? found->second : "not used";
    if (!one.topic.trouble.empty()) became = "not used: " + one.topic.trouble;
    if (one.broken > 0) became += fmt::format("; {} messages are broken", one.broken);
    if (one.refused > 0) became += fmt::format("; {} packets are larger than a datagram", one.refused);
    out += fmt::format("{:<{}}  {:<{}}  {:>9}  {}\n", printable(one.topic.name), wide, printable(one.topic.type),
                       wide_type, one.messages, printable(became));
  }
  return out;
}

}  // namespace hueline::apps
