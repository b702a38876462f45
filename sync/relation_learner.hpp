#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "core/time.hpp"
#include "sync/camera_relation.hpp"

namespace hueline::sync {

/// Finds the first relation of a camera's counter to event marks from arrivals. Each image votes for its difference to
/// every mark that its latency allows. Memory is bounded. Thread safety: one thread per object.
class RelationLearner {
 public:
  struct Config {
    nanoseconds latency_min, latency_max;  ///< from mark to arrival
    nanoseconds tolerance;                 ///< of one difference
    int images;                            ///< how many must agree
  };
  explicit RelationLearner(Config config) : config_(config) {}

  void add(std::int64_t counter_ns, GpsTime arrival);
  void reset() { images_.clear(); }

  /// Returns the pairs of the one difference on which enough images agree, which has no rival with half as many votes,
  /// and which no image refutes; empty if there is none. `marks` are in order of time.
  /// With `few_suffice`, three images are enough if nothing can be mistaken: no image has two marks that its latency
  /// allows, and all images that have a mark agree. This is for cases in which there is no time, or there are no
  /// images, to wait for.
  std::vector<CameraRelation::Pair> learn(const std::vector<GpsTime>& marks, bool few_suffice) const;

 private:
  struct Seen {
    std::int64_t counter;
    GpsTime arrival;
  };
  struct Vote {
    std::int64_t difference;
    std::size_t image;
    GpsTime mark;
  };
  std::vector<Vote> votes(const std::vector<GpsTime>& marks) const;
  std::vector<CameraRelation::Pair> pairs_of_many(const std::vector<Vote>& votes) const;
  std::vector<CameraRelation::Pair> pairs_of_few(const std::vector<Vote>& votes) const;
  bool is_refuted(std::int64_t difference) const;
  Config config_;
  std::deque<Seen> images_;  // the newest 64
};

}  // namespace hueline::sync
