#include <fmt/format.h>

#include <algorithm>

#include "sim/faults/fault.hpp"

namespace hueline::sim {
namespace {

using enum FaultTarget;
using enum FaultOutcome;
using K = FaultKind;
using T = FaultType;

// `told` lists what an operator must be able to read. There are several kinds where the report depends on the device or
// on the strength.
// clang-format off
constexpr FaultEntry kRegistry[] = {
    {T::PacketLoss, "packet_loss", {Laser, LaserStatus, Pos, Wheel}, "share", 0, 1, 0.1, "each packet is lost with probability S", Told, {K::Lost, K::Silent, K::Malformed}},
    {T::BurstLoss, "burst_loss", {Laser, LaserStatus, Pos}, "packets", 1, 10000, 20, "once a second S packets in a row are lost", Told, {K::Lost}},
    {T::Outage, "outage", {Laser, LaserStatus, Pos, Pps, Camera, Wheel}, nullptr, 0, 0, 0, "nothing arrives", Told, {K::Lost, K::Silent, K::NoTime}},
    {T::Stall, "stall", {Laser, LaserStatus, Pos, Camera}, nullptr, 0, 0, 0, "what is due arrives at the end, all at once", Told, {K::Late, K::ClockStep, K::LabelConflict, K::NoTime}},
    {T::Reorder, "reorder", {Laser, LaserStatus}, "ms", 0.01, 1000, 5, "each packet is late by 0 to S", Told, {K::Late, K::Lost, K::Spurious}},
    {T::Duplicates, "duplicates", {Laser, LaserStatus, Pps, Wheel}, "share", 0, 1, 0.1, "each packet comes twice with probability S", Told, {K::Spurious, K::Late}},
    {T::Corruption, "corruption", {Laser, LaserStatus, Pos}, "share", 0, 1, 0.1, "a byte of each packet is changed with probability S", Told, {K::Malformed, K::ClockStep, K::WrongDevice, K::Late}},
    {T::Truncation, "truncation", {Laser, LaserStatus, Pos}, "share", 0, 1, 0.1, "each packet is cut short with probability S", Told, {K::Malformed}},
    {T::LateDelivery, "late_delivery", {Laser, LaserStatus, Pos}, "ms", 0.01, 10000, 50, "every packet is late by S", Immune, {}},
    {T::Fragments, "fragments", {Pos}, "bytes", 1, 1000, 7, "logs come in pieces of S", Immune, {}},
    {T::LineNoise, "line_noise", {Pos}, "bytes/s", 1, 1e6, 400, "S of random bytes between the logs", Told, {K::Malformed}},
    {T::ForeignPackets, "foreign_packets", {Laser, LaserStatus}, "1/s", 0.1, 10000, 20, "S datagrams of something else on the same port", Told, {K::Malformed, K::WrongDevice}},

    {T::ImageLoss, "image_loss", {Camera}, "share", 0, 1, 0.3, "each image is lost on the way with probability S; the camera counted it", Told, {K::Lost}},
    {T::ImageMissed, "image_missed", {Camera}, "share", 0, 1, 0.3, "the camera flashes and delivers no image with probability S; its numbers close up", Told, {K::Spurious}},
    {T::ImageRepeat, "image_repeat", {Camera}, "share", 0, 1, 0.5, "each image is delivered twice with probability S", Told, {K::Spurious}},
    {T::ImageFreeze, "image_freeze", {Camera}, nullptr, 0, 0, 0, "the same picture again and again, with new numbers and stamps", Told, {K::Spurious}},
    {T::CameraDisconnect, "camera_disconnect", {Camera}, "s", 0, 1e6, 1, "no images; then the camera counts images from 1, its clock from S", Told, {K::Spurious, K::ClockStep}},
    {T::FrameNumberJump, "frame_number_jump", {Camera}, "images", 1, 30000, 100, "frame numbers leap ahead by S; no duration", Told, {K::Lost}},
    {T::ImageLate, "image_late", {Camera}, "ms", 0.1, 10000, 300, "images arrive late by S", Immune, {}},
    {T::ImageWrongSize, "image_wrong_size", {Camera}, "share", 0.01, 0.99, 0.5, "images have only S of their rows", Told, {K::WrongSize}},
    {T::ImageIncomplete, "image_incomplete", {Camera}, "packets", 1, 10000, 3, "S packets of each image are missing for good", Told, {K::Lost, K::Malformed}},
    {T::CameraClockStep, "camera_clock_step", {Camera}, "s", -1000, 1000, 0.0333, "the camera's clock leaps by S and stays there", Told, {K::ClockStep, K::Lost}},
    {T::CameraClockDrift, "camera_clock_drift", {Camera}, "ppm", -500, 500, 40, "the camera warms up: its rate goes by S in all, evenly, and stays", Immune, {}},
    {T::CameraClockStuck, "camera_clock_stuck", {Camera}, nullptr, 0, 0, 0, "every image has the same stamp", Told, {K::ClockStep, K::Spurious, K::NoTime, K::Lost}},

    {T::MarkLoss, "mark_loss", {Pos}, "share", 0, 1, 0.5, "each event mark is lost with probability S", Told, {K::Lost}},
    {T::MarkDouble, "mark_double", {Pos}, "us", 1, 1e6, 300, "each mark is followed by a second one after S", Told, {K::Spurious}},
    {T::MarkSpurious, "mark_spurious", {Pos}, "1/s", 0.1, 1000, 5, "S marks to which no image belongs", Told, {K::Spurious}},
    {T::MarkLate, "mark_late", {Pos}, "ms", 0.1, 10000, 500, "messages of marks come late by S", Immune, {}},
    {T::MarkShift, "mark_shift", {Pos}, "us", -1e6, 1e6, 2000, "marks are stamped off by S: the strobe's other edge", Told, {K::Lost, K::Spurious, K::ClockStep}},

    {T::PpsLoss, "pps_loss", {Pps}, "share", 0, 1, 1, "each edge is lost with probability S", Told, {K::Lost, K::Silent}},
    {T::PpsSpurious, "pps_spurious", {Pps}, "1/s", 0.1, 1000, 3, "S edges at any moment", Told, {K::Spurious}},
    {T::PpsWidth, "pps_width", {Pps}, "ms", 0.01, 900, 1, "the pulse is S wide and both its ends are taken for edges", Told, {K::Spurious}},
    {T::PpsInverted, "pps_inverted", {Pps}, "ms", 0.01, 900, 100, "the pulse's end is taken for its edge: S late", Told, {K::Spurious, K::Lost}},
    {T::PpsJitter, "pps_jitter", {Pps}, "us", 1, 100000, 200, "edges are late by 0 to S", Told, {K::Spurious}},
    {T::PpsShift, "pps_shift", {Pps}, "us", -500000, 500000, 1000, "edges are off by S", Told, {K::Spurious, K::Lost}},
    {T::PpsLabel, "pps_label", {Pos, LaserStatus}, "s", -3, 3, 1, "the second is named wrongly by S (whole): in TIME, or in the scanner's GPRMC", Told, {K::LabelConflict}},
    {T::UtcOffset, "utc_offset", {Pos, LaserStatus}, "s", -100, 100, 18, "UTC taken for GPS time or the reverse: off by S (whole) in TIME, or in the scanner's GPRMC", Told, {K::LabelConflict}},
    {T::TaiOffset, "tai_offset", {Pos, LaserStatus}, "s", -100, 100, 37, "TAI taken for UTC: off by S (whole) in TIME, or in the scanner's GPRMC", Told, {K::LabelConflict}},
    {T::WeekRollover, "week_rollover", {Pos}, "weeks", 1, 2048, 1024, "the receiver counts weeks short by S (whole)", Told, {K::LabelConflict}},
    {T::LeapSecond, "leap_second", {Pos}, nullptr, 0, 0, 0, "a leap second is inserted at the first whole second: the receiver says so, UTC falls back; no end", Immune, {}},
    {T::LabelLate, "label_late", {Pos}, "s", 0.01, 10, 0.9, "TIME comes S late", Immune, {}},
    {T::ReceiverTimeLost, "receiver_time_lost", {Pos}, nullptr, 0, 0, 0, "the receiver's time status falls to COARSE", Told, {K::NoTime}},

    {T::NmeaLate, "nmea_late", {LaserStatus}, "s", 0, 10, 1.2, "the scanner gets its GPRMC S after the second; beyond 1 it counts the wrong second", Told, {K::LabelConflict}},
    {T::NmeaLoss, "nmea_loss", {LaserStatus}, nullptr, 0, 0, 0, "the scanner gets no GPRMC and counts on", Immune, {}},
    {T::HalfSecond, "half_second", {Laser}, "s", -0.9, 0.9, 0.5, "the scanner rounds its second wrongly: its counter is off by S though it claims PPS lock", Told, {K::LabelConflict, K::ClockStep, K::NoTime}},
    {T::LaserPpsLoss, "laser_pps_loss", {Laser}, "ppm", -1000, 1000, 15, "the scanner has no PPS and drifts by S, and says so", Told, {K::NoTime}},
    {T::LaserClockStep, "laser_clock_step", {Laser}, "s", -1000, 1000, -0.25, "the scanner's counter is off by S though it claims PPS lock", Told, {K::LabelConflict, K::ClockStep, K::NoTime}},
    {T::HourWrapLate, "hour_wrap_late", {Laser}, "ms", 1, 10000, 300, "if the UTC hour turns meanwhile: the scanner counts on beyond it for S", Told, {K::Malformed}},

    {T::PosGap, "pos_gap", {Pos}, nullptr, 0, 0, 0, "no navigation solution is given out", Told, {K::Lost, K::Silent}},
    {T::PosNotGood, "pos_not_good", {Pos}, "status", 0, 12, 2, "solutions have status S: 2 is high variance", Told, {K::Implausible}},
    {T::CovarianceBlowUp, "covariance_blow_up", {Pos}, "times", 1, 10000, 50, "the solution's own sigma is S times as large", Immune, {}},
    {T::AttitudeJump, "attitude_jump", {Pos}, "deg", -180, 180, 2, "heading is off by S", Told, {K::Implausible}},
    {T::PositionJump, "position_jump", {Pos}, "m", -10000, 10000, 1, "the place is off by S to the east", Told, {K::Implausible}},
    {T::GnssOutage, "gnss_outage", {Pos}, "m/s^2", 0.001, 10, 0.05, "the place drifts off by S t^2 / 2, and the stated sigma grows with it", Immune, {}},
    {T::InsLabel, "ins_label", {Pos}, "s", -3, 3, 1, "solutions are stamped off by S (whole)", Told, {K::LabelConflict, K::Implausible}},

    {T::CanBusOff, "can_bus_off", {Wheel}, nullptr, 0, 0, 0, "the CAN controller is off the bus and is restarted at the end", Told, {K::Disconnected}},
    {T::WheelStuck, "wheel_stuck", {Wheel}, nullptr, 0, 0, 0, "speeds and pulses stay as they are; the messages go on", Told, {K::Implausible}},
    {T::WheelSlip, "wheel_slip", {Wheel}, "times", 0, 10, 1.5, "the wheels turn S times as fast as the vehicle goes", Told, {K::Implausible}},

    {T::HostClockStep, "host_clock_step", {Host}, "s", 0.001, 3600, 0.4, "the computer's clock leaps ahead by S and stays there", Told, {K::ClockStep}},
    {T::HostClockDrift, "host_clock_drift", {Host}, "ppm", -50, 50, 2, "the computer warms up: its clock's rate goes by S in all, evenly, and stays", Immune, {}},

    {T::DiskSlow, "disk_slow", {Host}, "MB/s", 0, 10000, 1, "the disk takes no more than S; 0: it hangs", Told, {K::Overflow}},
    {T::DiskFull, "disk_full", {Host}, "MB", 0, 1e6, 1, "the disk has room for S more", Told, {K::DiskFull}},
    {T::DiskReadOnly, "disk_read_only", {Host}, nullptr, 0, 0, 0, "the medium fails and the kernel allows no more writing; what was not synced is lost; no end", Told, {K::DiskFull}},
    {T::ProcessKill, "process_kill", {Host}, nullptr, 0, 0, 0, "the program is killed; the computer runs on", Cut, {}},
    {T::PowerCut, "power_cut", {Host}, nullptr, 0, 0, 0, "the computer loses its power; what was not synced is lost in part, pages torn", Cut, {}},
};
// clang-format on

}  // namespace

const char* name(FaultTarget target) {
  switch (target) {
    case Laser:
      return "laser";
    case LaserStatus:
      return "laser_status";
    case Pos:
      return "pos";
    case Pps:
      return "pps";
    case Camera:
      return "camera";
    case Wheel:
      return "wheel";
    case Host:
      return "host";
  }
  return "?";
}

std::span<const FaultEntry> fault_registry() { return kRegistry; }

const FaultEntry& entry_of(FaultType type) { return kRegistry[static_cast<std::size_t>(type)]; }

const FaultEntry* find_fault(std::string_view name) {
  const auto found =
      std::find_if(std::begin(kRegistry), std::end(kRegistry), [&](const FaultEntry& e) { return e.name == name; });
  return found == std::end(kRegistry) ? nullptr : found;
}

FaultLine FaultLine::usual(FaultType type, double at_s, double for_s) {
  const FaultEntry& entry = entry_of(type);
  return {type, at_s, for_s, entry.usual, *entry.targets.begin()};
}

std::string FaultLine::validate() const {
  const FaultEntry& entry = entry_of(type);
  if (!(at_s >= 0 && at_s <= 1e6)) return fmt::format("at_s: {} is not within 0 .. 1000000 s", at_s);
  if (!(for_s > 0 && for_s <= kLongestFault_s))
    return fmt::format("for_s: {} is not above 0 and at most {} s", for_s, kLongestFault_s);
  if (!(strength >= entry.least && strength <= entry.most))
    return fmt::format("strength: {} of {} is not within {} .. {}", strength, entry.name, entry.least, entry.most);
  if (std::find(entry.targets.begin(), entry.targets.end(), target) == entry.targets.end())
    return fmt::format("target: {} cannot happen to {}", entry.name, sim::name(target));
  return {};
}

}  // namespace hueline::sim
