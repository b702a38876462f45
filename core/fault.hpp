#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "core/time.hpp"

namespace hueline {

/// Index of a sensor in the rig's list; 0 is hueline itself. The recording maps it to the sensor's name.
using SensorId = std::uint16_t;
constexpr SensorId kSystemSensor = 0;

/// The same names in log, recording and console. Say every loss once, with its count.
enum class FaultKind : std::uint8_t {
  Disconnected,   ///< device or peer gone; the reader reconnects with back-off
  Reconnected,    ///< and it is back
  Silent,         ///< connected, but nothing came for longer than the sensor's limit
  Overflow,       ///< a bounded queue, pool or kernel buffer was full; `count` packets lost
  Malformed,      ///< bytes that break their format; `count` bytes or packets
  Lost,           ///< a gap in the device's own count, or in the period of what it sends regularly; `count` units
  Late,           ///< came after its place in the stream had passed; recorded, not fused
  ClockStep,      ///< a clock jumped
  LabelConflict,  ///< two sources disagree about which second a PPS edge is
  Spurious,       ///< an edge, mark or image that belongs to nothing
  Shed,           ///< the pipeline was too slow: recorded, not fused
  DiskFull,       ///< or read-only, or failing: a write was refused
  WrongSize,      ///< an image whose size is not the rig's
  WrongDevice,    ///< something answers, but it is not the device that the rig names
  NoTime,   ///< the clock it needs is not disciplined: stamped roughly with a grown sigma, or not at all; detail says
            ///< which
  Refused,  ///< the device answered a command of ours with an error; detail has its answer
  Implausible,  ///< a value that its source doubts or those before it contradict; used with a grown sigma or not at
                ///< all: detail says
};
constexpr int kFaultKinds = 17;
const char* name(FaultKind kind);

/// Something that was lost, refused or doubted. Travels in the journal like any packet.
struct Fault {
  SensorId sensor = kSystemSensor;
  FaultKind kind = FaultKind::Malformed;
  HostTime time{};          ///< when it was noticed, on the packet that showed it
  std::uint64_t count = 1;  ///< units named by the kind
  std::string detail;       ///< what, where, what to do
};

/// Journal form of a Fault: u8 kind, u64 LE count, UTF-8 detail. Sensor and time are the packet's own.
std::vector<std::byte> encode_fault(const Fault& fault);
Result<Fault> decode_fault(SensorId sensor, HostTime time, std::span<const std::byte> bytes);

}  // namespace hueline
