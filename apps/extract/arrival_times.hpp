#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "config/rig.hpp"
#include "core/decoder.hpp"
#include "core/packet.hpp"
#include "runtime/recording.hpp"
#include "sync/synchroniser.hpp"

namespace hueline::apps {

/// The time by UTC at which packets of a recording arrived, by the clock of the drive itself: its pulses and the second
/// that each of them is. Thread safety: none; one thread calls all functions.
class ArrivalTimes {
 public:
  /// Reads the recording until its clock is known, because the packets before that have a time too, and starts it
  /// again. Errors: those of the recording, except that it is cut or damaged.
  static Result<ArrivalTimes> open(runtime::Recording& recording);

  /// Takes the packets of the recording, from its beginning, in their order.
  void take(const Packet& packet);
  /// Returns when a packet arrived that was received at `t`, the newest that was taken. What came before the clock was
  /// known has the clock's first relation. Empty if it is never known in this recording.
  std::optional<UnixTime> of(HostTime t) const;

 private:
  explicit ArrivalTimes(const config::Rig& rig);

  std::vector<std::unique_ptr<Decoder>> decoders_;  // by SensorId; empty for cameras, which say nothing of the clock
  sync::Synchroniser synchroniser_;
  std::vector<Measurement> measured_;
  sync::SyncOutput synchronised_;
  std::optional<nanoseconds> first_;  // UTC since 1970 minus host time, when the clock was first known
};

}  // namespace hueline::apps
