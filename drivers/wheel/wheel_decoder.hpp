#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/keys.hpp"
#include "drivers/can/can_cycle.hpp"
#include "drivers/can/can_decoder.hpp"
#include "drivers/can/can_signal.hpp"
#include "drivers/wheel/wheel_signal.hpp"

namespace hueline::drivers {

/// Decodes a vehicle's wheel encoder on its CAN bus: speeds and pulse counts, whose messages and signals the rig
/// describes, or names in a database (DBC). Each message with one of them becomes one WheelSpeed, the mean of its
/// wheels.
///
/// Faults, besides those of the bus (CanDecoder):
/// - Lost: a gap in a message's counter or, without a counter, in its period.
/// - Spurious: a message came again, so its counter did not change.
/// - Malformed: a message is too short, or its check sum is wrong.
/// - Implausible: a value outside the signal's range, a speed or acceleration that the vehicle cannot have, or pulses
///   that may have wrapped meanwhile.
/// - WrongDevice: the signals are named, and the database does not describe them, or is not there.
///
/// What one of the three before the last faults concerns gives no measurement.
class WheelDecoder final : public CanDecoder {
 public:
  /// A count of wheel pulses.
  struct Pulses {
    /// The pulse counter. It starts again at its min after its max, or at 0 where its bits end. Scale and offset are
    /// not used.
    WheelSignal signal;
    double metres_per_pulse = 0;  ///< greater than 0, at most 10
  };
  /// How a message is checked.
  struct Checksum {
    CanChecksum kind = CanChecksum::Xor;
    std::size_t byte = 0;  ///< position of the byte that holds the check sum
    void visit(Keys& keys);
  };
  /// One message of the bus that has signals of the wheels.
  struct Message {
    std::uint32_t id = 0;
    bool is_extended = false;         ///< the id has 29 bits
    std::vector<WheelSignal> speeds;  ///< in m/s
    std::vector<Pulses> pulses;       ///< in one message of a sensor at most
    /// A counter that grows by one from message to message. It starts again at its min after its max, or at 0 where its
    /// bits end.
    std::optional<WheelSignal> counter;
    std::optional<Checksum> checksum;
    /// Returns the names of the signals that a database describes.
    std::vector<std::string> names() const;
    KeyError validate() const;
  };
  struct Config {
    /// Path of the DBC file that describes the named signals. The decoder does not read it: a packet brings its text.
    std::string database;
    std::vector<Message> messages;
    double sigma_speed = 0.05;  ///< m/s, greater than 0, at most 10
    double max_speed = 70;      ///< m/s, greater than 0, at most 200; a faster speed is not used
    /// M/s^2, greater than 0, at most 1000; of braking and pulling away, not of slipping wheels.
    double max_acceleration = 15;
    void visit(Keys& keys);
    KeyError validate() const;
    /// Returns whether signals are named.
    bool has_names() const;
    /// Returns the messages, with the bits of the named signals from the text of a DBC file. Error: Invalid, which
    /// names the signal.
    Result<std::vector<Message>> find_signals(std::string_view dbc) const;
  };

  explicit WheelDecoder(Config config);
  void flush(std::vector<Measurement>& out) override;

 private:
  /// The state of one message.
  struct State {
    std::optional<std::int64_t> counter;
    std::int64_t counted = 0;  // what the counter has told of the latest gap
    CanCycle cycle;
    std::vector<std::int64_t> pulses;
    std::optional<HostTime> pulses_at;
    std::optional<double> speed;
    HostTime speed_at{};
    int refused = 0;  // number of speeds refused in a row
    double distance_m = 0;
  };
  Use take(const CanFrame& frame, HostTime received, std::vector<Measurement>& out) override;
  bool take_other(const Packet& packet, std::vector<Measurement>& out) override;
  void prepare(HostTime received, std::vector<Measurement>& out) override;
  void forget() override;
  void tell_missing(const Message& message, State& state, std::int64_t count, HostTime time,
                    std::vector<Measurement>& out) const;
  bool is_new(const Message& message, State& state, const CanFrame& frame, HostTime received,
              std::vector<Measurement>& out);
  std::optional<double> read_speed(const Message& message, State& state, const CanFrame& frame, HostTime received,
                                   std::vector<Measurement>& out);
  std::optional<double> read_distance(const Message& message, State& state, const CanFrame& frame, HostTime received,
                                      std::vector<Measurement>& out);
  void take_database(std::string_view text, HostTime received, std::vector<Measurement>& out);
  void use(std::vector<Message> messages);

  const Config config_;
  std::vector<Message> messages_;  // with the bits of all signals; empty until they are known
  std::vector<State> states_;      // one for each message
  bool is_waiting_told_ = false;   // frames came before the database, and this was told
  bool is_directional_ = false;
};

}  // namespace hueline::drivers
