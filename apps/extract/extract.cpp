#include <fmt/format.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "apps/commands.hpp"
#include "apps/exit_code.hpp"
#include "apps/extract/arrival_times.hpp"
#include "apps/extract/pgr_file.hpp"
#include "apps/log.hpp"
#include "drivers/ladybug/ladybug_device.hpp"
#include "runtime/recording.hpp"
#include "storage/file_writer.hpp"
#include "storage/pcap_writer.hpp"

namespace hueline::apps {
namespace {

struct ExtractOptions {
  std::string recording, sensor, out;
  int port = 2368;
};

/// Returns the sensor of that name, or says which there are.
Result<SensorId> find_sensor(const runtime::Recording& recording, const std::string& name) {
  std::string known;
  for (const auto& sensor : recording.rig.sensors) {
    if (sensor.name == name) return sensor.id;
    known += (known.empty() ? "" : ", ") + sensor.name;
  }
  return Error{ErrorCode::Invalid, fmt::format("no sensor '{}' in the recording; there are: {}", name, known)};
}

/// What was written, and how reading and writing ended.
struct Extracted {
  std::uint64_t packets = 0, bytes = 0;
  Status read, written;
  std::string how;     ///< of the sentence about it
  std::string remark;  ///< what else is to be known; empty: nothing

