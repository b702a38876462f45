#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "core/result.hpp"

namespace hueline::apps {

/// What a look into a file found. `trouble` is set when the file could not be read whole (Invalid: it is a wrong
/// configuration); `found` holds what was whole.
struct Inspection {
  std::unique_ptr<nlohmann::ordered_json> found;
  Status trouble;
  bool may_be_scenario = false;  ///< YAML of none of the kinds that this program knows: the simulator's, if any
};

/// Prints it, as JSON or as lines for people, and gives the exit status.
int show(const Inspection& inspection, bool as_json);

/// Tells the format by the file's first bytes (a name decides only between formats without a signature) and reads it
/// whole: our recordings and views (MCAP), clouds (LAS, PCD), captures (pcap, pcapng), NovAtel OEM7 byte streams, logs
/// of CAN buses (ASC, candump), DBC files, rigs, scenarios, sheets and calibrations (YAML). A drive's folder stands for
/// its recording.
Inspection inspect_file(const std::string& path);

// One function a format; `path` exists and has that format's signature.
Inspection inspect_mcap(const std::string& path);
Inspection inspect_capture_file(const std::string& path);
Inspection inspect_novatel(const std::string& path);
Inspection inspect_can_log(const std::string& path);
Inspection inspect_dbc(const std::string& path);
Inspection inspect_las(const std::string& path);
Inspection inspect_pcd(const std::string& path);
Inspection inspect_yaml(const std::string& path);

}  // namespace hueline::apps
