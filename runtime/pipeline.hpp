#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "config/rig.hpp"
#include "core/decoder.hpp"
#include "core/packet.hpp"
#include "fusion/colouring.hpp"
#include "runtime/drive_watch.hpp"
#include "runtime/fault_rate.hpp"
#include "runtime/health.hpp"
#include "runtime/post_trajectory.hpp"
#include "runtime/products.hpp"
#include "runtime/summary.hpp"
#include "sync/synchroniser.hpp"

namespace hueline::runtime {

/// Decodes, synchronises and fuses, one packet at a time, and gives the products to a sink. The products are a function
/// of the packets alone: the pipeline reads no clock and opens no file, and the number of colouring workers does not
/// change them.
/// Thread safety: none; one thread calls all functions.
class Pipeline {
 public:
  /// `threads` is the number of colouring workers. `sink` must outlive the pipeline.
  /// With `trajectory`, which must outlive the pipeline too, poses come from it; the POS's solutions then serve the
  /// clocks and the health only.
  Pipeline(const config::Rig& rig, int threads, ProductSink& sink, PostTrajectory* trajectory = nullptr);
  ~Pipeline();

  /// Takes a packet; packets must come in journal order. A packet that is marked as shed changes nothing.
  void process(const Packet& packet);
  /// Ends the journal. Everything that was held back is decided now.
  void flush();

  /// Adds the decoders' counts, and the returns that could not be placed, to the summary. Call it after flush().
  void report(Summary& summary) const;
  /// Returns the counts of a sensor's decoder; nullptr if the sensor has none.
  const DecodeCounts* counts(SensorId sensor) const;
  /// Returns what was wrong so far; after flush(), of the whole drive.
  const Health& health() const { return health_; }
  const sync::Synchroniser& synchroniser() const { return synchroniser_; }

 private:
  void take_command(const Packet& packet);
  void take_fault(const Packet& packet, Decoder* decoder);
  void take_measurements();
  void take_synchronised();
  void take_solution(const InsSolution& solution);
  void give_settled(bool everything);
  void take_faults();
  void tell(Fault fault);
  void tell_held();
  void give(const Fault& fault);
  void tell_health();
  const char* why_no_solution() const;
  void note_pos(Summary& summary) const;
  void note_scanners(Summary& summary) const;

  ProductSink& sink_;
  PostTrajectory* const trajectory_;  // null: the POS's solutions are used
  const SensorId pos_;
  const char* solutions_ = "";                      // which messages of the POS make navigation solutions
  bool has_laser_ = false;                          // the rig has a scanner
  std::vector<std::unique_ptr<Decoder>> decoders_;  // by SensorId; null for the system
  sync::Synchroniser synchroniser_;
  const nanoseconds max_lateness_;
  fusion::Colouring colouring_;
  std::optional<DriveWatch> watch_;                  // empty: nothing is watched
  std::deque<Exposure> unsettled_exposures_;         // without their images
  std::deque<StampedLaserBatch> unsettled_batches_;  // only if the sink asks for them
  std::vector<Measurement> measurements_;
  sync::SyncOutput synchronised_;
  HostTime newest_{};
  FaultRate faults_;  // faults that are made here; those of the journal were limited when they entered it
  Health health_;
  bool told_origin_ = false;
};

}  // namespace hueline::runtime