  /// Returns whether the output takes the place of an older one: not by what could not be read at all.
  bool is_result() const { return written.ok() && (read.ok() || packets > 0); }
};

Extracted extract_bytes(runtime::Recording& recording, SensorId sensor, const ExtractOptions& options) {
  Extracted out;
  out.how = "as received";
  auto file = storage::FileWriter::replace(options.out);
  if (!file.ok()) {
    out.written = file.error();
    return out;
  }
  out.read = recording.for_each([&](const Packet& packet) {
    if (packet.sensor != sensor || packet.kind != PacketKind::Wire) return true;
    out.written = file->write(packet.bytes.bytes());
    ++out.packets;
    out.bytes += packet.bytes.size();
    return out.written.ok();
  });
  if (out.is_result()) out.written = file->close();
  return out;
}

/// Writes stream files of a Ladybug.
Extracted extract_stream(runtime::Recording& recording, SensorId sensor, PgrFile file) {
  Extracted out;
  out.read = recording.for_each([&](const Packet& packet) {
    if (packet.sensor != sensor || packet.kind != PacketKind::Wire) return true;
    out.written = file.write(packet.bytes.bytes());
    ++out.packets;
    out.bytes += packet.bytes.size();
    return out.written.ok();
  });
  if (out.written.ok()) out.written = file.close();
  if (file.files() > 0 && file.has_following()) {
    const std::string first = file.next();
    const bool is_whole = out.read.ok() && out.written.ok();
    if (is_whole) out.written = file.remove_following();
    out.remark = is_whole ? fmt::format("{} to before {}, of an earlier and longer run, were removed", first,
                                        file.next().filename().string())
                          : fmt::format("{} and those of higher numbers are of an earlier run", first);
  }
  out.how = fmt::format("as {} stream file{} of a Ladybug", file.files(), file.files() == 1 ? "" : "s");
  return out;
}

/// Writes a capture file of the datagrams, with the times of their arrival.
Extracted extract_datagrams(runtime::Recording& recording, SensorId sensor, const ExtractOptions& options) {
  Extracted out;
  auto times = ArrivalTimes::open(recording);
  if (!times.ok()) {
    out.read = times.error();
    return out;
  }
  auto file = storage::PcapWriter::create(options.out);
  if (!file.ok()) {
    out.written = file.error();
    return out;
  }
  bool is_by_clock = true;
  out.read = recording.for_each([&](const Packet& packet) {
    times->take(packet);
    if (packet.sensor != sensor || packet.kind != PacketKind::Wire) return true;
    const auto time = times->of(packet.received);
    is_by_clock = time.has_value();
    out.written = file->write(time.value_or(UnixTime(packet.received.time_since_epoch())),
                              static_cast<std::uint16_t>(options.port), packet.bytes.bytes());
    ++out.packets;
    out.bytes += packet.bytes.size();
    return out.written.ok();
  });
  if (out.is_result()) out.written = file->close();
  out.how = is_by_clock ? "as datagrams with the times of their arrival by the drive's clock (UTC)"
                        : "as datagrams with the arrival times as recorded, because the clock of this drive was never "
                          "known: their distances are right, the day may be any";
  return out;
}

int extract(const ExtractOptions& options) {
  auto recording = runtime::Recording::open(options.recording);
  if (!recording.ok()) {
    log_error(recording.error().message);
    return opening_status(recording.error());
  }
  const Result<SensorId> sensor = find_sensor(*recording, options.sensor);
  if (!sensor.ok()) {
    log_error(sensor.error().message);
    return kWrongUse;
  }
  const bool is_capture = options.out.ends_with(".pcap");
  const drivers::DeviceType& type = *recording->rig.sensors[*sensor - 1u].type;
  if (is_capture && !type.files.capture.listen) {
    log_error("{}: {} sends no datagrams, so a capture file cannot hold it; give --out another ending", options.out,
              options.sensor);
    return kWrongUse;
  }
  if (options.out.ends_with(".pgr") && &type != &drivers::kLadybug) {
    log_error("{}: {} is no Ladybug, and stream files (.pgr) hold the images of one; give --out another ending",
              options.out, options.sensor);
    return kWrongUse;
  }
  const auto extracted = [&]() -> Result<Extracted> {
    if (is_capture) return extract_datagrams(*recording, *sensor, options);
    if (!options.out.ends_with(".pgr")) return extract_bytes(*recording, *sensor, options);
    auto file = PgrFile::create(options.out);
    if (!file.ok()) return file.error();
    return extract_stream(*recording, *sensor, std::move(*file));
  }();
  if (!extracted.ok()) {
    log_error(extracted.error().message);
    return kWrongUse;
  }
  const Extracted& done = *extracted;
  if (!done.remark.empty()) log_warning("{}", done.remark);
  if (!done.written.ok()) {
    log_error(done.written.error().message);
    return kOutputRefused;
  }
  if (!done.is_result()) {
    log_error("{}; nothing of {} could be read, and {} was not written", done.read.error().message, options.sensor,
              options.out);
    return kInputUnreadable;
  }
  fmt::print("{}: {} bytes of {} packets of {}, {}\n", options.out, done.bytes, done.packets, options.sensor, done.how);
  if (!done.read.ok()) {
    log_error("{}: everything that is whole was written", done.read.error().message);
    return kInputUnreadable;
  }
  return done.packets == 0 ? kNothingCame : kDone;
}

}  // namespace

void add_extract(Command& all) {
  auto options = std::make_shared<ExtractOptions>();
  Command command =
      all.command("extract", "write what a device sent as the maker's own file, for the maker's or others' programs");
  command.required("RECORDING", options->recording, "drive.mcap, or a drive's folder").reads(options->recording);
  command.required("--sensor", options->sensor, "the sensor's name in the rig");
  command.required("--out", options->out, "the file to write").writes(options->out);
  command.setting("--port", options->port, "of a .pcap: the UDP port to which the datagrams are addressed",
                  {.least = 1, .most = 65535});
  command.footer(
      "The file holds the bytes of all packets in their order, nothing added and nothing left out: of a receiver the "
      "log that it would have written itself (UBX, SBF, OEM7, POS groups), with its raw observations for "
      "post-processing. Of a scanner it is a capture file if the name of --out ends in .pcap: its datagrams with the "
      "times of their arrival, for the maker's viewer, Wireshark and other decoders; otherwise their payloads without "
      "borders. Of a Ladybug they are its stream files if the name of --out ends in a number and .pgr, as "
      "drive-000000.pgr.\n"
      "Example: hueline extract drives/today --sensor laser --out laser.pcap\n"
      "Exit status: 0; 2 if the recording has no such sensor, or --out is no file of it; 3 if the recording could be "
      "read only in part; 5 if the sensor sent nothing.\n"
      "More: docs/operating.md");
  command.runs([options] { return extract(*options); });
}

}  // namespace hueline::apps
