#include <fmt/format.h>

#include <map>

#include "apps/inspect/inspect.hpp"
#include "core/input_file.hpp"
#include "drivers/can/can_errors.hpp"
#include "drivers/can/dbc.hpp"
#include "drivers/transport/can_log_source.hpp"

/// Inspects logs of CAN buses, and DBC files, which describe the messages on a bus.
namespace hueline::apps {
namespace {

using Json = nlohmann::ordered_json;

struct Message {
  std::uint64_t count = 0;
  int shortest = 64, longest = 0;
  HostTime first{}, last{};
};

}  // namespace

Inspection inspect_can_log(const std::string& path) {
  drivers::CanLogSource source({path, 0});
  if (Status opened = source.open(); !opened.ok()) return {nullptr, opened.error()};
  Inspection out;
  std::map<std::string, Message> messages;
  std::map<std::string, std::uint64_t> errors;
  std::map<int, std::uint64_t> channels;
  std::uint64_t frames = 0;
  HostTime first{}, last{};
  for (;;) {
    const Result<Packet> packet = source.next({});
    if (!packet.ok()) {
      if (packet.error().code != ErrorCode::EndOfData) out.trouble = packet.error();
      break;
    }
    if (packet->kind == PacketKind::Fault) {
      if (const auto fault = decode_fault(1, packet->received, packet->bytes.bytes()); fault.ok())
        out.trouble = Error{ErrorCode::Malformed, fault->detail};
      continue;
    }
    drivers::CanPacket parsed;
    if (!drivers::decode_can_packet(packet->bytes.bytes(), parsed).ok()) continue;
    const drivers::CanFrame& frame = parsed.frames.front();
    if (!frames++) first = packet->received;
    last = packet->received;
    ++channels[frame.bus];
    if (frame.is_error) {
      for (const auto& trouble : drivers::explain_can_error(frame)) ++errors[trouble.detail];
      continue;
    }
    Message& message = messages[drivers::name(frame)];
    if (!message.count++) message.first = packet->received;
    message.last = packet->received;
    message.shortest = std::min<int>(message.shortest, frame.length);
    message.longest = std::max<int>(message.longest, frame.length);
  }
  out.found = std::make_unique<Json>();
  Json& json = *out.found;
  json["format"] = "CAN log";
  json["frames"] = frames;
  json["duration_s"] = to_seconds(last - first);
  for (const auto& [channel, count] : channels) json["frames_by_channel"][std::to_string(channel)] = count;
  auto& list = json["messages"] = Json::array();
  for (const auto& [id, message] : messages) {
    Json one = {{"id", id}, {"frames", message.count}, {"bytes", message.longest}};
    if (message.shortest != message.longest) one["bytes_least"] = message.shortest;
    if (message.count > 1)
      one["mean_period_ms"] = 1e3 * to_seconds(message.last - message.first) / static_cast<double>(message.count - 1);
    list.push_back(one);
  }
  if (!errors.empty()) json["errors"] = errors;
  return out;
}

Inspection inspect_dbc(const std::string& path) {
  const auto text = read_input(path, 50'000'000, "a DBC");
  if (!text.ok()) return {nullptr, text.error()};
  const auto parsed = drivers::parse_dbc(*text);
  if (!parsed.ok()) return {nullptr, parsed.error()};
  Inspection out;
  out.found = std::make_unique<Json>();
  Json& json = *out.found;
  json["format"] = "DBC";
  auto& messages = json["messages"] = Json::array();
  for (const drivers::DbcMessage& message : *parsed) {
    Json one = {
        {"name", message.name}, {"id", message.id}, {"extended", message.is_extended}, {"bytes", message.length}};
    for (const drivers::DbcSignal& signal : message.signals) {
      const auto& s = signal.signal;
      one["signals"][signal.name] =
          fmt::format("{}|{}@{}{} ({},{}) [{}|{}] \"{}\"{}", s.start_bit, s.bits,
                      s.order == drivers::BitOrder::Little ? 1 : 0, s.is_signed ? '-' : '+', s.scale, s.offset, s.min,
                      s.max, signal.unit, signal.is_multiplexed ? " multiplexed" : "");
    }
    messages.push_back(one);
  }
  return out;
}

}  // namespace hueline::apps
