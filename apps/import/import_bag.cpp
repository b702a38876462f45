#include "apps/import/import_bag.hpp"

#include <fmt/format.h>
#include <stdlib.h>

#include <algorithm>
#include <cerrno>
#include <memory>
#include <numbers>
#include <queue>
#include <system_error>
#include <utility>

#include "apps/import/bag_survey.hpp"
#include "apps/inspect/capture_devices.hpp"
#include "config/rig.hpp"
#include "config/section.hpp"
#include "core/calendar.hpp"
#include "core/output_file.hpp"
#include "drivers/ros/ros_datagrams.hpp"
#include "drivers/ros/ros_image.hpp"
#include "drivers/transport/pcap_source.hpp"
#include "runtime/recording.hpp"
#include "storage/journal_writer.hpp"

namespace hueline::apps {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;

/// Scanners are recognised by so many of their packets.
constexpr std::uint64_t kProbePackets = 4000;
/// How long after its exposure an image counts as received: less than the rig's latency_max_ms below.
constexpr nanoseconds kImageLatency = milliseconds(20);
/// One sigma that an image's header.stamp gets: drivers take the time when they had the image, some ms after the
// exposure.
constexpr int kHeaderStampSigma_us = 10'000;

/// A sensor of the rig that is made, and the topic that it is read from.
struct Planned {
  std::string name, topic, yaml;
  enum class Kind : std::uint8_t { Pose, Scanner, Camera } kind{};
  Buffer description;  ///< of an Ouster: the packet of its metadata
};

/// Six numbers as the mounting of a rig file. `T_a_b` maps coordinates of b into a.
std::string mounting(const Eigen::Isometry3d& T_a_b) {
  const Eigen::Quaterniond q(T_a_b.linear());
  const Eigen::Vector3d& t = T_a_b.translation();
  return fmt::format("{{position_m: [{:.6f}, {:.6f}, {:.6f}], quaternion_wxyz: [{:.9f}, {:.9f}, {:.9f}, {:.9f}]}}",
                     t.x(), t.y(), t.z(), q.w(), q.x(), q.y(), q.z());
}
/// A turn about the vertical axis, deg.
Eigen::Isometry3d turn(double degrees) {
  return Eigen::Isometry3d(Eigen::AngleAxisd(degrees * std::numbers::pi / 180, Eigen::Vector3d::UnitZ()));
}
/// From ROS's vehicle axes (x forward, y left, REP 103) to those of Body (x right, y forward).
Eigen::Isometry3d body_from_ros() { return turn(90); }

/// Makes the rig and says what has to be entered by hand.
class Planner {
 public:
  Planner(const BagSurvey& survey, ImportedBag& result) : survey_(survey), result_(result) {}

  void add_pose(const std::vector<rosbag::TopicCount>& topics) {
    if (survey_.pose == drivers::RosPoseRank::None) {
      result_.to_do.push_back("the recording has no pose that can be used: a replay places no points");
      return;
    }
    std::string from;
    for (const auto& one : topics)
      if (drivers::pose_rank(one.topic.type) == survey_.pose) {
        from += (from.empty() ? "" : ", ") + one.topic.name;
        result_.became[one.topic.name] = "sensor pos";
      }
    sensors_.push_back({free_name("pos"), {}, "", Planned::Kind::Pose, {}});
    sensors_.back().yaml =
        fmt::format("  - name: {}  # {}\n    driver: novatel\n    tcp: {{host: 127.0.0.1, port: 3001}}\n",
                    sensors_.back().name, from);
  }

