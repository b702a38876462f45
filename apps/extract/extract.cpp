#include <fmt/format.h>

#include <memory>
#include <string>
#include <vector>

#include "apps/commands.hpp"
#include "apps/exit_code.hpp"
#include "apps/log.hpp"
#include "runtime/recording.hpp"
#include "storage/file_writer.hpp"

namespace hueline::apps {
namespace {

struct Options {
  std::string recording, sensor, out;
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

int extract(const Options& options) {
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
  auto file = storage::FileWriter::create(options.out, IfExists::Replace);
  if (!file.ok()) {
    log_error(file.error().message);
    return kOutputRefused;
  }
  std::uint64_t packets = 0, bytes = 0;
  Status written;
  const Status read = recording->for_each([&](const Packet& packet) {
    if (packet.sensor != *sensor || packet.kind != PacketKind::Wire) return true;
    written = file->write(packet.bytes.bytes());
    ++packets;
    bytes += packet.bytes.size();
    return written.ok();
  });
  if (written.ok()) written = file->close();
  if (!written.ok()) {
    log_error(written.error().message);
    return kOutputRefused;
  }
  fmt::print("{}: {} bytes of {} packets of {}, as received\n", options.out, bytes, packets, options.sensor);
  if (!read.ok()) {
    log_error("{}: everything that is whole was written", read.error().message);
    return kInputUnreadable;
  }
  return packets == 0 ? kNothingCame : kDone;
}

}  // namespace

void add_extract(Command& all) {
  auto options = std::make_shared<Options>();
  Command command =
      all.command("extract", "write what a device sent as the maker's own file, for the maker's or others' programs");
  command.required("RECORDING", options->recording, "drive.mcap, or a drive's folder").reads(options->recording);
  command.required("--sensor", options->sensor, "the sensor's name in the rig");
  command.required("--out", options->out, "the file to write").writes(options->out);
  command.footer(
      "The file holds the bytes of all packets in their order, nothing added and nothing left out: of a receiver the "
      "log that it would have written itself (UBX, SBF, OEM7, POS groups), with its raw observations for "
      "post-processing. Of a scanner it holds the payloads of the datagrams without their borders.");
  command.runs([options] { return extract(*options); });
}

}  // namespace hueline::apps
