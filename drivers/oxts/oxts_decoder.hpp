#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "core/keys.hpp"
#include "drivers/stream/second_labels.hpp"
#include "drivers/stream/stream_decoder.hpp"

namespace hueline::drivers {

/// Decodes NCOM, the output of OxTS inertial systems, from UDP, a serial port or a file.
///
///   what comes                                        measurement
///   a packet of the navigation                        InsSolution, with the sigmas of channels 3, 4 and 5
///   the first packet of a second                      TimeLabel
///   channels 24, 43: the edges at the trigger input   EventMark, input 1 (falling) and 2 (rising)
///   bytes that are skipped                            Fault Malformed, with their number
///   packets that never came                           Fault Lost, judged by their period
///   no minute of channel 0 yet, or none since a gap   Fault NoTime; nothing is emitted
///   another minute than the packets before let expect Fault LabelConflict
///
/// A packet has the time within its minute only; channel 0 says the minute, about every second. Behind a gap of more
/// than 5 s it is not known how many minutes have passed, so the next channel 0 is waited for. Packets that a trigger
/// caused (states 20 to 22) repeat the solution at the time of the trigger and are not used: the channels have the time
/// more finely. NCOM stamps triggers with a resolution of 4 us.
class OxtsDecoder final : public StreamDecoder {
 public:
  struct Config {
    bool accepts_locking = false;  ///< also call a solution good while the system is "locking"
    void visit(Keys& keys);
    KeyError validate() const { return check_keys(*this); }
  };
  explicit OxtsDecoder(const Config& config);

 private:
  using Content = std::span<const std::byte>;
  /// Sigmas of one kind, and when they came.
  struct Sigma {
    std::array<double, 3> values{};
    GpsTime time{};
  };

  bool take(const Message& message) override;
  void forget() override;
  bool take_channel(int channel, Content content, int ms, int state, HostTime received);
  void take_sigma(std::optional<Sigma>& sigma, Content content, double unit);
  std::optional<std::int64_t> carried_minute(int milliseconds) const;
  std::optional<GpsTime> time_of(int milliseconds);
  bool take_solution(Content packet, int state, GpsTime time, HostTime received);

  const Config config_;
  std::optional<std::int64_t> minute_;  // since 1980-01-06, of the latest packet
  int latest_ms_ = 0;
  std::optional<GpsTime> latest_;
  HostTime latest_received_{};
  std::optional<Sigma> position_, velocity_, attitude_;
  std::array<std::optional<std::uint8_t>, 2> triggers_{};  // counters of the two channels
  SecondLabels seconds_;
  bool has_no_time_ = false;
};

}  // namespace hueline::drivers