  void add_scanner(const rosbag::TopicCount& topic, const CaptureDevice& device, const std::string& metadata) {
    const std::string word = device.type->word;
    const std::string name = free_name(rosbag::plain_name(topic.topic.name));
    std::string model = device.name.substr(std::min(word.size() + 1, device.name.size()));
    model = model.substr(0, model.find(','));
    std::string yaml = fmt::format("  - name: {}  # {}\n    driver: {}\n    udp: {{ports: [{}]}}\n", name,
                                   topic.topic.name, word, word == "ouster" ? 7502 : 2368);
    yaml += metadata.empty() ? fmt::format("    model: {}\n", model) : fmt::format("    metadata: {}\n", metadata);
    // ROS's driver for Velodyne turns their axes (x right) to x forward; others keep those of their maker.
    const Eigen::Isometry3d axes = word == "velodyne" ? turn(-90) : Eigen::Isometry3d::Identity();
    const auto frame = survey_.frames.find(topic.topic.name);
    const auto place = place_of(frame == survey_.frames.end() ? "" : frame->second);
    if (!place) result_.to_do.push_back(fmt::format("T_body_scanner of {}: the recording does not say it", name));
    yaml += fmt::format("    T_body_scanner: {}{}\n",
                        mounting(place ? body_from_ros() * *place * axes : Eigen::Isometry3d::Identity()),
                        place ? "" : "  # NOT KNOWN");
    sensors_.push_back({name, topic.topic.name, yaml, Planned::Kind::Scanner, {}});
    result_.became[topic.topic.name] = fmt::format("sensor {}: {}", name, device.name);
  }

  void add_camera(const std::string& topic, const BagSurvey::Camera& camera, std::chrono::seconds offset) {
    const std::string name = free_name(rosbag::plain_name(topic));
    sensors_.push_back(
        {name,
         topic,
         fmt::format(
             "  - name: {0}  # {1}\n    driver: v4l2\n    device: /dev/video0\n    width: {2}\n    height: {3}\n"
             "    format: {4}\n    event_input: 0\n    counter_offset_s: {5}  # header.stamp is UTC since 1970\n"
             "    stamp_event: exposure_start\n    stamp_sigma_us: {6}  # NOT KNOWN: how far header.stamp is from "
             "that\n"
             "    latency_min_ms: 0\n    latency_max_ms: 200\n",
             name, topic, camera.width, camera.height, camera.format, offset.count(), kHeaderStampSigma_us),
         Planned::Kind::Camera,
         {}});
    result_.became[topic] = fmt::format("sensor {}: {} x {}, {}", name, camera.width, camera.height, camera.format);
    lenses_ += lens(name, topic, camera);
  }

  std::string rig() const {
    std::string out =
        "# Made of a recording of ROS. Check what is marked as NOT KNOWN, then: hueline replay FOLDER --rig "
        "FOLDER/rig.yaml --out ...\nrig: imported\nsensors:\n";
    for (const Planned& one : sensors_) out += one.yaml;
    if (!lenses_.empty())
      out += fmt::format(
          "head:  # its axes are those of ROS's vehicle frame\n  T_body_head: {}\n  panorama: {{width: 8000, height: "
          "4000, stitching_radius_m: 20}}\n  lenses:\n{}",
          mounting(body_from_ros()), lenses_);
    return out + "colouring: {method: lens}\n";
  }
  std::vector<Planned>& sensors() { return sensors_; }

 private:
  std::string lens(const std::string& name, const std::string& topic, const BagSurvey::Camera& camera) {
    const CameraFacts* facts = survey_.facts_of(topic);
    const bool is_fisheye = facts && (facts->model == "equidistant" || facts->model == "fisheye");
    const bool is_known = facts && (is_fisheye || facts->model == "plumb_bob" || facts->distortion.empty());
    if (!is_known)
      result_.to_do.push_back(
          fmt::format("the lens of {}: {}", name,
                      facts ? "its distortion is of the model \"" + facts->model + "\", which is not read"
                            : std::string("the recording does not say its calibration")));
    CameraFacts used = facts ? *facts : CameraFacts{};
    // A CameraInfo of another size is that of an image that was scaled.
    if (!facts) used.fx = used.fy = camera.width, used.cx = camera.width * 0.5, used.cy = camera.height * 0.5;
    if (!is_known) used.distortion.clear();
    used.distortion.resize(std::min<std::size_t>(used.distortion.size(), is_fisheye ? 4 : 5));
    const auto place = place_of(camera.frame);
    if (!place) result_.to_do.push_back(fmt::format("T_head_lens of {}: the recording does not say it", name));
    // Without a tree: looking forward.
    Eigen::Isometry3d forward = Eigen::Isometry3d::Identity();
    forward.linear() << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    return fmt::format(
        "    - name: {0}\n      camera: {0}\n      offset_px: [0, 0]\n      width: {1}\n      height: {2}\n      "
        "model: {3}{4}\n"
        "      focal_px: [{5:.6f}, {6:.6f}]\n      principal_point_px: [{7:.6f}, {8:.6f}]\n      distortion: [{9}]\n"
        "      T_head_lens: {10}{11}\n",
        name, camera.width, camera.height, is_fisheye ? "kannala_brandt" : "brown", is_known ? "" : "  # NOT KNOWN",
        used.fx, used.fy, used.cx, used.cy, fmt::join(used.distortion, ", "), mounting(place.value_or(forward)),
        place ? "" : "  # NOT KNOWN");
  }

