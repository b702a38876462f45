#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/decoder.hpp"
#include "drivers/can/can_frame.hpp"

namespace hueline::drivers {

/// The common part of decoders of a CAN bus: it takes packets apart, accounts for every byte, follows the gateway's
/// counter, and reports what the bus's controller reports. A decoder of a device only says what a frame means.
///
/// Faults:
/// - Disconnected, Reconnected: bus-off and restart, from error frames.
/// - Lost: a gap in the gateway's counter of datagrams, or the controller's buffer was full.
/// - Spurious: a datagram of the gateway came again or late; it is not used.
/// - Malformed: a packet is cut short, or frames break on the bus.
class CanDecoder : public Decoder {
 public:
  void decode(const Packet& packet, std::vector<Measurement>& out) final;
  void reset() final;
  const DecodeCounts& counts() const final { return counts_; }

 protected:
  /// What became of a frame's bytes.
  enum class Use { Decoded, Ignored, Malformed };

  /// Takes the next frame that was on the bus.
  virtual Use take(const CanFrame& frame, HostTime received, std::vector<Measurement>& out) = 0;
  /// Takes a packet that holds no frames. Returns whether it is one.
  virtual bool take_other(const Packet& packet, std::vector<Measurement>& out) {
    (void)packet, (void)out;
    return false;
  }
  /// Is called before the frames of a packet are taken.
  virtual void prepare(HostTime received, std::vector<Measurement>& out) { (void)received, (void)out; }
  /// Forgets what belongs to the frames so far, because the source was opened again.
  virtual void forget() {}

  /// Appends a fault of this sensor.
  void tell(FaultKind kind, HostTime time, std::uint64_t count, std::vector<Measurement>& out,
            std::string detail) const;
  SensorId sensor() const { return sensor_; }
  /// Counts a message that is no frame under a name.
  void count(const std::string& name) { ++counts_.of(name); }

 private:
  Use take_any(const CanFrame& frame, HostTime received, std::vector<Measurement>& out);
  void take_error(const CanFrame& frame, HostTime received, std::vector<Measurement>& out);
  bool takes_datagram(std::uint8_t sequence, HostTime received, std::vector<Measurement>& out);

  SensorId sensor_ = kSystemSensor;  // of the packet that is decoded, or was last
  bool is_off_ = false;              // whether the bus is off
  std::optional<std::uint8_t> datagram_;
  DecodeCounts counts_;
};

}  // namespace hueline::drivers
