#include "apps/decode/decode_clouds.hpp"

#include <fmt/format.h>

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "apps/decode/scanner_cloud.hpp"
#include "drivers/ros/ros_cloud_decoder.hpp"
#include "rosbag/bag.hpp"

namespace hueline::apps {
namespace {

using drivers::RosCloudDecoder;

/// The point clouds of one topic.
class CloudTopic {
 public:
  CloudTopic(std::filesystem::path file, const DecodeOptions& options) : file_(std::move(file)), options_(&options) {}

  void take(const rosbag::BagTopic& topic, const rosbag::BagMessage& message) {
    if (!decoder_ && !begin(topic, message)) return;
    Packet packet;
    packet.sensor = 1;
    packet.received = host_time_ns(count_ns(message.received));
    packet.bytes = message.data;
    measured_.clear();
    decoder_->decode(packet, measured_);
    if (!cloud_) open(topic);
    cloud_->take(measured_);
  }
  Status close() { return cloud_ ? cloud_->close() : Status(); }
  const ScannerCloud* cloud() const { return cloud_ ? &*cloud_ : nullptr; }
  /// Returns why there is no cloud.
  std::string why() const { return why_.empty() ? "no message of it has a return" : why_; }
  /// Says how many points are not in the cloud, and why.
  std::string left_out() const {
    const auto& counts = decoder_->counts().messages;
    std::string out;
    if (const auto found = counts.find(RosCloudDecoder::kReturnless); found != counts.end())
      out += fmt::format("; {} points without a return", found->second);
    if (const auto found = counts.find(RosCloudDecoder::kOutOfRange); found != counts.end())
      out += fmt::format("; {} nearer than {:g} m", found->second, RosCloudDecoder::Config().min_range_m);
    return out;
  }

 private:
  /// Finds out how the topic is to be read; not before a message has returns.
  bool begin(const rosbag::BagTopic& topic, const rosbag::BagMessage& message) {
    const auto cloud = drivers::take_cloud(topic.type, {message.data.bytes(), topic.encoding});
    if (!cloud.ok()) {
      why_ = cloud.error().message;
      return false;
    }
    if (!drivers::recognise_times(*cloud, {})) return false;
    const auto config = RosCloudDecoder::suited(topic.type, topic.encoding, *cloud);
    note_ = fmt::format("{}; intensity {:g} is 255; frame {}", in_words(config.times), config.intensity_full,
                        cloud->header.frame);
    decoder_ = std::make_unique<RosCloudDecoder>(config);
    return true;
  }
  void open(const rosbag::BagTopic& topic) {
    DecodedScanner scanner;
    scanner.name = "point cloud of ROS";
    scanner.note = note_;
    scanner.address = topic.name;
    scanner.cloud = file_;
    Learnt learnt;
    learnt.learn(measured_);
    cloud_.emplace(std::move(scanner), CloudClock(std::move(learnt), *options_));
  }

  std::filesystem::path file_;
  const DecodeOptions* options_;
  std::string why_, note_;
  std::unique_ptr<RosCloudDecoder> decoder_;
  std::optional<ScannerCloud> cloud_;
  std::vector<Measurement> measured_;
};

}  // namespace

Result<DecodedCapture> decode_clouds(const DecodeOptions& options,
                                     const std::map<std::string, std::filesystem::path>& files,
                                     std::map<std::string, std::string>& unused) {
  auto bag = rosbag::open_bag(options.capture);
  if (!bag.ok()) return bag.error();
  std::map<std::string, CloudTopic> topics;
  for (const auto& [name, file] : files) topics.try_emplace(name, file, options);
  for (;;) {
    const auto message = (*bag)->next();
    // The caller has read the recording before, and has told its damages.
    if (!message.ok() && message.error().code == ErrorCode::Malformed) continue;
    if (!message.ok()) break;
    const rosbag::BagTopic& topic = (*bag)->topics()[message->topic];
    const auto found = topics.find(topic.name);
    if (found != topics.end() && topic.trouble.empty() && drivers::carries_cloud(topic.type))
      found->second.take(topic, *message);
  }
  DecodedCapture out;
  for (auto& [name, topic] : topics) {
    if (Status closed = topic.close(); !closed.ok() && out.written.ok()) out.written = closed;
    if (!topic.cloud()) {
      unused[name] = topic.why();
      continue;
    }
    out.scanners.push_back(topic.cloud()->scanner());
    out.scanners.back().note += topic.left_out();
  }
  return out;
}

}  // namespace hueline::apps
