#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "score/figures.hpp"

namespace hueline::score {

/// What became of the bytes of one device.
struct DeviceBytes {
  std::uint64_t sent_units = 0, sent_bytes = 0;  ///< sent by the simulated device: datagrams, logs, edges, images
  std::uint64_t missing_units = 0;               ///< sent, but never handed to the program
  std::uint64_t received_bytes = 0;              ///< handed to the program
  std::uint64_t decoded = 0, ignored = 0, malformed = 0;  ///< bytes, as the decoder of the device counts them
  std::uint64_t told_lost = 0;                            ///< sum of the counts of its Lost faults, in units
};

/// Returns the bytes of a device that nothing explains. These are received bytes that the three counts of the decoder
/// do not hold (or hold more than once), and the bytes of units that were sent, did not arrive and were not reported
/// lost. Such a unit counts with the mean size of the device's units.
std::uint64_t unexplained_bytes(const DeviceBytes& device);

/// Adds the figures unexplained_bytes and overtold_units, and a note for each device.
void add_byte_figures(const std::map<std::string, DeviceBytes>& devices, ScenarioScore& score);

}  // namespace hueline::score
