#pragma once

#include <cstddef>
#include <vector>

#include "sim/drive.hpp"
#include "sim/faults/fault.hpp"
#include "sim/wire/device_errors.hpp"
#include "sim/wire/seeded_random.hpp"
#include "sim/wire/timeline.hpp"

/// The stages in which faults are applied to a timeline. Private to this folder. Each function ignores lines of other
/// stages and returns how many things the line touched.
namespace hueline::sim {

/// Solutions before they are encoded.
bool concerns_solutions(FaultType type);
std::size_t spoil_solutions(const FaultLine& line, Drive& drive);

/// Wheel samples before they are encoded, and frames on the bus.
bool concerns_wheels(FaultType type);
std::size_t spoil_wheels(const FaultLine& line, Drive& drive);
std::size_t spoil_bus(const FaultLine& line, std::vector<WireEvent>& events);

/// The wrong clocks of the devices that the lines of a scenario describe.
class LineErrors : public DeviceErrors {
 public:
  LineErrors(const std::vector<FaultLine>& lines, GpsNs begin_gps_ns) : lines_(lines), begin_(begin_gps_ns) {}
  std::int64_t scanner_clock_ns(GpsNs t) const override;
  std::uint8_t scanner_pps_status(GpsNs t) const override;
  bool has_nmea(GpsNs second) const override;
  std::int64_t nmea_seconds(GpsNs second) const override;
  std::int64_t nmea_delay_ns(GpsNs second) const override;
  std::int64_t receiver_clock_ns(GpsNs t) const override;
  std::int64_t time_label_ns(GpsNs second) const override;
  std::int64_t ins_stamp_ns(GpsNs t) const override;
  std::uint8_t receiver_time_status(GpsNs t) const override;
  std::uint32_t ins_status(GpsNs t) const override;
  int leap_seconds(GpsNs t) const override;
  /// Returns 1 if a line concerns the clock of a device, else 0.
  static std::size_t concerns(const FaultLine& line);

 private:
  /// Returns the sum of the strengths of the lines of this type that cover time `t`; with `target`, only of lines with
  /// that target.
  double strength(FaultType type, GpsNs t) const;
  double strength(FaultType type, FaultTarget target, GpsNs t) const;
  bool is_on(FaultType type, GpsNs t) const;
  const std::vector<FaultLine>& lines_;
  const GpsNs begin_;
};

/// Edges and event marks, as the receiver and the computer's input give them.
std::size_t spoil_pulses(const FaultLine& line, std::vector<WireEvent>& events, SeededRandom random);
std::size_t spoil_marks(const FaultLine& line, GpsNs begin_gps_ns, std::vector<WireEvent>& events, SeededRandom random);
/// Images, as the camera delivers them.
std::size_t spoil_images(const FaultLine& line, std::vector<WireEvent>& events, SeededRandom random);
/// Packets on the way to the computer.
std::size_t spoil_packets(const FaultLine& line, std::vector<WireEvent>& events, SeededRandom random);
/// The computer's clock. It moves arrivals and edges alike.
std::size_t spoil_host_clock(const FaultLine& line, std::vector<WireEvent>& events);
/// Returns what a line adds to the computer's clock when the clock would show drive time `t`, ns.
std::int64_t host_clock_error_ns(const FaultLine& line, std::int64_t t);

/// Sorts events by time; events of equal time keep their order.
void sort_by_time(std::vector<WireEvent>& events);

}  // namespace hueline::sim
