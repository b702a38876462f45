#pragma once

#include <cstdint>

#include "core/result.hpp"
#include "sim/drive.hpp"
#include "sim/wire/little_endian.hpp"

/// Encoders of a profile scanner's datagrams in the generic format (docs/formats.md, "Profile scanner"). The scanner
/// gets UTC from a receiver. Pure functions, reentrant.
namespace hueline::sim {

constexpr std::uint16_t kSimulatedProfileScanner = 1;  ///< number of a vehicle's first scanner

/// Encodes a data datagram; `counter` counts data datagrams. Errors: Invalid (counts and returns disagree, or there are
/// more than a datagram holds).
Result<Bytes> encode_profile_data(const ProfilePacket& packet, std::uint32_t counter,
                                  std::uint16_t scanner = kSimulatedProfileScanner);

/// What a status datagram reports.
struct ProfileStatusReport {
  GpsNs sent_gps_ns = 0;        ///< by the scanner's clock
  std::uint32_t counter = 0;    ///< counts status datagrams
  std::uint8_t pps_status = 2;  ///< 0 none, 1 synchronising, 2 locked, 3 error
  bool has_label = true, is_label_valid = true;
  std::uint16_t scanner = kSimulatedProfileScanner;
};
Bytes encode_profile_status(const ProfileStatusReport& report);

}  // namespace hueline::sim
