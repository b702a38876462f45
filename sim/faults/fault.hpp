#pragma once

#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/fault.hpp"

/// What can go wrong in a simulated drive, as a scenario names it: a line with what, when, for how long and how
/// strongly. One table (fault_registry) says what each fault is, to which devices it can happen, what its strength
/// means, and what hueline owes about it.
namespace hueline::sim {

enum class FaultType : std::uint8_t {
  // on the way from a device to the computer
  PacketLoss,
  BurstLoss,
  Outage,
  Stall,
  Reorder,
  Duplicates,
  Corruption,
  Truncation,
  LateDelivery,
  Fragments,
  LineNoise,
  ForeignPackets,
  // the camera
  ImageLoss,
  ImageMissed,
  ImageRepeat,
  ImageFreeze,
  CameraDisconnect,
  FrameNumberJump,
  ImageLate,
  ImageWrongSize,
  ImageIncomplete,
  CameraClockStep,
  CameraClockDrift,
  CameraClockStuck,
  // the event marks of its strobe
  MarkLoss,
  MarkDouble,
  MarkSpurious,
  MarkLate,
  MarkShift,
  // the pulse per second, and what says which second it was
  PpsLoss,
  PpsSpurious,
  PpsWidth,
  PpsInverted,
  PpsJitter,
  PpsShift,
  PpsLabel,
  UtcOffset,
  TaiOffset,
  WeekRollover,
  LeapSecond,
  LabelLate,
  ReceiverTimeLost,
  // the scanner's own clock
  NmeaLate,
  NmeaLoss,
  HalfSecond,
  LaserPpsLoss,
  LaserClockStep,
  HourWrapLate,
  // the navigation solution
  PosGap,
  PosNotGood,
  CovarianceBlowUp,
  AttitudeJump,
  PositionJump,
  GnssOutage,
  InsLabel,
  // the wheel encoder and its bus
  CanBusOff,
  WheelStuck,
  WheelSlip,
  // the computer's clock
  HostClockStep,
  HostClockDrift,
  // the computer's disk, and the program that records (FaultyDisk)
  DiskSlow,
  DiskFull,
  DiskReadOnly,
  ProcessKill,
  PowerCut,
};

/// The device that a line concerns: a channel of the wire.
enum class FaultTarget : std::uint8_t {
  Laser,        ///< data datagrams of the scanner
  LaserStatus,  ///< position datagrams of the scanner
  Pos,          ///< logs of the POS
  Pps,
  Camera,
  Wheel,  ///< frames of the CAN bus
  Host,   ///< the capture computer
};
const char* name(FaultTarget target);

/// What must come of a fault.
enum class FaultOutcome : std::uint8_t {
  Told,    ///< one of `told` is reported
  Immune,  ///< nothing but the fault's own packets changes: times, poses and colours are those of the drive without it
  Cut,     ///< the program is gone: the recording holds what it promises, and who reads it is told that it was cut
};

/// One row of the registry.
struct FaultEntry {
  FaultType type;
  const char* name;
  std::initializer_list<FaultTarget> targets;  ///< the first is taken where a line names none
  const char* unit;                            ///< of the strength; null: the fault has none
  double least, most, usual;                   ///< strength
  const char* what;                            ///< with the strength as S
  FaultOutcome outcome;
  std::initializer_list<FaultKind> told;  ///< any of these says it
};
/// In the order of FaultType.
std::span<const FaultEntry> fault_registry();
const FaultEntry& entry_of(FaultType type);
/// Null if there is none of that name.
const FaultEntry* find_fault(std::string_view name);

/// A line of a scenario's list `faults`. Drive time counts from the drive's beginning, lead-in included.
struct FaultLine {
  FaultType type = FaultType::PacketLoss;
  double at_s = 0;
  double for_s = 1;
  double strength = 0;
  FaultTarget target = FaultTarget::Laser;

  /// The line with the registry's target and strength.
  static FaultLine usual(FaultType type, double at_s, double for_s);
  std::int64_t begin_ns() const { return static_cast<std::int64_t>(at_s * 1e9); }
  std::int64_t end_ns() const { return static_cast<std::int64_t>((at_s + for_s) * 1e9); }
  bool covers(std::int64_t drive_ns) const { return drive_ns >= begin_ns() && drive_ns < end_ns(); }
  /// Empty if the registry allows it, else a sentence that names the key.
  std::string validate() const;
};

constexpr double kLongestFault_s = 3600;

}  // namespace hueline::sim
