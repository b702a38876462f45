#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>

#include "apps/inspect/capture_devices.hpp"
#include "apps/inspect/inspect.hpp"
#include "core/angle.hpp"
#include "core/calendar.hpp"
#include "core/printable.hpp"
#include "drivers/transport/file_source.hpp"
#include "drivers/transport/pcap_source.hpp"
#include "rosbag/bag.hpp"
#include "runtime/pacer.hpp"
#include "runtime/recording.hpp"
#include "storage/mcap_reader.hpp"

/// Formats that are streams of a device's bytes: read with the same decoders as a drive.
namespace hueline::apps {
namespace {

using Json = nlohmann::ordered_json;

/// What came out of a decoder, by kind, with the span of GPS time that the messages name.
struct Tally {
  std::map<std::string, std::uint64_t> measurements;
  std::map<std::string, std::uint64_t> scanner_clock;  // what a scanner said of it, in its own words
  std::map<std::string, std::uint64_t> faults;
  std::string last_fault;
  std::uint64_t returns = 0;
  std::map<std::string, std::uint64_t> fixes;  // by their type
  std::map<int, std::uint64_t> marks;          // by the input
  std::map<std::string, std::uint64_t> solutions;
  std::array<double, 4> extent{};   // least and greatest latitude and longitude of all positions, deg
  std::array<double, 2> heights{};  // least and greatest, m
  bool has_position = false;
  bool has_height = false;
  bool has_time = false;
  GpsTime first{}, last{};

