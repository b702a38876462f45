#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "score/figures.hpp"

namespace hueline::score {

/// What became of one device's bytes.
struct DeviceBytes {
  std::uint64_t sent_units = 0, sent_bytes = 0;           ///< by the simulated device: datagrams, logs, edges, images
  std::uint64_t missing_units = 0;                        ///< of these, never handed to the program
  std::uint64_t received_bytes = 0;                       ///< handed to the program
  std::uint64_t decoded = 0, ignored = 0, malformed = 0;  ///< bytes, as its decoder counts them
  std::uint64_t told_lost = 0;                            ///< sum of the counts of its Lost faults, units
};

/// Bytes that nothing explains: received ones that are in none of the decoder's three counts (or counted more often
/// than they came), and those of units that were sent, did not come, and were not told lost. A unit's bytes are the
/// device's mean.
std::uint64_t unexplained_bytes(const DeviceBytes& device);

/// unexplained_bytes, overtold_units and a note a device.
void add_byte_figures(const std::map<std::string, DeviceBytes>& devices, ScenarioScore& score);

}  // namespace hueline::score
