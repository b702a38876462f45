#pragma once

#include <cstdint>
#include <optional>

#include "core/keys.hpp"
#include "drivers/stream/second_labels.hpp"
#include "drivers/stream/stream_decoder.hpp"
#include "drivers/xsens/xsens_epoch.hpp"

namespace hueline::drivers {

/// Decodes MTData2 messages of Xsens MTi devices (MTi-G-710, MTi-680G and alike with GNSS; others have no absolute
/// time).
///
///   data of one message                                    measurement
///   orientation as quaternion, matrix or Euler angles,     InsSolution
///     latitude and longitude with altitude, or place in
///     the Earth's frame; velocity
///   acceleration and rate of turn                          ImuSample
///   GNSS PVT data                                          GnssFix
///   UTC time                                               stamps all of these; the first of a second: TimeLabel
///   a gap of the packet counter                            Fault Lost
///   an error message of the device                         Fault Refused
///   bytes that are skipped                                 Fault Malformed, with their number
///   no UTC time, or one that is not fully resolved         Fault NoTime; nothing is emitted
///   orientation in north-east-down                         Fault Implausible: ask the device for ENU or NWU
///
/// The device says in each datum which number format and local frame it has. The sensor's axes are forward, left, up.
class XsensDecoder final : public StreamDecoder {
 public:
  struct Config {
    void visit(Keys&) {}
    KeyError validate() const { return {}; }
  };
  explicit XsensDecoder(const Config&);

 private:
  bool take(const Message& message) override;
  void forget() override;
  bool take_data(std::span<const std::byte> data, HostTime received);
  bool take_fix(std::span<const std::byte> pvt, HostTime received);
  void count(std::uint16_t counter, HostTime received);

  SecondLabels seconds_;
  XsensCounter counter_;
  bool has_no_time_ = false, is_ned_ = false;
};

}  // namespace hueline::drivers
