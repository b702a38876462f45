#pragma once

#include <string>

#include "core/keys.hpp"

namespace hueline::drivers {

/// The blocks that a Septentrio receiver is asked for, with the commands `setSBFOutput`. Its answers are read: a
/// command that it refuses becomes a fault.
struct SeptentrioLogs {
  std::string connection;         ///< the receiver's name of the connection that the blocks are sent on
  int period_ms = 20;             ///< of INSNavGeod
  int position_period_ms = 1000;  ///< of PVTGeodetic, PosCovGeodetic and ReceiverTime
  int raw_period_ms = 1000;       ///< of MeasEpoch; 0: not asked for
  bool event_marks = true;        ///< ExtEvent

  void visit(Keys& keys);
  KeyError validate() const;
  /// Returns the commands to send.
  std::string dialogue() const;
};

}  // namespace hueline::drivers
