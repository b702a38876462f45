#pragma once

#include <string>
#include <vector>

#include "core/keys.hpp"
#include "core/result.hpp"

namespace hueline::drivers {

/// What to ask a NovAtel receiver for. Rates in Hz; 0: not asked for.
struct NovatelLogs {
  struct Config {
    bool unlog_first = true;          ///< UNLOGALL THISPORT: nothing left over from the last user
    double ins_rate_hz = 200;         ///< INSPVASB: the trajectory
    double ins_extended_rate_hz = 1;  ///< INSPVAXB: with sigma; large, so not at the high rate
    double ins_stdev_rate_hz = 1;     ///< INSSTDEVB
    double time_rate_hz = 1;          ///< TIMEB: labels the PPS edges
    double position_rate_hz = 1;      ///< BESTPOSB
    std::vector<int> mark_inputs{1};  ///< MARKxTIMEB ONNEW for each of 1..4
    bool raw_imu = false;             ///< RAWIMUSXB ONNEW
    /// Sent before the LOG commands as they are: EVENTINCONTROL, SETINSTRANSLATION ...
    std::vector<std::string> commands;
    void visit(Keys& keys);
    KeyError validate() const;
  };
};

/// The start-up dialogue, a command a line, CR LF behind each. The receiver answers each with `<OK` or `<ERROR`, which
/// NovatelDecoder reads. Error Invalid if the Config is not valid.
Result<std::string> novatel_dialogue(const NovatelLogs::Config& config);

}  // namespace hueline::drivers
