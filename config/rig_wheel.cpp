#include "config/rig_wheel.hpp"

#include "config/rig_transport.hpp"
#include "drivers/can/dbc.hpp"

namespace hueline::config {
namespace {

/// Where the bits lie and what they mean: a DBC file's own line, or key by key.
drivers::CanSignal read_signal(Section& section) {
  drivers::CanSignal out;
  if (section.has("dbc")) {
    const Result<drivers::DbcSignal> parsed = drivers::parse_dbc_signal(section.text("dbc"));
    if (!parsed.ok()) section.refuse("dbc", parsed.error().message);
    if (parsed->is_multiplexed) section.refuse("dbc", "a multiplexed signal is not in every frame of its message: not read");
    return parsed->signal;
  }
  out.start_bit = static_cast<int>(section.integer("start_bit", {0, 511}));
  out.bits = static_cast<int>(section.integer("bits", {1, 64}));
  out.order = section.choice<drivers::BitOrder>("byte_order", {{"little", drivers::BitOrder::Little}, {"big", drivers::BitOrder::Big}}, out.order);
  out.is_signed = section.boolean("signed", out.is_signed);
  out.scale = section.number("scale", {-1e9, 1e9}, out.scale);
  out.offset = section.number("offset", {-1e9, 1e9}, out.offset);
  out.min = section.number("min", {-1e15, 1e15}, out.min);
  out.max = section.number("max", {-1e15, 1e15}, out.max);
  if (const std::string wrong = out.validate(); !wrong.empty()) section.refuse("start_bit", wrong);
  return out;
}

drivers::CanSignal read_speed(Section& section) {
  const double metres_per_second = section.choice<double>("unit", {{"m/s", 1.0}, {"km/h", 1 / 3.6}, {"mph", 0.44704}});
  drivers::CanSignal out = read_signal(section);
  for (double* value : {&out.scale, &out.offset, &out.min, &out.max}) *value *= metres_per_second;
  section.finish();
  return out;
}

drivers::WheelDecoder::Pulses read_pulses(Section& section) {
  drivers::WheelDecoder::Pulses out;
  out.metres_per_pulse = section.number("metres_per_pulse", {1e-6, 10});
  out.signal = read_signal(section);
  section.finish();
  return out;
}

drivers::WheelDecoder::Message read_message(Section& section) {
  drivers::WheelDecoder::Message out;
  out.is_extended = section.boolean("extended", out.is_extended);
  out.id = static_cast<std::uint32_t>(section.integer("id", {0, 0x1FFFFFFF}));
  for (Section& one : section.list_or_empty("speeds")) out.speeds.push_back(read_speed(one));
  for (Section& one : section.list_or_empty("pulses")) out.pulses.push_back(read_pulses(one));
  if (section.has("counter")) {
    Section counter = section.section("counter");
    out.counter = read_signal(counter);
    counter.finish();
  }
  if (section.has("checksum")) {
    Section checksum = section.section("checksum");
    drivers::WheelDecoder::Checksum expected;
    expected.kind = checksum.choice<drivers::CanChecksum>(
        "kind", {{"xor", drivers::CanChecksum::Xor}, {"crc8_j1850", drivers::CanChecksum::Crc8J1850}, {"crc8_h2f", drivers::CanChecksum::Crc8H2f}});
    expected.byte = static_cast<std::size_t>(checksum.integer("byte", {0, 63}));
    out.checksum = expected;
    checksum.finish();
  }
  section.finish();
  return out;
}

}  // namespace

WheelSensor read_wheel(Section& section) {
  WheelSensor out;
  const std::string from = section.one_of({"can", "cannelloni", "can_log"});
  if (from == "can_log") {
    Section inside = section.section("can_log");
    drivers::CanLogSource::Config log;
    log.path = inside.text("file");
    log.channel = static_cast<int>(inside.integer("channel", {0, 255}, log.channel));
    inside.finish();
    out.source = log;
  } else if (from == "cannelloni") {
    out.source = read_udp(section.section("cannelloni"));
  } else {
    Section inside = section.section("can");
    drivers::CanSource::Config can;
    can.interface = inside.text("interface");
    can.receive_buffer_bytes = static_cast<int>(inside.integer("receive_buffer_bytes", {4096, 1 << 30}, can.receive_buffer_bytes));
    if (const std::string wrong = can.validate(); !wrong.empty()) inside.refuse("interface", wrong);
    inside.finish();
    out.source = can;
  }
  auto& decoder = out.decoder;
  for (Section& one : section.list("messages")) decoder.messages.push_back(read_message(one));
  decoder.sigma_speed = section.number("sigma_speed", {1e-4, 10}, decoder.sigma_speed);
  decoder.max_speed = section.number("max_speed", {0.1, 200}, decoder.max_speed);
  decoder.max_acceleration = section.number("max_acceleration", {0.1, 1000}, decoder.max_acceleration);
  if (const std::string wrong = decoder.validate(); !wrong.empty()) section.refuse("messages", wrong);
  return out;
}

}  // namespace hueline::config
