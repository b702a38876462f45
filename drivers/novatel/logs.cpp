#include "drivers/novatel/logs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace hueline::drivers {
namespace {

/// The rates of LOG ... ONTIME above 1 Hz and 1 Hz itself. Allowed periods divide the receiver's fastest epoch evenly,
/// or are whole seconds (OEM7 manual, LOG).
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

void NovatelLogs::Config::visit(Keys& keys) {
  static const TextForm command{"one line of 1 to 200 printable characters",
                                [](const std::string& text) {
                                  return text.size() <= 200 && std::none_of(text.begin(), text.end(), [](char c) {
                                           return c < 0x20 || c > 0x7E;
                                         });
                                },
                                "^[ -~]{1,200}$"};
  keys.flag(
      {"unlog_first", "", "Whether UNLOGALL THISPORT is sent first. It stops the logs that were asked for before."},
      unlog_first);
  keys.texts(
      {"commands", "",
       "Lines that are sent unchanged before the LOG commands, such as SETINSTRANSLATION or EVENTINCONTROL.", "none"},
      commands, command);
  keys.number({"ins_rate_hz", "Hz", "The rate of INSPVASB, the trajectory."}, ins_rate_hz, {0, 200});
  keys.number({"ins_extended_rate_hz", "Hz", "The rate of INSPVAXB, the trajectory with its sigmas."},
              ins_extended_rate_hz, {0, 200});
  keys.number({"ins_stdev_rate_hz", "Hz", "The rate of INSSTDEVB."}, ins_stdev_rate_hz, {0, 200});
  keys.number({"time_rate_hz", "Hz", "The rate of TIMEB, which says which second a pulse was."}, time_rate_hz, {0, 20});
  keys.number({"position_rate_hz", "Hz", "The rate of BESTPOSB."}, position_rate_hz, {0, 100});
  keys.wholes({"mark_inputs", "", "The event inputs whose MARKxTIMEB is asked for, each named once.", "[1]"},
              mark_inputs, {1, 4}, {0, 4});
  keys.flag({"raw_imu", "", "Whether RAWIMUSXB is asked for."}, raw_imu);
}

KeyError NovatelLogs::Config::validate() const {
  if (KeyError wrong = check_keys(*this); !wrong.empty()) return wrong;
  constexpr const char* allowed =
      "0 (not asked for), 1, 2, 4, 5, 10, 20, 50, 100, 125, 200, or one a whole number of seconds";
  const std::pair<const char*, double> rates[] = {{"ins_rate_hz", ins_rate_hz},
                                                  {"ins_extended_rate_hz", ins_extended_rate_hz},
                                                  {"ins_stdev_rate_hz", ins_stdev_rate_hz},
                                                  {"time_rate_hz", time_rate_hz},
                                                  {"position_rate_hz", position_rate_hz}};
  for (const auto& [key, hz] : rates)
    if (!is_rate(hz)) return not_allowed(key, number_text(hz), allowed);
  for (const int input : mark_inputs)
    if (std::count(mark_inputs.begin(), mark_inputs.end(), input) > 1)
      return {"mark_inputs", fmt::format("names {} twice; allowed: 1 to 4, each once", input)};
  return {};
}

Result<std::string> novatel_dialogue(const NovatelLogs::Config& config) {
  if (const std::string wrong = config.validate(); !wrong.empty()) return Error{ErrorCode::Invalid, wrong};
  std::string out;
  if (config.unlog_first) out += "UNLOGALL THISPORT\r\n";
  for (const std::string& command : config.commands) out += command + "\r\n";
  // TIME comes first, because it names the second that is running. INSCONFIG names the IMU, whose scale RAWIMU and
  // CORRIMU need.
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
