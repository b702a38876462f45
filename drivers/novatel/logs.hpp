#pragma once

#include <string>
#include <vector>

#include "core/keys.hpp"
#include "core/result.hpp"

namespace hueline::drivers {

/// The logs that a NovAtel receiver is asked for. Rates are in Hz; 0 means that the log is not asked for.
struct NovatelLogs {
  struct Config {
    bool unlog_first = true;          ///< UNLOGALL THISPORT: stops the logs that an earlier user asked for
    double ins_rate_hz = 200;         ///< INSPVASB: the trajectory
    double ins_extended_rate_hz = 1;  ///< INSPVAXB: solution with sigma; large, so not at the high rate
    double ins_stdev_rate_hz = 1;     ///< INSSTDEVB
    double time_rate_hz = 1;          ///< TIMEB: tells which second a PPS edge is
    double position_rate_hz = 1;      ///< BESTPOSB
    std::vector<int> mark_inputs{1};  ///< MARKxTIMEB ONNEW for each of these inputs, 1 to 4
    bool raw_imu = false;             ///< RAWIMUSXB ONNEW
    /// Commands that are sent unchanged before the LOG commands, such as EVENTINCONTROL or SETINSTRANSLATION.
    std::vector<std::string> commands;
    void visit(Keys& keys);
    KeyError validate() const;
  };
};

/// Returns the dialogue for the start: one command a line, each with CR LF. The receiver answers each with `<OK` or
/// `<ERROR`, which NovatelDecoder reads. Error: Invalid if the Config is not valid.
Result<std::string> novatel_dialogue(const NovatelLogs::Config& config);

}  // namespace hueline::drivers
