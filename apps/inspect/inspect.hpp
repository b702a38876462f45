#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "core/result.hpp"

namespace hueline::apps {

/// The result of reading a file. `trouble` is set if the file could not be read whole (Invalid: it is a wrong
/// configuration). `found` holds what was whole.
struct Inspection {
  std::unique_ptr<nlohmann::ordered_json> found;
  Status trouble;
  bool may_be_scenario = false;  ///< YAML of no kind that this program knows; it may be a scenario of the simulator
};

/// Prints the result, as JSON or as lines for people, and returns the exit status.
int show(const Inspection& inspection, bool as_json);

/// Recognises the format by the first bytes of the file and reads the whole file. The name decides only between formats
/// without a signature. Formats: recordings and views of this program (MCAP), clouds (LAS, PCD), capture files (pcap,
/// pcapng), NovAtel OEM7 byte streams, logs of CAN buses (ASC, candump), DBC files, and YAML of rigs, scenarios, sheets
/// and calibrations. The folder of a drive stands for its recording.
Inspection inspect_file(const std::string& path);

// One function for each format. `path` exists and has the signature of that format.
Inspection inspect_mcap(const std::string& path);
Inspection inspect_capture_file(const std::string& path);
Inspection inspect_novatel(const std::string& path);
Inspection inspect_can_log(const std::string& path);
Inspection inspect_dbc(const std::string& path);
Inspection inspect_las(const std::string& path);
Inspection inspect_pcd(const std::string& path);
Inspection inspect_yaml(const std::string& path);

}  // namespace hueline::apps
