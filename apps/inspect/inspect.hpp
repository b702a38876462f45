#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "core/result.hpp"
#include "drivers/device.hpp"

namespace hueline::apps {

/// The result of reading a file. `trouble` is set if the file could not be read whole (Invalid: it is a wrong
/// configuration). `found` holds what was whole.
struct Inspection {
  std::unique_ptr<nlohmann::ordered_json> found;
  Status trouble;
  bool may_be_scenario = false;  ///< YAML of no kind that this program knows; it may be a scenario of the simulator
  bool takes_dbc = false;        ///< a log of a CAN bus, which a DBC file describes
};

/// Prints the result, as JSON or as lines for people, and returns the exit status.
int show(const Inspection& inspection, bool as_json);

/// Recognises the format by the first bytes of the file and reads the whole file. The name decides only between formats
/// without a signature. Formats: recordings and views of this program (MCAP), clouds (LAS, PCD, PLY, E57, PTX, PTS,
/// text), capture files (pcap, pcapng), recordings of ROS, logs of CAN buses (ASC, BLF, TRC, candump), DBC files, YAML
/// of rigs, scenarios, sheets and calibrations, and the files of the devices `types`, as their DeviceType says
/// (drivers/device_files.hpp). The folder of a drive stands for its recording. `dbc_path`: the DBC file that describes
/// a log of a CAN bus, if there is one.
Inspection inspect_file(const std::string& path, drivers::DeviceTypes types = drivers::device_types(),
                        const std::string& dbc_path = {});

// One function for each format. `path` exists and has the signature of that format.
Inspection inspect_mcap(const std::string& path);
/// Lists the devices that one of `types` recognises among the senders.
Inspection inspect_capture_file(const std::string& path, drivers::DeviceTypes types);
/// Counts the messages of a recording of ROS (rosbag/bag.hpp) by topic.
Inspection inspect_bag(const std::string& path);
/// Reads a file of a device's bytes (DeviceFiles::Log) with that device's decoder. A file without one message of the
/// device is in trouble.
Inspection inspect_device_log(const std::string& path, const drivers::DeviceType& type);
/// Says what the signals were, if `dbc_path` names a DBC file.
Inspection inspect_can_log(const std::string& path, const std::string& dbc_path);
Inspection inspect_dbc(const std::string& path);
Inspection inspect_las(const std::string& path);
/// The coordinates are those of the file, to which the poses of its scans lead.
Inspection inspect_e57(const std::string& path);
Inspection inspect_cloud(const std::string& path, const char* format);
/// PTX in the coordinates of the file, PTS and rows of x y z.
Inspection inspect_text_cloud(const std::string& path);
/// The accuracies of a trajectory.
Inspection inspect_smrmsg(const std::string& path);
Inspection inspect_yaml(const std::string& path);

}  // namespace hueline::apps