  std::optional<Eigen::Isometry3d> place_of(const std::string& frame) const {
    const std::string base = survey_.tree.has(survey_.pose_frame) ? survey_.pose_frame : "base_link";
    return frame.empty() ? std::nullopt : survey_.tree.place(frame, base);
  }
  std::string free_name(std::string name) const {
    const auto is_taken = [&] { return std::ranges::find(sensors_, name, &Planned::name) != sensors_.end(); };
    while (is_taken() || name == "hueline") name += "_";
    return name;
  }

  const BagSurvey& survey_;
  ImportedBag& result_;
  std::vector<Planned> sensors_;
  std::string lenses_;
};

/// Recognises the scanner whose first packets are in `pcap`; null: none.
Result<std::unique_ptr<CaptureDevices>> recognise(const fs::path& pcap) {
  auto devices = std::make_unique<CaptureDevices>(pcap.string(), drivers::device_types());
  drivers::PcapSource source({.path = pcap.string(), .ports = {}, .source_address = {}});
  if (Status opened = source.open(); !opened.ok()) return opened.error();
  std::vector<Measurement> measured;
  for (auto packet = source.next({}); packet.ok(); packet = source.next({})) {
    measured.clear();
    devices->take(*packet, source, measured);
  }
  return devices;
}

/// Returns the packet with which the source of an Ouster begins: its metadata.
Buffer description_of(const fs::path& pcap, const std::string& metadata) {
  const auto rig = config::parse_rig(
      fmt::format(
          "rig: probe\nsensors:\n  - name: probe\n    driver: ouster\n    pcap: {{file: '{}'}}\n    metadata: '{}'\n"
          "    T_body_scanner: {{position_m: [0, 0, 0], quaternion_wxyz: [1, 0, 0, 0]}}\ncolouring: {{method: lens}}\n",
          pcap.string(), metadata),
      "probe");
  const BufferPool pool(std::size_t{1} << 26);
  const auto source = rig.sensors[0].device->make_source(pool);
  if (!source->open().ok()) return {};
  const auto first = source->next({});
  return first.ok() ? first->bytes : Buffer();
}

/// Writes packets in the order of their times: those of one driver come later than others, because it collects them.
class OrderedJournal {
 public:
  OrderedJournal(storage::JournalWriter writer) : writer_(std::move(writer)) {}

  Status add(SensorId sensor, UnixTime received, Buffer bytes) {
    waiting_bytes_ += bytes.size();
    const HostTime time = host_time_ns(count_ns(received));
    newest_ = std::max(newest_, time);
    waiting_.push({{time, next_++}, {sensor, PacketKind::Wire, false, 0, time, std::move(bytes)}});
    while (!waiting_.empty() && (newest_ - waiting_.top().key.first > kPatience || waiting_bytes_ > kMostBytes))
      if (Status done = write(); !done.ok()) return done;
    return {};
  }
  Status close() {
    while (!waiting_.empty())
      if (Status done = write(); !done.ok()) return done;
    return writer_.close();
  }
  std::uint64_t packets() const { return written_; }

 private:
  static constexpr nanoseconds kPatience = std::chrono::seconds(5);
  static constexpr std::size_t kMostBytes = std::size_t{1} << 30;
  struct Waiting {
    std::pair<HostTime, std::uint64_t> key;
    Packet packet;
    bool operator<(const Waiting& other) const { return key > other.key; }  // the smallest is on top
  };
  Status write() {
    Packet packet = waiting_.top().packet;
    waiting_.pop();
    waiting_bytes_ -= packet.bytes.size();
    packet.sequence = written_++;
    return writer_.append(packet, nanoseconds(0));
  }

