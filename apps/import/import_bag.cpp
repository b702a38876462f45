#include "apps/import/import_bag.hpp"

#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <system_error>
#include <utility>

#include "apps/import/bag_survey.hpp"
#include "apps/import/import_rig.hpp"
#include "apps/import/map_world.hpp"
#include "apps/import/pose_choice.hpp"
#include "apps/import/transcriber.hpp"
#include "apps/inspect/capture_devices.hpp"
#include "config/rig.hpp"
#include "config/section.hpp"
#include "core/calendar.hpp"
#include "core/output_file.hpp"
#include "drivers/ros/ros_datagrams.hpp"
#include "drivers/transport/pcap_source.hpp"
#include "rosbag/ordered_bag.hpp"
#include "rosbag/packed_file.hpp"
#include "runtime/recording.hpp"
#include "storage/journal_writer.hpp"

namespace hueline::apps {
namespace {

namespace fs = std::filesystem;

/// Scanners are recognised by so many of their packets.
constexpr std::uint64_t kProbePackets = 4000;
/// Messages that are farther out of the order of the recorder's times are sorted first: poses wait no longer for each
/// other (RosPoseJoiner), nor packets (OrderedJournal).
constexpr nanoseconds kMostDisorder = std::chrono::seconds(1);

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

/// Returns the packet with which the source of an Ouster begins: its metadata. Errors: those of the source.
Result<Buffer> description_of(const fs::path& pcap, const std::string& metadata) {
  const auto rig = config::parse_rig(
      fmt::format(
          "rig: probe\nsensors:\n  - name: probe\n    driver: ouster\n    pcap: {{file: '{}'}}\n    metadata: '{}'\n"
          "    T_body_scanner: {{position_m: [0, 0, 0], quaternion_wxyz: [1, 0, 0, 0]}}\ncolouring: {{method: lens}}\n",
          pcap.string(), metadata),
      "probe");
  const BufferPool pool(std::size_t{1} << 26);
  const auto source = rig.sensors[0].device->make_source(pool);
  if (Status opened = source->open(); !opened.ok()) return opened.error();
  const auto first = source->next({});
  if (!first.ok()) return first.error();
  return first->bytes;
}

/// Returns GPS time minus header.stamp as Unix time, at the first message of the recording, by the clock of the poses.
Result<std::chrono::seconds> offset_of(const fs::path& path, const PoseChoice& pose) {
  auto bag = rosbag::open_bag(path);
  if (!bag.ok()) return bag.error();
  const auto first = (*bag)->next();
  UnixTime at = first.ok() ? first->received : UnixTime(std::chrono::seconds(1'700'000'000));
  at -= pose.recorder_ahead();
  if (pose.is_other_pace && pose.begin > to_unix(GpsTime())) at = pose.begin;
  if (pose.shift != nanoseconds(0)) at = kSimulatorBegin;  // the recorder's clock may be another one
  const nanoseconds offset = from_unix(at).time_since_epoch() - at.time_since_epoch() + pose.shift;
  return std::chrono::duration_cast<std::chrono::seconds>(offset);
}

/// Adds the scanners whose packets are in `files`, and copies the metadata of Ousters to `folder`. Errors: Io,
/// and those of metadata that cannot be read.
Status add_scanners(const rosbag::ScannerFiles& files, const fs::path& folder, ImportRig& sensors, ImportedBag& out) {
  for (const auto& topic : files.topics) {
    if (topic.file.extension() != ".json") continue;
    std::error_code error;
    fs::copy_file(topic.file, folder / topic.file.filename(), fs::copy_options::overwrite_existing, error);
    if (error) return output_error("cannot write " + (folder / topic.file.filename()).string(), error.value());
    out.became[topic.topic.name] = topic.file.filename().string();
  }
  for (const auto& topic : files.topics) {
    if (drivers::carries_unknown_datagrams(topic.topic.type))
      out.became[topic.topic.name] = "not used: packets of a scanner that is not supported";
    if (topic.file.extension() != ".pcap") continue;
    const auto devices = recognise(topic.file);
    if (!devices.ok()) return devices.error();
    if ((*devices)->devices().empty()) {
      out.became[topic.topic.name] = "not used: " + (*devices)->why_undecoded(topic.packets);
      continue;
    }
    const CaptureDevice& device = (*devices)->devices().front();
    std::string metadata;
    for (const auto& other : files.topics)
      if (std::string(device.type->word) == "ouster" && other.file.extension() == ".json" &&
          device.note.find(other.file.filename().string()) != std::string::npos)
        metadata = (folder / other.file.filename()).string();
    auto description = metadata.empty() ? Result<Buffer>(Buffer()) : description_of(topic.file, metadata);
    if (!description.ok()) return description.error();
    sensors.add_scanner(topic, device, metadata, std::move(*description));
  }
  return {};
}

/// Says what is wrong with orientations if the vehicle does not drive to where it looks. Empty: nothing shows it.
std::string doubt_of_course(const drivers::RosCourse& course, const PoseChoice& pose, const FrameTree& tree) {
  constexpr double kDegree = std::numbers::pi / 180, kLeastWay_m = 20, kSteady = 0.8, kMirrored = 0.9, kMostTurn = 20;
  if (course.way_m() < kLeastWay_m) return {};
  // The pose may be that of a sensor that is mounted turned.
  const auto T_pose_base = tree.place("base_link", pose.frame);
  const Eigen::Vector2d forward =
      T_pose_base ? Eigen::Vector2d(T_pose_base->linear().col(0).head<2>()) : Eigen::Vector2d::UnitX();
  const double mounted = std::atan2(forward.y(), forward.x());
  const Eigen::Vector2d turned = Eigen::Rotation2Dd(mounted) * course.turned();
  std::string what;
  if (const double turn = std::atan2(turned.y(), turned.x()) / kDegree;
      turned.norm() >= kSteady && std::abs(turn) > kMostTurn)
    what = fmt::format("it looks {:.0f} deg to the {} of the way that it drives", std::abs(turn),
                       turn > 0 ? "left" : "right");
  else if (turned.norm() < kSteady && course.mirrored().norm() >= kMirrored)
    what = "it turns to the right where its way turns to the left, as by orientations in NED";
  if (what.empty()) return {};
  return fmt::format(
      "by the orientations of {} the vehicle does not look to where it drives: over {:.0f} m {}. If it drives forward, "
      "they are not those of REP 103 (east, north, up), or their sensor does not know north, and all points will be "
      "turned: take another topic with --poses",
      fmt::join(pose.topics, " and "), course.way_m(), what);
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
  std::optional<MapWorld> map;
  drivers::RosWorld world;
  if (!options.map.empty()) {
    auto made = MapWorld::create(options.map, options.origin);
    if (!made.ok()) return made.error();
    map.emplace(std::move(*made));
    world = map->world();
  } else if (options.origin) {
    world = drivers::world_about(*options.origin);
  }
  auto folder = OutputFolder::open(options.out);
  if (!folder.ok()) return folder.error();
  const Remove probe{options.out / "probe"};
  std::error_code error;
  fs::create_directory(probe.folder, error);
  if (error) return output_error("cannot make " + probe.folder.string(), error.value());
  const auto recording = rosbag::unpacked_recording(options.bag, probe.folder / "unpacked");
  if (!recording.ok()) return recording.error();
  auto files = rosbag::write_scanner_files(*recording, probe.folder, kProbePackets);
  if (!files.ok()) return files.error();
  const auto survey = survey_bag(*recording, world.metres);
  if (!survey.ok()) return survey.error();

  auto pose = choose_pose(survey->poses, static_cast<bool>(world.place), options.poses);
  if (!pose.ok()) return pose.error();
  const bool is_of_map = map && pose->rank == drivers::RosPoseRank::Local;
  if (is_of_map) {
    pose->farthest_m = 0;  // a map is curved as the earth is
    if (pose->first_place) map->place(*pose->first_place);
    if (!map->status().ok()) return map->status().error();
  }
  const auto offset = offset_of(*recording, *pose);
  if (!offset.ok()) return offset.error();

  ImportedBag out;
  ImportRig sensors(*survey, *pose);
  sensors.add_pose();
  if (Status done = add_scanners(*files, options.out, sensors, out); !done.ok()) return done.error();
  for (const std::string& topic : options.clouds)
    if (!survey->clouds.contains(topic))
      return Error{ErrorCode::Invalid,
                   fmt::format("--clouds {}: the recording has no point clouds of that topic", topic)};
  sensors.add_clouds(options.clouds);
  if (Status done = sensors.add_cameras(options.images, *offset); !done.ok()) return done.error();
  for (const auto& one : files->topics) {
    if (!drivers::carries_transforms(one.topic.type)) continue;
    std::string& became = out.became[one.topic.name];
    became = sensors.mounted() > 0 ? "the tree of frames: mountings of the rig"
                                   : "not used: its frames join no sensor to the vehicle";
    const auto its_pose = sensors.became().find(one.topic.name);
    if (its_pose == sensors.became().end()) continue;
    if (its_pose->second.starts_with("not used"))
      became += "; its pose is " + its_pose->second;
    else
      became = its_pose->second + (sensors.mounted() > 0 ? "; mountings of the rig" : "");
  }
  out.became.insert(sensors.became().begin(), sensors.became().end());
  for (const std::string& topic : pose->topics)
    if (is_of_map) out.became[topic] += fmt::format(", coordinates of {}", options.map);
  out.topics = std::move(files->topics);
  if (sensors.sensors().empty()) {
    // The table of topics says why: without it nobody knows what would help.
    out.damages = files->damages;
    out.first_damage = files->first_damage;
    out.end = files->end;
    out.made = Error{ErrorCode::Unsupported, options.bag + ": no topic of it can be used; the table says why"};
    return out;
  }

  out.to_do = sensors.to_do();
  config::Rig rig;
  try {
    rig = config::parse_rig(sensors.text(), (options.out / "rig.yaml").string());
  } catch (const config::ConfigError& e) {
    out.made = Error{ErrorCode::Unsupported, fmt::format("what the recording says makes no rig: {}", e.what())};
    return out;
  }
  storage::JournalHeader header = runtime::journal_header(rig);
  header.about[kImportedFrom] = fs::path(options.bag).filename().string();
  auto writer =
      storage::JournalWriter::create(options.out / "drive.mcap", header, storage::JournalWriter::Config::of_copy());
  if (!writer.ok()) return writer.error();
  OrderedJournal journal(std::move(*writer));
  Transcriber transcriber(sensors.sensors(), *pose, std::move(world), journal);
  auto bag = rosbag::open_bag(*recording);
  if (!bag.ok()) return bag.error();
  if (survey->disorder > kMostDisorder || pose->is_other_pace) {
    const auto time_of = [&](const rosbag::BagTopic& topic, const rosbag::BagMessage& message) {
      if (!is_imported(topic)) return std::optional<UnixTime>();
      const auto stamp = pose->is_other_pace ? stamp_of(topic, message) : std::nullopt;
      return std::optional(stamp.value_or(message.received));
    };
    auto ordered = rosbag::in_order(**bag, probe.folder / "messages", time_of);
    if (!ordered.ok()) return ordered.error();
    bag = std::move(ordered);
  }
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
  if (Status done = transcriber.finish(); !done.ok()) return done.error();
  if (Status closed = journal.close(); !closed.ok()) return closed.error();
  if (Status done = write_output(options.out / "rig.yaml", rig.text); !done.ok()) return done.error();
  out.packets = journal.packets();
  if (is_of_map && !map->status().ok()) out.to_do.push_back(map->status().error().message);
  if (pose->rank != drivers::RosPoseRank::None && transcriber.poses() == 0)
    out.to_do.push_back("no pose could be made of the recording, " +
                        (pose->apart.empty() ? "see the table" : pose->apart) + ": a replay places no points");
  if (std::string doubt = doubt_of_course(transcriber.course(), *pose, survey->tree); !doubt.empty())
    out.to_do.push_back(std::move(doubt));
  for (auto& one : out.topics) {
    const auto unread = transcriber.unread.find(one.topic.name);
    one.broken = unread == transcriber.unread.end() ? 0 : unread->second;
    one.refused = 0;
    if (const std::string dropped = transcriber.dropped_of(one.topic); !dropped.empty())
      out.became[one.topic.name] += dropped;
  }
  return out;
}

}  // namespace hueline::apps
