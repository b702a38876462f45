#pragma once

#include <optional>
#include <string>

#include "core/keys.hpp"
#include "drivers/stream/second_labels.hpp"
#include "drivers/stream/stream_decoder.hpp"

namespace hueline::drivers {

/// Decodes the stream of a Septentrio receiver (AsteRx, mosaic): SBF, mixed with NMEA sentences, RTCM 3 and replies.
///
///   what comes                     measurement
///   INSNavGeod or INSNavCart       InsSolution, with its sigmas if the receiver sends them
///   PVTGeodetic, PosCovGeodetic    GnssFix, with the sigmas of the covariance or of the accuracies
///   or PVTCartesian, PosCovCartesian   the same
///   ReceiverTime, PVTGeodetic      TimeLabel, one for each second
///   ExtEvent                       EventMark
///   a reply "$R?"                  Fault Refused
///   bytes that are skipped         Fault Malformed, with their number
///   blocks that never came         Fault Lost, judged by their period
///   the time is not set or fine    Fault NoTime; what it stamps is not trusted
///
/// A receiver without satellites sends blocks with a time of week that runs freely, hours beside the true one. Such
/// times are used for nothing: a position needs a solution without error, and a mark a receiver clock that the receiver
/// has related to GNSS. Of two blocks that say the same of one moment, in degrees and in metres, the first is used.
/// MeasEpoch and navigation pages are recorded and counted; NMEA is counted.
class SeptentrioDecoder final : public StreamDecoder {
 public:
  struct Config {
    void visit(Keys&) {}
    KeyError validate() const { return {}; }
  };
  explicit SeptentrioDecoder(const Config&);

 private:
  using Block = std::span<const std::byte>;

  bool take(const Message& message) override;
  void finish() override { give_fix(); }
  void forget() override;

  bool take_block(int id, const Message& message);
  bool take_solution(Block block, bool is_cartesian, GpsTime time, HostTime received);
  bool take_fix(Block block, bool is_cartesian, GpsTime time, HostTime received);
  bool take_covariance(Block block, bool is_cartesian, GpsTime time);
  bool take_mark(Block block, GpsTime time, HostTime received);
  void give_fix();
  void label(GpsTime time, HostTime received);

  std::optional<GnssFix> fix_;  // waits for its covariance
  std::optional<GpsTime> last_fix_, last_solution_;
  bool has_covariance_ = false;
  SecondLabels seconds_;
  std::optional<std::chrono::seconds> utc_offset_;
  std::optional<bool> is_fine_;  // by the latest ReceiverTime
  bool has_no_time_ = false;
};

}  // namespace hueline::drivers