  storage::JournalWriter writer_;
  std::priority_queue<Waiting> waiting_;
  std::size_t waiting_bytes_ = 0;
  std::uint64_t next_ = 0, written_ = 0;
  HostTime newest_{};
};

/// Makes packets of messages.
class Transcriber {
 public:
  Transcriber(std::vector<Planned>& sensors, drivers::RosPoseRank rank, std::optional<Geodetic> origin,
              OrderedJournal& journal)
      : rank_(rank), pose_(rank, origin), journal_(journal) {
    for (std::size_t i = 0; i < sensors.size(); ++i) {
      const auto id = static_cast<SensorId>(i + 1);
      if (sensors[i].kind == Planned::Kind::Pose)
        pos_ = id;
      else
        ids_[sensors[i].topic] = id;
      descriptions_[id] = sensors[i].description;
    }
  }

  /// Returns an error of the disk.
  Status take(const rosbag::BagTopic& topic, const rosbag::BagMessage& message) {
    const drivers::RosReader in(message.data.bytes(), topic.encoding);
    if (pos_ != kSystemSensor && drivers::pose_rank(topic.type) == rank_) return take_pose(topic, in, message);
    const auto id = ids_.find(topic.name);
    if (id == ids_.end()) return {};
    if (drivers::carries_image(topic.type)) {
      const auto image = drivers::take_image(topic.type, in, images_[id->second]++);
      if (!image.ok()) return ++unread[topic.name], Status();
      return journal_.add(id->second, image->header.stamp + kImageLatency, image->packet);
    }
    datagrams_.clear();
    if (!drivers::take_datagrams(topic.type, in, datagrams_)) ++unread[topic.name];
    for (const auto& one : datagrams_) {
      const UnixTime received = one.stamp.value_or(message.received);
      if (auto& text = descriptions_[id->second]; !text.empty()) {
        if (Status done = journal_.add(id->second, received, std::exchange(text, {})); !done.ok()) return done;
      }
      if (Status done = journal_.add(id->second, received, Buffer::copy_of(one.bytes)); !done.ok()) return done;
    }
    return {};
  }

  std::map<std::string, std::uint64_t> unread;  ///< messages that could not be used, by topic

 private:
  Status take_pose(const rosbag::BagTopic& topic, const drivers::RosReader& in, const rosbag::BagMessage& message) {
    logs_.clear();
    if (!pose_.take(topic.type, in, message.received, logs_)) ++unread[topic.name];
    for (const auto& one : logs_)
      if (Status done = journal_.add(pos_, one.received, one.bytes); !done.ok()) return done;
    return {};
  }

