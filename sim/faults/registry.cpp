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
    {T::PacketLoss, "packet_loss", {Laser, LaserStatus, Pos, Wheel}, "share", 0, 1, 0.1, "Each packet is lost with probability S.", Told, {K::Lost, K::Silent, K::Malformed}},
    {T::BurstLoss, "burst_loss", {Laser, LaserStatus, Pos}, "packets", 1, 10000, 20, "Once a second S packets in a row are lost.", Told, {K::Lost}},
    {T::Outage, "outage", {Laser, LaserStatus, Pos, Pps, Camera, Wheel}, nullptr, 0, 0, 0, "Nothing arrives.", Told, {K::Lost, K::Silent, K::NoTime}},
    {T::Stall, "stall", {Laser, LaserStatus, Pos, Camera}, nullptr, 0, 0, 0, "Nothing arrives until the end. Then everything that was due arrives at once.", Told, {K::Late, K::ClockStep, K::LabelConflict, K::NoTime}},
    {T::Reorder, "reorder", {Laser, LaserStatus}, "ms", 0.01, 1000, 5, "Each packet is late by 0 to S, so packets overtake each other.", Told, {K::Late, K::Lost, K::Spurious}},
    {T::Duplicates, "duplicates", {Laser, LaserStatus, Pps, Wheel}, "share", 0, 1, 0.1, "Each packet arrives twice with probability S.", Told, {K::Spurious, K::Late}},
    {T::Corruption, "corruption", {Laser, LaserStatus, Pos}, "share", 0, 1, 0.1, "One byte of each packet is changed with probability S.", Told, {K::Malformed, K::ClockStep, K::WrongDevice, K::Late}},
    {T::Truncation, "truncation", {Laser, LaserStatus, Pos}, "share", 0, 1, 0.1, "Each packet is cut short with probability S.", Told, {K::Malformed}},
    {T::LateDelivery, "late_delivery", {Laser, LaserStatus, Pos}, "ms", 0.01, 10000, 50, "Every packet is late by S.", Immune, {}},
    {T::Fragments, "fragments", {Pos}, "bytes", 1, 1000, 7, "Logs arrive in pieces of S.", Immune, {}},
    {T::LineNoise, "line_noise", {Pos}, "bytes/s", 1, 1e6, 400, "Random bytes stand between the logs, at a rate of S.", Told, {K::Malformed}},
    {T::ForeignPackets, "foreign_packets", {Laser, LaserStatus}, "1/s", 0.1, 10000, 20, "Datagrams of something else arrive on the same port, at a rate of S.", Told, {K::Malformed, K::WrongDevice}},

    {T::ImageLoss, "image_loss", {Camera}, "share", 0, 1, 0.3, "Each image is lost on the way with probability S. The camera counts it.", Told, {K::Lost}},
    {T::ImageMissed, "image_missed", {Camera}, "share", 0, 1, 0.3, "With probability S the camera gives a strobe but no image, and does not count it.", Told, {K::Spurious}},
    {T::ImageRepeat, "image_repeat", {Camera}, "share", 0, 1, 0.5, "Each image is delivered twice with probability S.", Told, {K::Spurious}},
    {T::ImageFreeze, "image_freeze", {Camera}, nullptr, 0, 0, 0, "The camera repeats one picture with new numbers and stamps.", Told, {K::Spurious}},
    {T::CameraDisconnect, "camera_disconnect", {Camera}, "s", 0, 1e6, 1, "There are no images. Afterwards the camera counts images from 1, and its clock starts at S.", Told, {K::Spurious, K::ClockStep}},
    {T::FrameNumberJump, "frame_number_jump", {Camera}, "images", 1, 30000, 100, "The frame numbers jump ahead by S and stay ahead. The duration has no effect.", Told, {K::Lost}},
    {T::ImageLate, "image_late", {Camera}, "ms", 0.1, 10000, 300, "Images are late by S.", Immune, {}},
    {T::ImageWrongSize, "image_wrong_size", {Camera}, "share", 0.01, 0.99, 0.5, "Images have only the share S of their rows.", Told, {K::WrongSize}},
    {T::ImageIncomplete, "image_incomplete", {Camera}, "packets", 1, 10000, 3, "S packets of each image never arrive.", Told, {K::Lost, K::Malformed}},
    {T::CameraClockStep, "camera_clock_step", {Camera}, "s", -1000, 1000, 0.0333, "The camera's clock jumps by S and keeps the offset.", Told, {K::ClockStep, K::Lost}},
    {T::CameraClockDrift, "camera_clock_drift", {Camera}, "ppm", -500, 500, 40, "The camera warms up: its rate changes evenly by S in all and stays there.", Immune, {}},
    {T::CameraClockStuck, "camera_clock_stuck", {Camera}, nullptr, 0, 0, 0, "Every image has the same stamp.", Told, {K::ClockStep, K::Spurious, K::NoTime, K::Lost}},

    {T::MarkLoss, "mark_loss", {Pos}, "share", 0, 1, 0.5, "Each event mark is lost with probability S.", Told, {K::Lost}},
    {T::MarkDouble, "mark_double", {Pos}, "us", 1, 1e6, 300, "Each mark is followed by a second one after S.", Told, {K::Spurious}},
    {T::MarkSpurious, "mark_spurious", {Pos}, "1/s", 0.1, 1000, 5, "Marks without an image arrive, at a rate of S.", Told, {K::Spurious}},
    {T::MarkLate, "mark_late", {Pos}, "ms", 0.1, 10000, 500, "The messages of marks are late by S.", Immune, {}},
    {T::MarkShift, "mark_shift", {Pos}, "us", -1e6, 1e6, 2000, "The stamps of marks are off by S, as if the receiver stamped the strobe's other edge.", Told, {K::Lost, K::Spurious, K::ClockStep}},

    {T::PpsLoss, "pps_loss", {Pps}, "share", 0, 1, 1, "Each edge is lost with probability S.", Told, {K::Lost, K::Silent}},
    {T::PpsSpurious, "pps_spurious", {Pps}, "1/s", 0.1, 1000, 3, "Additional edges come at random times, at a rate of S.", Told, {K::Spurious}},
    {T::PpsWidth, "pps_width", {Pps}, "ms", 0.01, 900, 1, "The pulse is S wide, and both its ends are taken for edges.", Told, {K::Spurious}},
    {T::PpsInverted, "pps_inverted", {Pps}, "ms", 0.01, 900, 100, "The end of the pulse is taken for its edge, so the edge is late by S.", Told, {K::Spurious, K::Lost}},
    {T::PpsJitter, "pps_jitter", {Pps}, "us", 1, 100000, 200, "Each edge is late by 0 to S.", Told, {K::Spurious}},
    {T::PpsShift, "pps_shift", {Pps}, "us", -500000, 500000, 1000, "Edges are off by S.", Told, {K::Spurious, K::Lost}},
    {T::PpsLabel, "pps_label", {Pos, LaserStatus}, "s", -3, 3, 1, "The label of the second is wrong by S (whole), in TIME or in the scanner's GPRMC.", Told, {K::LabelConflict}},
    {T::UtcOffset, "utc_offset", {Pos, LaserStatus}, "s", -100, 100, 18, "UTC is taken for GPS time or the reverse: the label is off by S (whole), in TIME or in the scanner's GPRMC.", Told, {K::LabelConflict}},
    {T::TaiOffset, "tai_offset", {Pos, LaserStatus}, "s", -100, 100, 37, "TAI is taken for UTC: the label is off by S (whole), in TIME or in the scanner's GPRMC.", Told, {K::LabelConflict}},
    {T::WeekRollover, "week_rollover", {Pos}, "weeks", 1, 2048, 1024, "The receiver's weeks are too small by S (whole).", Told, {K::LabelConflict}},
    {T::LeapSecond, "leap_second", {Pos}, nullptr, 0, 0, 0, "A leap second is inserted at the first whole second: the receiver reports it and UTC is set back. The fault has no end.", Immune, {}},
    {T::LabelLate, "label_late", {Pos}, "s", 0.01, 10, 0.9, "TIME is late by S.", Immune, {}},
    {T::ReceiverTimeLost, "receiver_time_lost", {Pos}, nullptr, 0, 0, 0, "The receiver's time status falls to COARSE.", Told, {K::NoTime}},

    {T::NmeaLate, "nmea_late", {LaserStatus}, "s", 0, 10, 1.2, "The scanner gets its GPRMC S after the second. From 1 on it counts the wrong second.", Told, {K::LabelConflict}},
    {T::NmeaLoss, "nmea_loss", {LaserStatus}, nullptr, 0, 0, 0, "The scanner gets no GPRMC and counts on.", Immune, {}},
    {T::HalfSecond, "half_second", {Laser}, "s", -0.9, 0.9, 0.5, "The scanner rounds its second wrongly: its counter is off by S although it reports PPS lock.", Told, {K::LabelConflict, K::ClockStep, K::NoTime}},
    {T::LaserPpsLoss, "laser_pps_loss", {Laser}, "ppm", -1000, 1000, 15, "The scanner has no PPS, drifts by S and reports this.", Told, {K::NoTime}},
    {T::LaserClockStep, "laser_clock_step", {Laser}, "s", -1000, 1000, -0.25, "The scanner's counter is off by S although it reports PPS lock.", Told, {K::LabelConflict, K::ClockStep, K::NoTime}},
    {T::HourWrapLate, "hour_wrap_late", {Laser}, "ms", 1, 10000, 300, "If a UTC hour begins meanwhile, the scanner counts on beyond the hour for S.", Immune, {}},

    {T::PosGap, "pos_gap", {Pos}, nullptr, 0, 0, 0, "The POS gives no solutions.", Told, {K::Lost, K::Silent}},
    {T::PosNotGood, "pos_not_good", {Pos}, "status", 0, 12, 2, "Solutions have the status S; 2 is high variance.", Told, {K::Implausible}},
    {T::CovarianceBlowUp, "covariance_blow_up", {Pos}, "times", 1, 10000, 50, "The sigmas that the solution states are S times as large.", Immune, {}},
    {T::AttitudeJump, "attitude_jump", {Pos}, "deg", -180, 180, 2, "The heading is off by S.", Told, {K::Implausible}},
    {T::PositionJump, "position_jump", {Pos}, "m", -10000, 10000, 1, "The position is off by S to the east.", Told, {K::Implausible}},
    {T::GnssOutage, "gnss_outage", {Pos}, "m/s^2", 0.001, 10, 0.05, "The position drifts to the east by S t^2 / 2, and the stated sigma grows with it.", Immune, {}},
    {T::InsLabel, "ins_label", {Pos}, "s", -3, 3, 1, "The stamps of solutions are off by S (whole).", Told, {K::LabelConflict, K::Implausible}},

    {T::CanBusOff, "can_bus_off", {Wheel}, nullptr, 0, 0, 0, "The CAN controller is off the bus and is restarted at the end.", Told, {K::Disconnected}},
    {T::WheelStuck, "wheel_stuck", {Wheel}, nullptr, 0, 0, 0, "Speeds and pulses keep their values; the messages continue.", Told, {K::Implausible}},
    {T::WheelSlip, "wheel_slip", {Wheel}, "times", 0, 10, 1.5, "The wheels turn S times as fast as the vehicle moves.", Told, {K::Implausible}},

    {T::HostClockStep, "host_clock_step", {Host}, "s", 0.001, 3600, 0.4, "The computer's clock jumps ahead by S and keeps the offset.", Told, {K::ClockStep}},
    {T::HostClockDrift, "host_clock_drift", {Host}, "ppm", -50, 50, 2, "The computer warms up: the rate of its clock changes evenly by S in all and stays there.", Immune, {}},

    {T::DiskSlow, "disk_slow", {Host}, "MB/s", 0, 10000, 1, "The disk writes at most S; 0: it hangs.", Told, {K::Overflow}},
    {T::DiskFull, "disk_full", {Host}, "MB", 0, 1e6, 1, "The disk has room for S more.", Told, {K::DiskFull}},
    {T::DiskReadOnly, "disk_read_only", {Host}, nullptr, 0, 0, 0, "The medium fails and the kernel refuses to write. What was not synced is lost. The fault has no end.", Told, {K::DiskFull}},
    {T::ProcessKill, "process_kill", {Host}, nullptr, 0, 0, 0, "The program is killed. The computer runs on.", Cut, {}},
    {T::PowerCut, "power_cut", {Host}, nullptr, 0, 0, 0, "The computer loses its power. A part of what was not synced is lost, and some pages are torn.", Cut, {}},
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
