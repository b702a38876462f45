#include "drivers/ublox/ublox_logs.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <initializer_list>

namespace hueline::drivers {
namespace {

/// A message that can be asked for: its class and id, and the key of its rate on the port UART1 (CFG-MSGOUT; those of
/// UART2 and USB follow).
struct Output {
  std::uint8_t kind, id;
  std::uint32_t uart1_key;
};
constexpr Output kPvt{0x01, 0x07, 0x20910007}, kTimegps{0x01, 0x20, 0x20910048}, kAtt{0x01, 0x05, 0x20910020},
    kTm2{0x0D, 0x03, 0x20910179}, kRawx{0x02, 0x15, 0x209102A5}, kSfrbx{0x02, 0x13, 0x20910232},
    kEsfMeas{0x10, 0x02, 0x20910278}, kEsfStatus{0x10, 0x10, 0x20910106};
constexpr std::uint32_t kRateKey = 0x30210001;  // CFG-RATE-MEAS, ms

void put(std::string& out, std::uint32_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) out += static_cast<char>(value >> (8 * i) & 0xFF);
}

std::string message(std::uint8_t kind, std::uint8_t id, const std::string& payload) {
  std::string out;
  for (const std::uint8_t byte : {std::uint8_t{0xB5}, std::uint8_t{0x62}, kind, id}) out += static_cast<char>(byte);
  put(out, static_cast<std::uint32_t>(payload.size()), 2);
  out += payload;
  std::uint8_t a = 0, b = 0;
  for (std::size_t i = 2; i < out.size(); ++i) {
    a = static_cast<std::uint8_t>(a + static_cast<std::uint8_t>(out[i]));
    b = static_cast<std::uint8_t>(b + a);
  }
  return out + static_cast<char>(a) + static_cast<char>(b);
}

}  // namespace

void UbloxLogs::visit(Keys& keys) {
  keys.choice({"port", "",
               "The receiver's port that the computer is connected to. `asked` asks in the way of the generations 6 to "
               "9, which needs no port; generation 10 needs the port."},
              port, {{"asked", Port::Asked}, {"uart1", Port::Uart1}, {"uart2", Port::Uart2}, {"usb", Port::Usb}});
  keys.number({"rate_hz", "Hz", "The rate of NAV-PVT."}, rate_hz, {0.1, 50});
  keys.flag({"event_marks", "", "Whether TIM-TM2 is asked for: the edges at EXTINT."}, event_marks);
  keys.flag({"attitude", "", "Whether NAV-ATT and ESF-STATUS are asked for: receivers with inertial sensors."},
            attitude);
  keys.flag({"raw_observations", "", "Whether RXM-RAWX and RXM-SFRBX are asked for, for post-processing."},
            raw_observations);
  keys.flag({"raw_sensors", "", "Whether ESF-MEAS is asked for."}, raw_sensors);
}

std::string UbloxLogs::dialogue() const {
  struct Wanted {
    Output output;
    bool is_wanted;
  };
  const auto all = std::to_array<Wanted>({{kPvt, true},
                                          {kTimegps, true},
                                          {kAtt, attitude},
                                          {kEsfStatus, attitude},
                                          {kTm2, event_marks},
                                          {kRawx, raw_observations},
                                          {kSfrbx, raw_observations},
                                          {kEsfMeas, raw_sensors}});
  const auto period_ms = static_cast<std::uint32_t>(std::lround(1000 / rate_hz));
  std::string out;
  if (port == Port::Asked) {
    std::string rate;
    put(rate, period_ms, 2);
    put(rate, 1, 2);  // one navigation solution for each measurement
    put(rate, 1, 2);  // aligned to GPS time
    out += message(0x06, 0x08, rate);
    for (const Wanted& one : all) {
      std::string payload{static_cast<char>(one.output.kind), static_cast<char>(one.output.id)};
      put(payload, one.is_wanted ? 1 : 0, 1);
      if (one.is_wanted) out += message(0x06, 0x01, payload);
    }
    return out;
  }
  // One request for each value: a receiver refuses a whole request for one value that it does not know.
  const auto set = [&](std::uint32_t key, std::uint32_t value, int bytes) {
    std::string payload;
    put(payload, 0x00000100, 4);  // version 0, in RAM
    put(payload, key, 4);
    put(payload, value, bytes);
    out += message(0x06, 0x8A, payload);
  };
  const std::uint32_t step = port == Port::Uart1 ? 0 : port == Port::Uart2 ? 1 : 2;
  set(kRateKey, period_ms, 2);
  for (const Wanted& one : all)
    if (one.is_wanted) set(one.output.uart1_key + step, 1, 1);
  return out;
}

}  // namespace hueline::drivers
