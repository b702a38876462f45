#pragma once

#include <string>

#include "core/keys.hpp"

namespace hueline::drivers {

/// The messages that a u-blox receiver is asked for. Without `port` it is asked in the way of the generations 6 to 9
/// (CFG-MSG, CFG-RATE), which concerns the port that it is asked on; with `port` in the way of the generations 9 and 10
/// (CFG-VALSET, in the volatile layer). A message that the receiver does not have becomes a fault: it answers with
/// ACK-NAK.
struct UbloxLogs {
  enum class Port { Asked, Uart1, Uart2, Usb };
  Port port = Port::Asked;
  double rate_hz = 5;            ///< of navigation epochs
  bool event_marks = true;       ///< TIM-TM2
  bool attitude = false;         ///< NAV-ATT and ESF-STATUS
  bool raw_observations = true;  ///< RXM-RAWX and RXM-SFRBX
  bool raw_sensors = false;      ///< ESF-MEAS

  void visit(Keys& keys);
  KeyError validate() const { return check_keys(*this); }
  /// Returns the bytes to send.
  std::string dialogue() const;
};

}  // namespace hueline::drivers
