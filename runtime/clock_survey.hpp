#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "config/rig.hpp"
#include "core/decoder.hpp"
#include "core/packet.hpp"
#include "sync/clock_relation.hpp"
#include "sync/synchroniser.hpp"

namespace hueline::runtime {

/// Finds in a recording what the clock of its computer was at whole seconds of GPS time, with the models by which the
/// drive itself is stamped: pulses, and the labels that name their seconds; where pulses are missing, the arrivals of
/// timed messages. Only what tells of the clock is decoded, so no image is. It keeps 24 bytes for each second.
/// Thread safety: none; one thread calls all functions.
class ClockSurvey {
 public:
  explicit ClockSurvey(const config::Rig& rig);

  /// Takes the packets of the recording in their order.
  void take(const Packet& packet);

  /// The seconds so far, in their order.
  const std::vector<sync::SecondSeen>& seconds() const { return seconds_; }
  /// Of these, those that are edges of pulses. The others come from arrivals, and are accurate to milliseconds.
  std::size_t by_pulses() const { return by_pulses_; }
  /// Returns why there are none, as a clause for people.
  std::string why_none() const { return synchroniser_.clock().why_not(); }

 private:
  void take_edges();
  void take_arrivals(HostTime now);
  void relabel();
  std::int64_t second_of(HostTime at) const;
  void add(std::int64_t second, HostTime at, nanoseconds sigma);

  const SensorId pps_;
  const nanoseconds edge_delay_;
  std::vector<std::unique_ptr<Decoder>> decoders_;  // by SensorId; null for those that say nothing of the clock
  sync::Synchroniser synchroniser_;
  std::vector<Measurement> measured_;
  sync::SyncOutput synchronised_;
  std::deque<HostTime> waiting_;  // pulses whose second is not known yet
  std::vector<sync::SecondSeen> seconds_;
  std::size_t by_pulses_ = 0, since_restart_ = 0;
  std::uint64_t restarts_ = 0, relabels_ = 0;
};

}  // namespace hueline::runtime