  drivers::RosPoseRank rank_;
  drivers::RosPose pose_;
  OrderedJournal& journal_;
  SensorId pos_ = kSystemSensor;
  std::map<std::string, SensorId> ids_;
  std::map<SensorId, Buffer> descriptions_;
  std::map<SensorId, std::uint32_t> images_;
  std::vector<drivers::RosDatagram> datagrams_;
  std::vector<drivers::RosPose::Logs> logs_;
};

/// Returns GPS time minus Unix time at the first message of the recording.
Result<std::chrono::seconds> offset_of(const std::string& path) {
  auto bag = rosbag::open_bag(path);
  if (!bag.ok()) return bag.error();
  const auto first = (*bag)->next();
  const UnixTime at = first.ok() ? first->received : UnixTime(std::chrono::seconds(1'700'000'000));
  return std::chrono::duration_cast<std::chrono::seconds>(from_unix(at).time_since_epoch() - at.time_since_epoch());
}

/// Removes the packets by which scanners were recognised, whatever happens.
struct Remove {
  fs::path folder;
  ~Remove() {
    std::error_code ignored;
    fs::remove_all(folder, ignored);
  }
};

}  // namespace

Result<ImportedBag> import_bag(const ImportOptions& options) {
  auto folder = OutputFolder::open(options.out);
  if (!folder.ok()) return folder.error();
  const Remove probe{options.out / "probe"};
  std::error_code error;
  fs::create_directory(probe.folder, error);
  if (error) return output_error("cannot make " + probe.folder.string(), error.value());
  auto files = rosbag::write_scanner_files(options.bag, probe.folder, kProbePackets);
  if (!files.ok()) return files.error();
  const auto survey = survey_bag(options.bag, options.origin.has_value());
  if (!survey.ok()) return survey.error();
  const auto offset = offset_of(options.bag);
  if (!offset.ok()) return offset.error();

  ImportedBag out;
  Planner planner(*survey, out);
  planner.add_pose(files->topics);
  for (const auto& topic : files->topics) {
    if (topic.file.extension() == ".json") {
      fs::copy_file(topic.file, options.out / topic.file.filename(), fs::copy_options::overwrite_existing, error);
      if (error) return output_error("cannot write " + (options.out / topic.file.filename()).string(), error.value());
      out.became[topic.topic.name] = topic.file.filename().string();
    }
    if (topic.file.extension() != ".pcap") continue;
    const auto devices = recognise(topic.file);
    if (!devices.ok()) return devices.error();
    if ((*devices)->devices().empty()) {
      out.became[topic.topic.name] = "not used: " + (*devices)->why_undecoded(topic.packets);
      continue;
    }
    const CaptureDevice& device = (*devices)->devices().front();
    std::string metadata;
    for (const auto& other : files->topics)
      if (std::string(device.type->word) == "ouster" && other.file.extension() == ".json" &&
          device.note.find(other.file.filename().string()) != std::string::npos)
        metadata = (options.out / other.file.filename()).string();
    planner.add_scanner(topic, device, metadata);
    if (!metadata.empty()) planner.sensors().back().description = description_of(topic.file, metadata);
  }
  for (const auto& [topic, camera] : survey->cameras) {
    if (camera.width > 0)
      planner.add_camera(topic, camera, *offset);
    else
      out.became[topic] = "not used: " + camera.why;
  }
  for (const auto& one : files->topics)
    if (one.topic.type == "nav_msgs/Odometry" && !out.became.contains(one.topic.name) && !options.origin)
      out.became[one.topic.name] = "not used: its metres need an origin, see --origin";
  for (const auto& [topic, facts] : survey->facts) out.became[topic] = "the lens of a camera";
  if (planner.sensors().empty())
    return Error{ErrorCode::Unsupported, options.bag + ": no topic of it can be used; hueline decode names them"};

  config::Rig rig;
  try {
    rig = config::parse_rig(planner.rig(), (options.out / "rig.yaml").string());
  } catch (const config::ConfigError& e) {
    return Error{ErrorCode::Unsupported, fmt::format("what the recording says makes no rig: {}", e.what())};
  }
  if (Status done = write_output(options.out / "rig.yaml", rig.text); !done.ok()) return done.error();
  storage::JournalHeader header = runtime::journal_header(rig);
  header.about["imported_from"] = fs::path(options.bag).filename().string();
  storage::JournalWriter::Config config;
  config.if_exists = IfExists::Replace;
  auto writer = storage::JournalWriter::create(options.out / "drive.mcap", header, config);
  if (!writer.ok()) return writer.error();
  OrderedJournal journal(std::move(*writer));
  Transcriber transcriber(planner.sensors(), survey->pose, options.origin, journal);
  auto bag = rosbag::open_bag(options.bag);
  if (!bag.ok()) return bag.error();
  for (;;) {
    const auto message = (*bag)->next();
    if (!message.ok()) {
      if (message.error().code == ErrorCode::Malformed) {
        if (out.damages++ == 0) out.first_damage = message.error().message;
        continue;
      }
      if (message.error().code != ErrorCode::EndOfData) out.end = message.error();
      break;
    }
    const rosbag::BagTopic& topic = (*bag)->topics()[message->topic];
    if (!topic.trouble.empty()) continue;
    if (Status done = transcriber.take(topic, *message); !done.ok()) return done.error();
  }
  if (Status closed = journal.close(); !closed.ok()) return closed.error();
  out.packets = journal.packets();
  out.topics = std::move(files->topics);
  for (auto& one : out.topics) {
    const auto unread = transcriber.unread.find(one.topic.name);
    one.broken = unread == transcriber.unread.end() ? 0 : unread->second;
    one.refused = 0;
  }
  return out;
}

}  // namespace hueline::apps
