#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/decoder.hpp"
#include "core/keys.hpp"
#include "drivers/can/can_cycle.hpp"
#include "drivers/can/can_errors.hpp"
#include "drivers/can/can_frame.hpp"
#include "drivers/can/can_signal.hpp"

namespace hueline::drivers {

/// A vehicle's wheel encoder on its CAN bus: speeds and pulse counts that its messages carry, as the rig describes
/// them. Each message with one of them becomes one WheelSpeed: the mean of its wheels.
///
/// Faults: Disconnected, Reconnected (bus-off, restart: from error frames), Lost (gap in a message's rolling counter
/// or, without one, in its cycle; in the gateway's count of datagrams), Spurious (a message that came again: its
/// counter stands), Malformed (too short, check sum, frames broken on the bus), Implausible (outside the signal's
/// range, faster than the vehicle can be or become, or pulses that may have wrapped meanwhile). What is doubted by one
/// of the last three gives no measurement.
class WheelDecoder final : public Decoder {
 public:
  struct Pulses {
    CanSignal
        signal;  ///< counts and begins anew at 0 behind its max, or where its bits end; scale and offset are not used
    double metres_per_pulse = 0;  ///< (0, 10]
  };
  struct Checksum {
    CanChecksum kind = CanChecksum::Xor;
    std::size_t byte = 0;  ///< that holds it
    void visit(Keys& keys);
  };
  struct Message {
    std::uint32_t id = 0;
    bool is_extended = false;       ///< 29 bits
    std::vector<CanSignal> speeds;  ///< m/s
    std::vector<Pulses> pulses;     ///< in one message of a sensor
    /// Rises by one from message to message; begins anew at its min behind its max, or at 0 where its bits end.
    std::optional<CanSignal> counter;
    std::optional<Checksum> checksum;
    KeyError validate() const;
  };
  struct Config {
    std::vector<Message> messages;
    double sigma_speed = 0.05;     ///< m/s, (0, 10]
    double max_speed = 70;         ///< m/s, (0, 200]: faster is no vehicle
    double max_acceleration = 15;  ///< m/s^2, (0, 1000]: braking and pulling away, not slipping
    void visit(Keys& keys);
    KeyError validate() const;
  };

  WheelDecoder(SensorId sensor, Config config);

  void decode(const Packet& packet, std::vector<Measurement>& out) override;
  void reset() override;
  const DecodeCounts& counts() const override { return counts_; }

 private:
  struct State {  // of one message
    std::optional<std::int64_t> counter;
    CanCycle cycle;
    std::vector<std::int64_t> pulses;
    std::optional<HostTime> pulses_at;
    std::optional<double> speed;
    HostTime speed_at{};
    int refused = 0;  // speeds in a row
    double distance_m = 0;
  };
  enum class Use { Decoded, Ignored, Malformed };

  Use take(const CanFrame& frame, HostTime received, std::vector<Measurement>& out);
  void take_error(const CanFrame& frame, HostTime received, std::vector<Measurement>& out);
  bool is_new(const Message& message, State& state, const CanFrame& frame, HostTime received,
              std::vector<Measurement>& out);
  std::optional<double> read_speed(const Message& message, State& state, const CanFrame& frame, HostTime received,
                                   std::vector<Measurement>& out);
  std::optional<double> read_distance(const Message& message, State& state, const CanFrame& frame, HostTime received,
                                      std::vector<Measurement>& out);
  void tell(FaultKind kind, HostTime time, std::uint64_t count, std::vector<Measurement>& out,
            std::string detail) const;
  bool takes_datagram(std::uint8_t sequence, HostTime received, std::vector<Measurement>& out);

  const SensorId sensor_;
  const Config config_;
  std::vector<State> states_;  // of each message
  bool is_directional_ = false;
  bool is_off_ = false;  // bus-off
  std::optional<std::uint8_t> datagram_;
  DecodeCounts counts_;
};

}  // namespace hueline::drivers
