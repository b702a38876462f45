#pragma once

#include <cstdint>

#include "core/result.hpp"
#include "sim/drive.hpp"
#include "sim/wire/little_endian.hpp"

/// Datagrams of a profile scanner in the generic format (docs/formats.md, "Profile scanner"), by a scanner that a
/// receiver told UTC. Pure functions, reentrant.
namespace hueline::sim {

constexpr std::uint16_t kSimulatedProfileScanner = 1;  ///< number of a vehicle's first

/// `counter`: of data datagrams so far. Invalid if counts and returns disagree, or more than a datagram holds.
Result<Bytes> encode_profile_data(const ProfilePacket& packet, std::uint32_t counter,
                                  std::uint16_t scanner = kSimulatedProfileScanner);

struct ProfileStatusReport {
  GpsNs sent_gps_ns = 0;        ///< by the scanner's clock
  std::uint32_t counter = 0;    ///< of status datagrams so far
  std::uint8_t pps_status = 2;  ///< 0 none, 1 synchronising, 2 locked, 3 error
  bool has_label = true, is_label_valid = true;
  std::uint16_t scanner = kSimulatedProfileScanner;
};
Bytes encode_profile_status(const ProfileStatusReport& report);

}  // namespace hueline::sim