  void position(const Geodetic& place, bool knows_height = true) {
    const std::array<double, 2> values{place.latitude * kDegPerRad, place.longitude * kDegPerRad};
    for (std::size_t i = 0; i < values.size(); ++i) {
      extent[2 * i] = has_position ? std::min(extent[2 * i], values[i]) : values[i];
      extent[2 * i + 1] = has_position ? std::max(extent[2 * i + 1], values[i]) : values[i];
    }
    has_position = true;
    if (!knows_height) return;
    const double height = place.ellipsoidal_height;
    heights = {has_height ? std::min(heights[0], height) : height, has_height ? std::max(heights[1], height) : height};
    has_height = true;
  }
  void time(GpsTime t) {
    if (!has_time) first = last = t;
    has_time = true;
    first = std::min(first, t);
    last = std::max(last, t);
  }
  void take(const std::vector<Measurement>& measured) {
    constexpr std::array names{"pps_edges",     "time_labels",       "timed_arrivals", "laser_status",
                               "ins_solutions", "ins_uncertainties", "gnss_fixes",     "imu_samples",
                               "event_marks",   "laser_batches",     "images",         "wheel_speeds",
                               "faults"};
    static_assert(names.size() == std::variant_size_v<Measurement>);
    for (const auto& m : measured) {
      ++measurements[names[m.index()]];
      if (const auto* solution = std::get_if<InsSolution>(&m)) {
        time(solution->time);
        // One that is not good may have any place, or a height that is not above the ellipsoid.
        if (solution->is_good) position(solution->position);
        ++solutions[solution->is_good ? "good" : "not_good"];
      }
      if (const auto* fix = std::get_if<GnssFix>(&m)) {
        ++fixes[name(fix->type)];
        if (fix->type != FixType::None) {
          time(fix->time);  // without a fix the receiver's date may be that of its last start, or of GPS's first day
          position(fix->position, fix->has_height);
        }
      }
      if (const auto* mark = std::get_if<EventMark>(&m)) {
        time(mark->time);
        ++marks[mark->input];
      }
      if (const auto* batch = std::get_if<LaserBatch>(&m)) returns += batch->returns.size();
      if (const auto* status = std::get_if<LaserStatus>(&m)) ++scanner_clock[status->words];
      if (const auto* fault = std::get_if<Fault>(&m)) {
        faults[name(fault->kind)] += fault->count;
        last_fault = printable(fault->detail);
      }
    }
  }
  Json json(const DecodeCounts& counts) const {
    Json out;
    if (has_time) {
      out["begin"] = iso_utc(first);
      out["end"] = iso_utc(last);
    }
    out["decoded_bytes"] = counts.decoded_bytes;
    out["ignored_bytes"] = counts.ignored_bytes;
    out["malformed_bytes"] = counts.malformed_bytes;
    out["malformed_messages"] = counts.malformed_messages;
    out["messages"] = counts.messages;
    if (returns) out["laser_returns"] = returns;
    if (has_position) {
      out["latitude_deg"] = {extent[0], extent[1]};
      out["longitude_deg"] = {extent[2], extent[3]};
      if (has_height) out["ellipsoidal_height_m"] = {heights[0], heights[1]};
    }
    if (!fixes.empty()) out["fix_types"] = fixes;
    if (!solutions.empty()) out["ins_solutions"] = solutions;
    for (const auto& [input, count] : marks) out["event_marks_by_input"][std::to_string(input)] = count;
    if (!scanner_clock.empty()) out["scanner_clock"] = scanner_clock;
    out["measurements"] = measurements;
    if (!faults.empty()) {
      out["faults"] = faults;
      out["last_fault"] = last_fault;
    }
    return out;
  }
};

/// Says of a POS whose messages make no navigation solution which messages would.
void tell_without_solution(const drivers::DeviceType& type, const Tally& tally, Json& out) {
  const bool has_messages = !tally.measurements.empty();
  if (type.role != drivers::Role::Pos || !has_messages || !tally.solutions.empty()) return;
  out["no_solution"] = fmt::format(
      "none of the messages is a navigation solution, so a replay places no points; a navigation solution is {}",
      type.solutions);
}

struct Stream {
  std::unique_ptr<Decoder> decoder;
  Tally tally;
  std::uint64_t packets = 0, bytes = 0, shed = 0;
  void take(const Packet& packet) {
    std::vector<Measurement> measured;
    decoder->decode(packet, measured);
    tally.take(measured);
  }
  void finish() {
    std::vector<Measurement> measured;
    decoder->flush(measured);
    tally.take(measured);
  }
};

Inspection inspect_view(const std::string& path) {
  Inspection out;
  auto reader = storage::McapReader::open(path);
  if (!reader.ok()) return {nullptr, reader.error()};
  std::map<std::uint16_t, std::uint64_t> messages, bytes;
  for (;;) {
    auto message = reader->next();
    if (message.ok()) {
      ++messages[message->channel];
      bytes[message->channel] += message->data.size();
      continue;
    }
    if (message.error().code == ErrorCode::EndOfData) break;
    if (out.trouble.ok()) out.trouble = message.error();
    if (message.error().code != ErrorCode::Malformed) break;
  }
  out.found = std::make_unique<Json>();
  Json& json = *out.found;
  json["format"] = "MCAP";
  json["profile"] = reader->profile();
  auto& topics = json["topics"] = Json::array();
  for (const auto& [id, channel] : reader->channels()) {
    const auto schema = reader->schemas().find(channel.schema_id);
    topics.push_back({{"topic", channel.topic},
                      {"type", schema == reader->schemas().end() ? std::string() : schema->second.name},
                      {"encoding", channel.message_encoding},
                      {"messages", messages[id]},
                      {"bytes", bytes[id]}});
  }
  return out;
}

}  // namespace

Inspection inspect_mcap(const std::string& path) {
  Result<runtime::Recording> recording = runtime::Recording::open(path);
  // Recorded by another version, its rig is not today's; or no recording of ours. What it holds can still be counted.
  if (!recording.ok()) {
    if (rosbag::is_bag(path)) return inspect_bag(path);
    Inspection view = inspect_view(path);
    const bool is_ours = view.found && view.found->value("profile", "") == storage::kJournalProfile;
    if (is_ours && view.trouble.ok()) view.trouble = recording.error();
    return view;
  }

  std::vector<Stream> streams(recording->rig.sensors.size() + 1);
  for (const auto& sensor : recording->rig.sensors) streams[sensor.id].decoder = sensor.device->make_decoder();
  std::uint64_t packets = 0, gaps = 0, expected = 0;
  runtime::DrivenTime driven(std::chrono::hours(1));
  nanoseconds duration{0};
  Inspection out;
  out.trouble = recording->for_each([&](const Packet& packet) {
    ++packets;
    duration = driven.of(packet);
    if (packet.sequence > expected) gaps += packet.sequence - expected;
    expected = packet.sequence + 1;
    if (packet.sensor >= streams.size()) return true;
    Stream& stream = streams[packet.sensor];
    if (packet.kind == PacketKind::Wire) {  // as in the summary
      ++stream.packets;
      stream.bytes += packet.bytes.size();
    }
    stream.shed += packet.shed;
    if (packet.kind == PacketKind::Fault) {
      if (auto fault = decode_fault(packet.sensor, packet.received, packet.bytes.bytes()); fault.ok())
        stream.tally.take({Measurement(*fault)});
    } else if (packet.kind == PacketKind::Wire && stream.decoder) {
      stream.take(packet);
    }
    return true;
  });
  out.found = std::make_unique<Json>();
  Json& json = *out.found;
  json["format"] = "hueline recording";
  json["about"] = recording->journal->header().about;
  json["packets"] = packets;
  json["duration_s"] = to_seconds(duration);
  json["sequence_gaps"] = gaps;
  if (const auto& segments = recording->journal->segments(); segments.size() > 1) {
    json["segments"] = segments.size();
    if (const auto removed = recording->journal->removed(); removed.segments > 0)
      json["removed_by_ring"] = {
          {"segments", removed.segments}, {"packets", removed.packets}, {"bytes", removed.bytes}};
  }
  auto& sensors = json["sensors"] = Json::array();
  for (std::size_t id = 0; id < streams.size(); ++id) {
    Stream& stream = streams[id];
    Json one = {{"name", recording->journal->header().sensors[id].name}};
    if (id > 0) one["driver"] = recording->rig.sensors[id - 1].driver();
    one.update({{"packets", stream.packets}, {"bytes", stream.bytes}, {"shed", stream.shed}});
    if (stream.decoder) {
      stream.finish();
      one.update(stream.tally.json(stream.decoder->counts()));
      tell_without_solution(*recording->rig.sensors[id - 1].type, stream.tally, one);
    } else if (!stream.tally.faults.empty()) {  // of hueline itself
      one.update({{"faults", stream.tally.faults}, {"last_fault", stream.tally.last_fault}});
    }
    sensors.push_back(one);
  }
  return out;
}

Inspection inspect_capture_file(const std::string& path, drivers::DeviceTypes types) {
  Inspection out;
  drivers::PcapSource source(
      {.path = path, .ports = {}, .source_address = {}, .protocol = drivers::PcapSource::Protocol::All});
  if (Status opened = source.open(); !opened.ok()) return {nullptr, opened.error()};
  std::map<std::size_t, std::uint64_t> sizes;
  CaptureDevices devices(path, types);
  std::map<const CaptureDevice*, Tally> tallies;
  Tally untaken;  // faults of the file itself
  std::uint64_t packets = 0, datagrams = 0, stream_bytes = 0;
  HostTime first{}, last{};
  std::vector<Measurement> measured;
  for (;;) {
    measured.clear();
    Result<Packet> packet = source.next({});
    if (!packet.ok()) {
      if (packet.error().code == ErrorCode::EndOfData) break;
      if (out.trouble.ok()) out.trouble = packet.error();
      continue;
    }
    if (packet->kind == PacketKind::Fault) {
      const auto fault = decode_fault(1, packet->received, packet->bytes.bytes());
      if (!fault.ok()) continue;
      untaken.take({Measurement(*fault)});
      // Several devices are listed below. Frames that could not be delivered are a file that was read in part or not at
      // all.
      const bool is_loss = fault->kind == FaultKind::Malformed || fault->kind == FaultKind::Disconnected;
      if ((is_loss || packets == 0) && out.trouble.ok()) out.trouble = Error{ErrorCode::Malformed, fault->detail};
      if (const CaptureDevice* device = devices.take(*packet, source, measured)) tallies[device].take(measured);
      continue;
    }
    if (!packets++) first = packet->received;
    last = packet->received;
    if (source.flow()) {
      stream_bytes += packet->bytes.size();
    } else {
      ++datagrams;
      ++sizes[packet->bytes.size()];
    }
    if (const CaptureDevice* device = devices.take(*packet, source, measured)) tallies[device].take(measured);
  }
  devices.finish([&](const CaptureDevice& device, std::vector<Measurement>& rest) { tallies[&device].take(rest); });
  out.found = std::make_unique<Json>();
  Json& json = *out.found;
  json["format"] = "pcap";
  json["datagrams"] = datagrams;
  if (stream_bytes > 0) json["tcp_bytes"] = stream_bytes;
  json["duration_s"] = to_seconds(last - first);
  for (const auto& [size, count] : sizes) json["datagrams_by_size"][std::to_string(size)] = count;
  for (const CaptureDevice& device : devices.devices()) {
    Json& one = devices.devices().size() == 1 ? json : json["devices"].emplace_back();
    one["device"] = device.name;
    one["source_address"] = drivers::to_text(device.address);
    if (!device.note.empty()) one["note"] = device.note;
    one["decoded"] = tallies[&device].json(device.decoder->counts());
    tell_without_solution(*device.type, tallies[&device], one["decoded"]);
  }
  if (!untaken.faults.empty()) {
    json["faults"] = untaken.faults;
    json["last_fault"] = untaken.last_fault;
  }
  if (devices.devices().empty() && out.trouble.ok())
    out.trouble = Error{ErrorCode::Unsupported, path + ": " + devices.why_undecoded(packets)};
  return out;
}

Inspection inspect_device_log(const std::string& path, const drivers::DeviceType& type) {
  Inspection out;
  drivers::FileSource::Config config;
  config.path = path;
  drivers::FileSource source(config);
  if (Status opened = source.open(); !opened.ok()) return {nullptr, opened.error()};
  Stream stream;
  stream.decoder = type.make()->make_decoder();
  std::uint64_t bytes = 0;
  for (;;) {
    Result<Packet> packet = source.next({});
    if (!packet.ok()) {
      if (packet.error().code != ErrorCode::EndOfData) out.trouble = packet.error();
      break;
    }
    bytes += packet->bytes.size();
    stream.take(*packet);
  }
  stream.finish();
  out.found = std::make_unique<Json>();
  Json& json = *out.found;
  json["format"] = type.files.log.format;
  json["bytes"] = bytes;
  json.update(stream.tally.json(stream.decoder->counts()));
  tell_without_solution(type, stream.tally, json);
  const DecodeCounts& counts = stream.decoder->counts();
  json["bytes_unaccounted"] =
      static_cast<std::int64_t>(bytes) -
      static_cast<std::int64_t>(counts.decoded_bytes + counts.ignored_bytes + counts.malformed_bytes);
  const bool has_message = std::ranges::any_of(counts.messages, [](const auto& one) { return one.first != "text"; });
  if (!has_message && out.trouble.ok())
    out.trouble = Error{ErrorCode::Malformed, fmt::format("{}: none of its {} bytes belong to a message of {}", path,
                                                          bytes, type.files.log.format)};
  return out;
}

}  // namespace hueline::apps
