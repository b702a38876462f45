#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "drivers/ouster/ouster_metadata.hpp"

/// The fields of Ouster's datagrams, little endian. The functions read no byte beyond the datagram. Source: Ouster's
/// public description of the legacy and the configurable data packets. A data packet of the LEGACY profile has columns
/// alone; the others have a header and a footer of 32 bytes each.
///
///   header STANDARD                            header FUSA
///        0     2  type: 1 data, 2 IMU, 3 zones      0     1  type
///        2     2  number of the frame               1     3  number of the initialisation
///        4     3  number of the initialisation      4     4  number of the frame
///        7     5  serial number                    11     5  serial number
///       16     1  seconds until the scanner switches itself off for heat, if 18 tells that
///       17     1  seconds until it limits its shots
///       18     1  lower half: 1 if it is about to switch itself off
///       19     1  lower half: it limits its shots, or is about to
///
///   column                                     column of the LEGACY profile
///        0     8  time, ns                          0     8  time, ns
///        8     2  number of the column              8     2  number of the column
///       10     2  status; lowest bit: valid        10     2  number of the frame
///       12        channels                         12     4  angle of the encoder, 90112 to a turn
///                                                  16        channels
///                                                  end    4  status
/// Thread safety: they may be called from several threads at the same time.
namespace hueline::drivers {

/// The datagrams of an Ouster beside its data packets.
enum class OusterOther : std::uint8_t { Imu, Zones };
/// Returns what a datagram is that is no data packet but is sent by an Ouster; nothing if it is neither.
std::optional<OusterOther> ouster_other(std::span<const std::byte> datagram);
/// Returns whether a datagram of an unknown sender is one of an Ouster's inertial sensor, by what is in it: a legacy
/// packet with two stamps of one moment and values that such a sensor can have, or a header of its type with a serial
/// number.
bool is_ouster_imu(std::span<const std::byte> datagram);

/// What a data packet says in its header.
struct OusterHeader {
  std::uint32_t frame = 0;  ///< of 32 bits with the header FUSA, of 16 otherwise
  std::optional<std::uint32_t> init_id;
  std::optional<std::uint64_t> serial;
  bool shuts_down = false;    ///< the scanner is about to switch itself off because it is hot
  bool limits_shots = false;  ///< it limits its shots because it is hot, or is about to
};
/// Decodes the header of a data packet of the metadata's size.
OusterHeader decode_ouster_header(std::span<const std::byte> packet, const OusterMetadata& metadata);

/// What one column says besides its channels.
struct OusterColumn {
  std::uint64_t time_ns = 0;
  int number = 0;
  bool is_valid = false;
};
/// Decodes a column of `metadata.column_bytes()`.
OusterColumn decode_ouster_column(const std::byte* column, const OusterMetadata& metadata);

/// Returns whether a datagram is a data packet as the metadata describe it: its size, and columns that follow each
/// other. Packets of a scanner whose settings are others have another size, nearly always.
bool is_ouster_packet(std::span<const std::byte> datagram, const OusterMetadata& metadata);

/// Returns whether a datagram looks like a data packet of an Ouster, whose metadata are not known.
bool looks_like_ouster(std::span<const std::byte> datagram);

}  // namespace hueline::drivers
