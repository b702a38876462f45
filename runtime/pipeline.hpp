#pragma once

#include <deque>
#include <memory>
#include <vector>

#include "config/rig.hpp"
#include "core/decoder.hpp"
#include "core/packet.hpp"
#include "fusion/colouring.hpp"
#include "runtime/fault_rate.hpp"
#include "runtime/products.hpp"
#include "runtime/summary.hpp"
#include "sync/synchroniser.hpp"

namespace hueline::runtime {

/// decode -> sync -> fusion -> products, one packet at a time. The products are a function of the packets alone: it
/// reads no clock, opens no file; colouring's workers do not show. Thread-bound.
class Pipeline {
 public:
  /// `sink` must outlive it. `threads`: colouring's workers.
  Pipeline(const config::Rig& rig, int threads, ProductSink& sink);
  ~Pipeline();

  /// Packets in journal order. Shed ones change nothing.
  void process(const Packet& packet);
  /// The journal is over: everything held back is decided now.
  void flush();

  /// Decoders' counts and what could not be placed, for the summary; after flush().
  void report(Summary& summary) const;
  /// What a sensor's decoder made of its bytes; nullptr: no decoder.
  const DecodeCounts* counts(SensorId sensor) const;

 private:
  void take_fault(const Packet& packet, Decoder* decoder);
  void take_measurements();
  void take_synchronised();
  void give_settled(bool everything);
  void tell(Fault fault);
  void tell_held();
  const char* why_no_solution() const;
  void note_pos(Summary& summary) const;

  ProductSink& sink_;
  const SensorId pos_;
  std::vector<std::unique_ptr<Decoder>> decoders_;  // by SensorId; null for the system
  sync::Synchroniser synchroniser_;
  const nanoseconds max_lateness_;
  fusion::Colouring colouring_;
  std::deque<Exposure> unsettled_exposures_;         // without their images
  std::deque<StampedLaserBatch> unsettled_batches_;  // for a sink that wants them
  std::vector<Measurement> measurements_;
  sync::SyncOutput synchronised_;
  HostTime newest_{};
  FaultRate faults_;  // of those that are made here; those of the journal were held to the rate when they entered
  bool told_origin_ = false;
};

}  // namespace hueline::runtime
