#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "core/result.hpp"
#include "core/time.hpp"
#include "drivers/hesai/hesai_model.hpp"

/// The fields of Hesai's datagrams. The functions read no byte beyond the datagram.
/// Thread safety: they may be called from several threads at the same time.
namespace hueline::drivers {

constexpr std::size_t kHesaiGpsBytes = 512;

/// Returns the model whose data packet this is, by its header, or its flags and size. Nothing: it is none of those that
/// are known.
std::optional<HesaiModel> hesai_model(std::span<const std::byte> datagram);

/// Returns whether a datagram begins as a data packet of a newer Hesai, known or not.
bool has_hesai_header(std::span<const std::byte> datagram);

/// What a data packet says besides its returns.
struct HesaiPacket {
  int returns = 1;        ///< blocks of the same firings
  std::uint8_t mode = 0;  ///< the maker's number of the return mode
  double range_step_m = 0;
  double turns_per_min = 0;      ///< of the motor
  std::optional<UnixTime> time;  ///< nothing: the scanner has no date
  std::optional<std::uint32_t> sequence;
  bool is_fine = false;    ///< of models with high resolution: it is on
  bool is_second = false;  ///< of a QT128 in dual-return mode: the times are those of its second loop
};

/// Decodes header and tail. Errors: Truncated (shorter than the model's packet), Malformed (a field out of its range),
/// Unsupported (a return mode that is not known).
Result<HesaiPacket> decode_hesai(std::span<const std::byte> datagram, const HesaiTable& table);

/// What a GPS packet says: the receiver's second, and the state of the pulse per second.
///
///   offset  size  field
///        0     2  0xFF 0xEE
///       18    84  NMEA sentence
///      506     1  status of the position fix
///      507     1  whether the clock is locked to the pulse per second
struct HesaiGps {
  bool is_locked = false;
  bool has_fix = false;
};
/// Returns nothing if the datagram is no GPS packet.
std::optional<HesaiGps> decode_hesai_gps(std::span<const std::byte> datagram);

}  // namespace hueline::drivers
