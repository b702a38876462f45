#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "drivers/can/can_decoder.hpp"
#include "drivers/stream/second_labels.hpp"
#include "drivers/xsens/xsens_epoch.hpp"

namespace hueline::drivers {

/// Decodes the messages of Xsens MTi devices on a CAN bus (MTi 600-series with GNSS, Sirius, Avior), with the
/// identifiers that the device has if nobody changes them, of 11 or 29 bits: MT CAN Protocol Documentation, MT1604P,
/// chapter 6. Data are big endian, as all of the maker's.
///
///   frames of one sample                                   measurement
///   Quaternion or EulerAngles, LatLong, AltitudeEllipsoid, InsSolution
///     VelocityXYZ
///   Acceleration and RateOfTurn (or both HR)               ImuSample
///   UTC                                                    stamps both; the first of a second: TimeLabel
///   SampleTime                                             carries the time on to samples without UTC
///   a gap of the group counter, Error                      Fault Lost
///   no UTC, or no GNSS fix in StatusWord yet               Fault NoTime; nothing is emitted
///   a frame that is too short                              Fault Malformed
///
/// The bus sends the frames of a sample in the order of their identifiers. A sample ends where a frame of a kind comes
/// that it has, or SampleTime, GroupCounter or UTC behind data; so a measurement is emitted when the next sample
/// begins, and its `received` is that of the sample's last frame. UTC counts in steps of 0.1 ms. The device's
/// orientation and velocity have to be in ENU, its setting if nobody changes it: on the bus it does not say which they
/// have.
class XsensCanDecoder final : public CanDecoder {
 public:
  void flush(std::vector<Measurement>& out) override;

 private:
  /// A UTC of the device and its own clock at the same sample.
  struct Anchor {
    GpsTime time;
    std::uint32_t ticks = 0;
  };
  Use take(const CanFrame& frame, HostTime received, std::vector<Measurement>& out) override;
  void forget() override;
  void begin_with(std::uint32_t kind, std::vector<Measurement>& out);
  void count_group(std::uint16_t counter, HostTime received, std::vector<Measurement>& out);
  void find_time();
  void end_sample(std::vector<Measurement>& out);

  XsensEpoch epoch_;                     // of the sample that is under way
  std::vector<std::uint32_t> kinds_;     // of its frames
  HostTime received_{};                  // of its last frame
  std::optional<std::uint32_t> ticks_;   // its SampleTime, 0.1 ms
  std::optional<Anchor> anchor_;         // the latest
  std::optional<std::uint32_t> status_;  // the latest status word
  bool was_fixed_ = false;               // GNSS has set the device's time
  bool has_no_time_ = false;
  XsensCounter group_;
  SecondLabels seconds_;
};

}  // namespace hueline::drivers
