#pragma once

#include <string>
#include <variant>
#include <vector>

#include "config/section.hpp"
#include "drivers/gige/genicam_config.hpp"
#include "drivers/gige/image_decoder.hpp"
#include "drivers/novatel/decoder.hpp"
#include "drivers/novatel/logs.hpp"
#include "drivers/pps/pps_decoder.hpp"
#include "drivers/pps/pps_source.hpp"
#include "drivers/profile_scanner/profile_scanner_decoder.hpp"
#include "drivers/transport/can_log_source.hpp"
#include "drivers/transport/can_source.hpp"
#include "drivers/transport/file_source.hpp"
#include "drivers/transport/pcap_source.hpp"
#include "drivers/transport/serial_source.hpp"
#include "drivers/transport/tcp_source.hpp"
#include "drivers/transport/udp_source.hpp"
#include "drivers/velodyne/velodyne_decoder.hpp"
#include "drivers/wheel/wheel_decoder.hpp"
#include "fusion/colouring.hpp"
#include "fusion/rig_geometry.hpp"
#include "sync/synchroniser.hpp"

/// A rig file: which sensors a vehicle has, how they are reached, where they sit, and what is made of them. docs/rig.md lists the keys.
namespace hueline::config {

struct VelodyneSensor {
  std::variant<drivers::UdpSource::Config, drivers::PcapSource::Config> source;
  drivers::VelodyneDecoder::Config decoder;
};
struct ProfileScannerSensor {
  std::variant<drivers::UdpSource::Config, drivers::PcapSource::Config> source;
  drivers::ProfileScannerDecoder::Config decoder;
};
struct NovatelSensor {
  std::variant<drivers::TcpSource::Config, drivers::SerialSource::Config, drivers::FileSource::Config> source;
  drivers::NovatelDecoder::Config decoder;
};
struct CameraSensor {
  drivers::GenicamConfig source;
  drivers::ImageDecoder::Config decoder;
};
struct PpsSensor {
  drivers::PpsSource::Config source;
  drivers::PpsDecoder::Config decoder;
};

struct WheelSensor {
  /// UDP: datagrams of a CAN-to-Ethernet gateway (cannelloni).
  std::variant<drivers::CanSource::Config, drivers::UdpSource::Config, drivers::CanLogSource::Config> source;
  drivers::WheelDecoder::Config decoder;
};

/// Which clock a sensor's `received` is of.
enum class Arrivals : std::uint8_t {
  Live,      ///< this computer's, as its packets come
  Recorded,  ///< that of the computer that made the capture file
  Unknown,   ///< none: a log of bytes
};

struct Sensor {
  SensorId id{};
  std::string name;
  double silent_after_s = 3.0;  ///< connected without a packet for so long is a Fault Silent
  std::variant<VelodyneSensor, NovatelSensor, CameraSensor, PpsSensor, ProfileScannerSensor, WheelSensor> device;

  /// "velodyne", "novatel", "genicam", "pps", "profile_scanner", "wheel".
  const char* driver() const;
  /// Images and lasers may be left out of fusion when it cannot keep up; PPS and POS not before everything else is full.
  bool is_sheddable() const;
  Arrivals arrivals() const;
};

struct Rig {
  std::string name;
  std::string text;               ///< the file as it was read: goes into the recording
  std::vector<Sensor> sensors;    ///< id = place + 1
  fusion::RigGeometry geometry;
  sync::Synchroniser::Config sync;
  fusion::Colouring::Config colouring;
  std::string crs = "utm";        ///< "utm" (zone of the drive's origin) or "EPSG:n"

  /// Code of `crs`; 0: the UTM zone of the drive.
  int epsg() const { return crs == "utm" ? 0 : std::stoi(crs.substr(5)); }
  /// Names by SensorId; [0] is "hueline".
  std::vector<std::string> sensor_names() const;
};

/// ConfigError names file, line, key, what was found and what is allowed. `path`: a file, or a word (config/shipped.hpp).
Rig load_rig(const std::string& path);
Rig parse_rig(const std::string& text, const std::string& name);

/// The `sensors` list alone. Part of parse_rig.
std::vector<Sensor> read_sensors(Section& rig, fusion::RigGeometry& geometry, sync::Synchroniser::Config& sync);

}  // namespace hueline::config
