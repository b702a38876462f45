#pragma once

#include <map>
#include <vector>

#include "core/bounded_queue.hpp"
#include "core/mutex.hpp"
#include "core/packet.hpp"
#include "runtime/fault_rate.hpp"
#include "runtime/ledger.hpp"

namespace hueline::runtime {

using PacketQueue = BoundedQueue<PacketPtr>;

/// The one place that decides the order of packets. Ingest gives each packet its sequence, decides whether the packet
/// is shed, and hands it to the recorder first and to the pipeline second. Thread-safe. It never waits for either of
/// them.
///
/// These rules make a replay of the recording give what the live run gave:
/// - A packet that the recorder's queue refuses is not given to the pipeline either. Its sequence remains a gap. The
///   gap is counted, and a Fault{Overflow} reports it as soon as there is room.
/// - A packet for which the pipeline has no room is recorded with `shed` set and not given to the pipeline; a replay
///   leaves it out too. Packets of sheddable sensors (images, lasers) are shed when the queue is three quarters full,
///   all others only when it is full.
/// - Faults are recorded at the rate that FaultRate allows, whoever makes them. The exceptions are Disconnected,
///   Reconnected and Silent, which a reader makes and on which decoders act: each of these is recorded at once.
/// - From time to time, and at the end, the ledger is recorded: how many packets of each sensor entered and were
///   refused until then. A reader of the recording proves with it that nothing is missing (LedgerCheck).
/// - A source may give a wrong stamp, but this computer's own time of the arrival is right. So no packet is recorded as
///   received later than it arrived, or more than a minute before. Behind Ingest, stream time is never ahead of the
///   computer's clock.
class Ingest {
 public:
  /// What Ingest must know about a sensor.
  struct Sensor {
    bool is_sheddable = false;
  };

  /// `sensors` is indexed by SensorId; index 0 is the system. The weights of the queues are bytes.
  Ingest(std::vector<Sensor> sensors, PacketQueue& record, PacketQueue& pipeline, PacketQueue::Limits pipeline_limits);

  /// How far a stamp may lie after its arrival (the readings of two clocks differ by this much), and before it (a
  /// system buffer that nobody emptied).
  static constexpr nanoseconds kMostAhead = std::chrono::milliseconds(1), kMostBehind = std::chrono::minutes(1);

  /// Takes a packet of a device. `arrived` is the host's clock at the moment when the source gave the packet. If
  /// `received` is impossible, it is replaced by `arrived`; the bytes stay, and a ClockStep fault reports it. Returns
  /// false if the recorder's queue refused the packet (which is counted).
  bool submit(Packet packet, HostTime arrived);
  /// Takes a packet of a recording, which has its own clock, or of the program itself.
  bool submit(Packet packet);
  /// Takes a fault that was noticed before packets are recorded. It becomes a packet like any other.
  bool submit(const Fault& fault);
  /// Records what has entered until now, as a packet of PacketKind::Ledger with the stamp of the newest arrival.
  /// Returns false if the recorder's queue refused it.
  bool submit_ledger();

  /// Waits until recorder and pipeline have half of their queues free. Sources that can wait call this before each
  /// packet, so that none of their packets is shed or refused. Returns false if stopped or closed.
  bool wait_for_room(std::stop_token stop);

  /// Whether this fault tells of packets that the recorder's queue refused. Other faults of FaultKind::Overflow tell of
  /// packets that never came here.
  static bool is_refusal(const Fault& fault);

  /// Ends the ingest when no more packets come. Waits until the recorder has room, reports what was refused and the
  /// faults that were not reported yet, and records the ledger. Returns false if stopped or closed before that was
  /// done.
  bool tell_the_rest(std::stop_token stop);

  Ledger::Sensor counts(SensorId sensor) const;
  /// Packets of a sensor that were shed, and the bytes of their payloads; of these those of PacketKind::Wire.
  struct Shed {
    std::uint64_t packets = 0, bytes = 0, wire = 0, wire_bytes = 0;
  };
  Shed shed(SensorId sensor) const;
  /// Returns the sequence of the next packet, which is the number of packets that were accepted or refused so far.
  std::uint64_t next_sequence() const;

 private:
  bool take(Packet packet) HUELINE_REQUIRES(mutex_);
  bool place(Packet packet) HUELINE_REQUIRES(mutex_);
  bool place_ledger() HUELINE_REQUIRES(mutex_);
  void tell_refused(HostTime now) HUELINE_REQUIRES(mutex_);
  void tell_faults() HUELINE_REQUIRES(mutex_);

  const std::vector<Sensor> sensors_;
  PacketQueue& record_;
  PacketQueue& pipeline_;
  const PacketQueue::Limits soft_;
  mutable Mutex mutex_;
  std::uint64_t next_sequence_ HUELINE_GUARDED_BY(mutex_) = 0;
  Ledger ledger_ HUELINE_GUARDED_BY(mutex_);
  std::vector<Shed> shed_ HUELINE_GUARDED_BY(mutex_);
  std::map<SensorId, std::uint64_t> refused_untold_ HUELINE_GUARDED_BY(mutex_);
  HostTime newest_ HUELINE_GUARDED_BY(mutex_){};  // newest arrival
  FaultRate faults_ HUELINE_GUARDED_BY(mutex_);
};

}  // namespace hueline::runtime
