#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include "apps/inspect/inspect.hpp"
#include "core/input_file.hpp"
#include "drivers/can/can_errors.hpp"
#include "drivers/can/dbc.hpp"
#include "drivers/transport/can_log_source.hpp"

/// Inspects logs of CAN buses, and DBC files, which describe the messages on a bus.
namespace hueline::apps {
namespace {

using Json = nlohmann::ordered_json;

/// A signal of a message, as a DBC file describes it.
struct Signal {
  const drivers::DbcSignal* described = nullptr;
  std::uint64_t count = 0;
  double least = 0, greatest = 0, last = 0;
  std::map<std::string, std::uint64_t> words;

  void take(const drivers::DbcValue& value) {
    described = value.signal;
    least = count == 0 ? value.value : std::min(least, value.value);
    greatest = count == 0 ? value.value : std::max(greatest, value.value);
    last = value.value;
    ++count;
    if (value.word) ++words[*value.word];
  }
  Json json() const {
    Json out = {{"frames", count}, {"min", least}, {"max", greatest}, {"last", last}};
    if (!described->unit.empty()) out["unit"] = described->unit;
    if (!words.empty()) out["words"] = words;
    return out;
  }
};

struct Message {
  std::uint64_t count = 0;
  int shortest = 64, longest = 0;
  HostTime first{}, last{};
  std::string name;
  std::map<std::string, Signal> signals;
};

Result<drivers::Dbc> load_dbc(const std::string& path) {
  const auto text = read_input(path, 50'000'000, "a DBC");
  if (!text.ok()) return text.error();
  return drivers::read_dbc(*text);
}

/// Says where a multiplexed signal is: "multiplexed by Selector: 3, 5 .. 7".
std::string selection(const drivers::DbcSignal& signal) {
  std::string out;
  if (signal.is_selector) out += " selector";
  if (!signal.is_multiplexed) return out;
  std::string values;
  for (const auto& [from, to] : signal.selected_by)
    values += (values.empty() ? "" : ", ") + (from == to ? fmt::format("{}", from) : fmt::format("{} .. {}", from, to));
  return out + fmt::format(" multiplexed by {}: {}", signal.selector, values);
}

/// Says what a log has beside frames: "12 objects of Ethernet, 3 of LIN".
std::string in_words(const std::map<std::string, std::uint64_t>& others) {
  std::string out;
  for (const auto& [kind, count] : others)
    out += fmt::format("{}{}{} of {}", out.empty() ? "" : ", ", count,
                       !out.empty() ? ""
                       : count == 1 ? " object"
                                    : " objects",
                       kind);
  return out;
}

}  // namespace

Inspection inspect_can_log(const std::string& path, const std::string& dbc_path) {
  drivers::Dbc dbc;
  if (!dbc_path.empty()) {
    auto loaded = load_dbc(dbc_path);
    if (!loaded.ok()) return {nullptr, loaded.error()};
    dbc = std::move(*loaded);
  }
  drivers::CanLogSource source({path, 0});
  if (Status opened = source.open(); !opened.ok()) return {nullptr, opened.error()};
  Inspection out;
  out.takes_dbc = true;
  std::map<std::pair<std::string, std::string>, Message> messages;  // by channel and id: two buses have their own
  std::map<std::string, std::uint64_t> errors;
  std::map<std::string, std::uint64_t> channels;
  std::uint64_t frames = 0;
  HostTime first{}, last{};
  for (;;) {
    const Result<Packet> packet = source.next({});
    if (!packet.ok()) {
      if (packet.error().code != ErrorCode::EndOfData) out.trouble = packet.error();
      break;
    }
    if (packet->kind == PacketKind::Fault) {
      const auto fault = decode_fault(1, packet->received, packet->bytes.bytes());
      if (fault.ok() && fault->kind == FaultKind::Malformed) out.trouble = Error{ErrorCode::Malformed, fault->detail};
      continue;
    }
    drivers::CanPacket parsed;
    if (!drivers::decode_can_packet(packet->bytes.bytes(), parsed).ok()) continue;
    const drivers::CanFrame& frame = parsed.frames.front();
    if (!frames++) first = packet->received;
    last = packet->received;
    const std::string channel = source.interface().empty() ? std::to_string(frame.bus) : source.interface();
    ++channels[channel];
    if (frame.is_error) {
      for (const auto& trouble : drivers::explain_can_error(frame)) ++errors[trouble.detail];
      continue;
    }
    Message& message = messages[{channel, drivers::name(frame)}];
    if (!message.count++) message.first = packet->received;
    message.last = packet->received;
    message.shortest = std::min<int>(message.shortest, frame.length);
    message.longest = std::max<int>(message.longest, frame.length);
    const drivers::DbcMessage* described = dbc.find(frame.id, frame.is_extended);
    if (!described || frame.is_remote) continue;
    message.name = described->name;
    for (const drivers::DbcValue& value : drivers::decode(*described, frame.bytes()))
      message.signals[value.signal->name].take(value);
  }
  const std::map<std::string, std::uint64_t> others = source.passed_over();
  if (frames == 0 && out.trouble.ok())
    out.trouble = Error{ErrorCode::Malformed, path + (others.empty() ? ": no line of it is a frame of a CAN bus"
                                                                     : ": it has no frame of a CAN bus, but " +
                                                                           in_words(others) + ", which are not read")};
  // A file that only its name makes a log of a bus: what is wrong with its first line is not all.
  if (frames == 0 && !source.first_bad_line().empty())
    out.trouble = Error{ErrorCode::Malformed,
                        fmt::format("{}: no frame of a CAN bus could be read: {}", path, source.first_bad_line())};
  out.found = std::make_unique<Json>();
  Json& json = *out.found;
  json["format"] = "CAN log";
  json["frames"] = frames;
  json["duration_s"] = to_seconds(last - first);
  for (const auto& [channel, count] : channels) json["frames_by_channel"][channel] = count;
  if (!others.empty()) json["objects_passed_over"] = others;
  auto& list = json["messages"] = Json::array();
  for (const auto& [where, message] : messages) {
    const auto& [channel, id] = where;
    Json one = {{"id", id}, {"frames", message.count}, {"bytes", message.longest}};
    if (channels.size() > 1) one["channel"] = channel;
    if (message.shortest != message.longest) one["bytes_least"] = message.shortest;
    if (message.count > 1)
      one["mean_period_ms"] = 1e3 * to_seconds(message.last - message.first) / static_cast<double>(message.count - 1);
    if (!message.name.empty()) one["name"] = message.name;
    for (const auto& [name, signal] : message.signals) one["signals"][name] = signal.json();
    list.push_back(one);
  }
  if (!errors.empty()) json["errors"] = errors;
  return out;
}

Inspection inspect_dbc(const std::string& path) {
  const auto dbc = load_dbc(path);
  if (!dbc.ok()) return {nullptr, dbc.error()};
  Inspection out;
  out.found = std::make_unique<Json>();
  Json& json = *out.found;
  json["format"] = "DBC";
  auto& messages = json["messages"] = Json::array();
  for (const drivers::DbcMessage& message : dbc->messages) {
    Json one = {
        {"name", message.name}, {"id", message.id}, {"extended", message.is_extended}, {"bytes", message.length}};
    for (const drivers::DbcSignal& signal : message.signals) {
      const auto& s = signal.signal;
      const char* number = s.number == drivers::CanNumber::Float    ? " float"
                           : s.number == drivers::CanNumber::Double ? " double"
                                                                    : "";
      std::string text = fmt::format("{}|{}@{}{} ({},{}) [{}|{}] \"{}\"{}{}", s.start_bit, s.bits,
                                     s.order == drivers::BitOrder::Little ? 1 : 0, s.is_signed ? '-' : '+', s.scale,
                                     s.offset, s.min, s.max, signal.unit, number, selection(signal));
      for (const auto& [value, word] : signal.words) text += fmt::format(" {}={}", value, word);
      one["signals"][signal.name] = text;
    }
    messages.push_back(one);
  }
  if (!dbc->troubles.empty())
    out.trouble = Error{
        ErrorCode::Malformed,
        fmt::format("{}: {}{}", path, dbc->troubles.front(),
                    dbc->troubles.size() > 1 ? fmt::format(", and {} more", dbc->troubles.size() - 1) : std::string())};
  return out;
}

}  // namespace hueline::apps
