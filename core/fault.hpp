#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "core/time.hpp"

namespace hueline {

/// Index of a sensor in the rig's list; 0 is hueline itself. The recording contains the name for each index.
using SensorId = std::uint16_t;
constexpr SensorId kSystemSensor = 0;

/// The kind of a fault. Log, recording and console use the same names. Each loss is reported once, with its count.
enum class FaultKind : std::uint8_t {
  Disconnected,   ///< the device or peer is gone; the reader tries to reconnect, with growing pauses
  Reconnected,    ///< the device is back
  Silent,         ///< connected, but nothing arrived for longer than the sensor's limit
  Overflow,       ///< a bounded queue, pool or kernel buffer was full; `count` packets are lost
  Malformed,      ///< bytes that violate their format; `count` bytes or packets
  Lost,           ///< a gap in the device's own count, or in data that it sends at regular intervals; `count` units
  Late,           ///< arrived after fusion had passed its time; it is recorded, but not fused
  ClockStep,      ///< a clock jumped
  LabelConflict,  ///< two sources disagree about which second a PPS edge is
  Spurious,       ///< an edge, mark or image that belongs to nothing
  Shed,           ///< the pipeline was too slow; the packet is recorded, but not fused
  DiskFull,       ///< a write was refused: the disk is full, read-only or failing
  WrongSize,      ///< the size of an image differs from the rig's
  WrongDevice,    ///< a device answers, but it is not the one that the rig names
  /// The clock that this needs is not disciplined. It is stamped roughly with a grown sigma, or not at all; the detail
  /// says which.
  NoTime,
  Refused,  ///< the device answered a command with an error; the detail contains its answer
  /// A value that its source itself doubts, or that earlier values contradict. It is used with a grown sigma, or not at
  /// all; the detail says which.
  Implausible,
};
constexpr int kFaultKinds = 17;
/// Returns the enumerator's name.
const char* name(FaultKind kind);

/// Something that was lost, refused or doubted. A fault is a packet of the journal like any other.
struct Fault {
  SensorId sensor = kSystemSensor;
  FaultKind kind = FaultKind::Malformed;
  HostTime time{};          ///< when the fault was noticed: `received` of the packet that showed it
  std::uint64_t count = 1;  ///< in the units that the kind names
  std::string detail;       ///< what is wrong, where, and what to do
};

/// Converts a Fault to and from its bytes in the journal. The packet that contains the bytes has the sensor and the
/// time.
///
///   offset  bytes  field
///   0       1      kind
///   1       8      count, little endian
///   9       rest   detail, UTF-8
///
/// Errors of decode_fault(): Truncated for fewer than 9 bytes, Unsupported for a kind that is not known.
std::vector<std::byte> encode_fault(const Fault& fault);
Result<Fault> decode_fault(SensorId sensor, HostTime time, std::span<const std::byte> bytes);

}  // namespace hueline
