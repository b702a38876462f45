#pragma once

#include <cstddef>
#include <vector>

#include "sim/drive.hpp"
#include "sim/faults/fault.hpp"
#include "sim/wire/device_errors.hpp"
#include "sim/wire/seeded_random.hpp"
#include "sim/wire/timeline.hpp"

/// The stages in which a timeline is spoilt. Private to this folder. Each function does nothing for lines of other
/// stages and returns how many things the line touched.
namespace hueline::sim {

/// Navigation solutions before they are encoded.
bool concerns_solutions(FaultType type);
std::size_t spoil_solutions(const FaultLine& line, Drive& drive);

/// Wheels before they are encoded, and what the bus does with the frames.
bool concerns_wheels(FaultType type);
std::size_t spoil_wheels(const FaultLine& line, Drive& drive);
std::size_t spoil_bus(const FaultLine& line, std::vector<WireEvent>& events);

/// Wrong clocks of the devices, as lines of a scenario name them.
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
  /// Of a line: 1 if it concerns a clock of a device.
  static std::size_t concerns(const FaultLine& line);

 private:
  /// The strength of the lines of this kind that cover the instant, added up; `target` as given.
  double strength(FaultType type, GpsNs t) const;
  double strength(FaultType type, FaultTarget target, GpsNs t) const;
  bool is_on(FaultType type, GpsNs t) const;
  const std::vector<FaultLine>& lines_;
  const GpsNs begin_;
};

/// Pulses and marks, as the receiver and the computer's input make them.
std::size_t spoil_pulses(const FaultLine& line, std::vector<WireEvent>& events, SeededRandom random);
std::size_t spoil_marks(const FaultLine& line, GpsNs begin_gps_ns, std::vector<WireEvent>& events, SeededRandom random);
/// Images, as the camera delivers them.
std::size_t spoil_images(const FaultLine& line, std::vector<WireEvent>& events, SeededRandom random);
/// Packets on their way.
std::size_t spoil_packets(const FaultLine& line, std::vector<WireEvent>& events, SeededRandom random);
/// The computer's clock: moves arrivals and edges alike.
std::size_t spoil_host_clock(const FaultLine& line, std::vector<WireEvent>& events);
/// What that line adds to the computer's clock when it would show drive time `t`, ns.
std::int64_t host_clock_error_ns(const FaultLine& line, std::int64_t t);

/// Back into the order of time, those of one moment as they were.
void sort_by_time(std::vector<WireEvent>& events);

}  // namespace hueline::sim
