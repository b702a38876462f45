#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "config/rig.hpp"
#include "core/result.hpp"
#include "runtime/health.hpp"

namespace hueline::runtime {

/// Something that is not ready for a drive.
struct Finding {
  bool prevents = true;  ///< the drive must not start; false: it may, with less
  std::string about;     ///< a sensor's name, "rig", "computer" or "disk"
  std::string text;      ///< what is wrong
  std::string action;    ///< what to do
};

/// What check needs to know of the computer. Empty or below 0: unknown.
struct HostFacts {
  std::int64_t rmem_max = -1;       ///< net.core.rmem_max, bytes
  std::string clock_source;         ///< the kernel's
  bool has_net_admin = false;       ///< sockets may have larger buffers than rmem_max
  bool has_guest = true;            ///< hueline-guest lies beside the program
  bool has_office = true;           ///< hueline-office lies beside the program
  std::int64_t free_bytes = -1;     ///< of the disk of the recording
  double disk_bytes_per_s = -1;     ///< that it takes
  double recorded_bytes_per_s = 0;  ///< that the sensors sent
  double points_per_s = 0;
};
/// Reads them, all but those of the disk.
HostFacts read_host_facts();

/// Returns what is wrong with the rig itself, as far as that shows without its devices: two sensors at one address,
/// lenses on one region, a lens that is upside down, a focal length that cannot fit, mountings beyond a vehicle, an
/// event input whose marks the receiver is not asked for, a map that is not projected.
std::vector<Finding> check_rig(const config::Rig& rig);
/// Returns what is wrong with the map of the cloud itself, wherever the drive is: a CRS that does not exist or is not
/// projected, a datum or a geoid that is not known here. Error: Invalid, with what to do.
Status check_map(const config::Rig& rig);
/// Returns what is wrong with the computer for a drive of that many hours.
std::vector<Finding> check_host(const config::Rig& rig, const HostFacts& facts, double hours);
/// Returns what the sensors that are there lack, by the health of a short run without recording.
std::vector<Finding> check_sensors(const config::Rig& rig, const Health& health);

}  // namespace hueline::runtime
