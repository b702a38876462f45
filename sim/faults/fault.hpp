#pragma once

#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/fault.hpp"

/// The faults that can happen in a simulated drive. A line of a scenario names a fault, its time, duration and
/// strength. One table (`fault_registry()`) says what each fault is, which devices it can hit, what its strength means,
/// and how hueline must react to it.
namespace hueline::sim {

/// The kinds of faults, by the part of the vehicle where they arise.
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

/// The device that a line concerns; for most devices it is a channel of the wire.
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

/// How the program must react to a fault.
enum class FaultOutcome : std::uint8_t {
  Told,  ///< one of the kinds in `told` is reported
  /// Only packets that the fault touched change; times, poses and colours are those of the drive without the fault.
  Immune,
  /// The program ends: the recording holds what it promises, and its reader is told that it was cut.
  Cut,
};

/// One row of the registry.
struct FaultEntry {
  FaultType type;
  const char* name;
  std::initializer_list<FaultTarget> targets;  ///< the first one is used where a line names none
  const char* unit;                            ///< unit of the strength; null: the fault has no strength
  double least, most, usual;                   ///< smallest, largest and default strength
  const char* what;                            ///< description, in which S is the strength
  FaultOutcome outcome;
  std::initializer_list<FaultKind> told;  ///< any of these kinds reports the fault
};
/// Returns the registry in the order of FaultType.
std::span<const FaultEntry> fault_registry();
const FaultEntry& entry_of(FaultType type);
/// Returns the entry of that name, or null if there is none.
const FaultEntry* find_fault(std::string_view name);

/// A line of a scenario's list `faults`. Its time counts from the beginning of the drive, lead-in included.
struct FaultLine {
  FaultType type = FaultType::PacketLoss;
  double at_s = 0;
  double for_s = 1;
  double strength = 0;
  FaultTarget target = FaultTarget::Laser;

  /// Returns a line with the default target and strength of the registry.
  static FaultLine usual(FaultType type, double at_s, double for_s);
  std::int64_t begin_ns() const { return static_cast<std::int64_t>(at_s * 1e9); }
  std::int64_t end_ns() const { return static_cast<std::int64_t>((at_s + for_s) * 1e9); }
  bool covers(std::int64_t drive_ns) const { return drive_ns >= begin_ns() && drive_ns < end_ns(); }
  /// Returns an empty text if the registry allows the line, else a sentence that names the wrong key.
  std::string validate() const;
};

constexpr double kLongestFault_s = 3600;

}  // namespace hueline::sim
