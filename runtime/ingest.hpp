#pragma once

#include <map>
#include <mutex>
#include <vector>

#include "core/bounded_queue.hpp"
#include "core/packet.hpp"
#include "runtime/fault_rate.hpp"

namespace hueline::runtime {

using PacketQueue = BoundedQueue<PacketPtr>;

/// Where interleaving is decided, once: gives each packet its sequence, decides whether it is shed, and hands it to the
/// recorder first and to the pipeline second. Thread-safe; never waits for either of them.
///
/// Rules, so that a replay of the record gives what the live run gave:
/// - What the recorder's queue refuses is not given to the pipeline either. Its sequence stays a gap, counted, and told
/// by a
///   Fault{Overflow} as soon as there is room.
/// - What the pipeline has no room for is recorded with `shed` set and not given to it; a replay leaves it out
/// likewise. Packets
///   of sheddable sensors (images, lasers) are shed from three quarters of the queue on, all others only when it is
///   full.
/// - Faults are recorded at the rate that FaultRate promises, whoever makes them; Disconnected, Reconnected and Silent,
/// which a
///   reader makes and decoders act on, each at once.
/// - A stamp that a source gives may be wrong, this computer's own time of its arrival is not: nothing is recorded as
/// received later
///   than it arrived, or more than a minute before. Behind Ingest stream time is never ahead of the computer's clock.
class Ingest {
 public:
  struct Sensor {
    bool is_sheddable = false;
  };
  struct Counts {
    std::uint64_t packets = 0, bytes = 0, shed = 0, refused = 0;
  };

  /// `sensors[id]`; index 0 is the system. Weights of the queues are bytes.
  Ingest(std::vector<Sensor> sensors, PacketQueue& record, PacketQueue& pipeline, PacketQueue::Limits pipeline_limits);

  /// How far a stamp may seem to lie behind its arrival (what readings of two clocks differ by), and before it (a
  /// buffer of the system that nobody emptied).
  static constexpr nanoseconds kMostAhead = std::chrono::milliseconds(1), kMostBehind = std::chrono::minutes(1);

  /// Of a device: `arrived` is the host's clock when the source gave the packet. A `received` that cannot be becomes
  /// `arrived`; the bytes stay, and a ClockStep tells it. False if the recorder's queue refused it (counted).
  bool submit(Packet packet, HostTime arrived);
  /// Of a recording, whose clock is its own, or of the program itself.
  bool submit(Packet packet);
  /// A fault noticed on this side of the record: becomes a packet like any other.
  bool submit(const Fault& fault);

  /// For sources that can wait, before each packet: until recorder and pipeline have half of their queues free, so that
  /// nothing of theirs is ever shed or refused. False if stopped or closed.
  bool wait_for_room(std::stop_token stop);

  /// No more packets come: waits for the recorder to have room and tells what was refused, and the faults not told yet.
  /// False if stopped or closed before.
  bool tell_the_rest(std::stop_token stop);

  Counts counts(SensorId sensor) const;
  std::uint64_t next_sequence() const;

 private:
  // All under mutex_.
  bool take(Packet packet);
  bool place(Packet packet);
  void tell_refused(HostTime now);
  void tell_faults();

  const std::vector<Sensor> sensors_;
  PacketQueue& record_;
  PacketQueue& pipeline_;
  const PacketQueue::Limits soft_;
  mutable std::mutex mutex_;
  std::uint64_t next_sequence_ = 0;
  std::vector<Counts> counts_;
  std::map<SensorId, std::uint64_t> refused_untold_;
  HostTime newest_{};  // arrival
  FaultRate faults_;
};

}  // namespace hueline::runtime
