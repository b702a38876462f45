#include "drivers/novatel/logs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace hueline::drivers {
namespace {

/// Periods that LOG ... ONTIME takes are divisors of the receiver's fastest epoch, then whole seconds (OEM7 manual, LOG).
constexpr std::array kRates{1.0, 2.0, 4.0, 5.0, 10.0, 20.0, 50.0, 100.0, 125.0, 200.0};

bool is_rate(double hz) {
  if (hz == 0) return true;
  if (hz > 0 && hz < 1) return std::abs(1 / hz - std::round(1 / hz)) < 1e-9 && 1 / hz <= 3600;
  return std::find(kRates.begin(), kRates.end(), hz) != kRates.end();
}

void ask(std::string& out, const char* log, double hz) {
  if (hz > 0) out += fmt::format("LOG {} ONTIME {:.4g}\r\n", log, 1 / hz);
}

}  // namespace

std::string NovatelLogs::Config::validate() const {
  constexpr const char* allowed = "0 (not asked for), 1, 2, 4, 5, 10, 20, 50, 100, 125, 200, or one a whole number of seconds";
  const std::pair<const char*, double> rates[] = {{"ins_rate_hz", ins_rate_hz},
                                                  {"ins_extended_rate_hz", ins_extended_rate_hz},
                                                  {"ins_stdev_rate_hz", ins_stdev_rate_hz},
                                                  {"time_rate_hz", time_rate_hz},
                                                  {"position_rate_hz", position_rate_hz}};
  for (const auto& [key, hz] : rates)
    if (!is_rate(hz)) return fmt::format("{} is {}; allowed: {}", key, hz, allowed);
  for (std::size_t i = 0; i < mark_inputs.size(); ++i)
    if (mark_inputs[i] < 1 || mark_inputs[i] > 4 ||
        std::find(mark_inputs.begin(), mark_inputs.begin() + static_cast<std::ptrdiff_t>(i), mark_inputs[i]) !=
            mark_inputs.begin() + static_cast<std::ptrdiff_t>(i))
      return fmt::format("mark_inputs has {}; allowed: 1 .. 4, each once", mark_inputs[i]);
  for (const std::string& command : commands)
    if (command.empty() || command.size() > 200 ||
        std::any_of(command.begin(), command.end(), [](char c) { return c < 0x20 || c > 0x7E; }))
      return fmt::format("commands has '{}'; allowed: one line of 1 .. 200 printable characters each", command);
  return {};
}

Result<std::string> novatel_dialogue(const NovatelLogs::Config& config) {
  if (const std::string wrong = config.validate(); !wrong.empty()) return Error{ErrorCode::Invalid, wrong};
  std::string out;
  if (config.unlog_first) out += "UNLOGALL THISPORT\r\n";
  for (const std::string& command : config.commands) out += command + "\r\n";
  // TIME first: it labels the second that is running. INSCONFIG names the IMU, whose counts RAWIMU and CORRIMU need.
  ask(out, "TIMEB", config.time_rate_hz);
  for (const int input : config.mark_inputs) out += fmt::format("LOG MARK{}TIMEB ONNEW\r\n", input);
  ask(out, "BESTPOSB", config.position_rate_hz);
  ask(out, "INSSTDEVB", config.ins_stdev_rate_hz);
  ask(out, "INSPVAXB", config.ins_extended_rate_hz);
  ask(out, "INSPVASB", config.ins_rate_hz);
  if (config.raw_imu) out += "LOG INSCONFIGB ONCHANGED\r\nLOG RAWIMUSXB ONNEW\r\n";
  return out;
}

}  // namespace hueline::drivers
