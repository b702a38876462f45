#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "core/time.hpp"
#include "sync/camera_relation.hpp"

namespace hueline::sync {

/// Finds the first relation of a camera's counter to event marks from arrivals: each image votes for the difference to
/// every mark that its latency allows. Reentrant; bounded memory.
class RelationLearner {
 public:
  struct Config {
    nanoseconds latency_min, latency_max;  ///< mark to arrival
    nanoseconds tolerance;                 ///< of one difference
    int images;                            ///< that must agree
  };
  explicit RelationLearner(Config config) : config_(config) {}

  void add(std::int64_t counter_ns, GpsTime arrival);
  void reset() { images_.clear(); }

  /// Pairs of the one difference that enough images agree on, that has no rival of half as many votes, and that no
  /// image refutes; empty if there is none. `marks` by time.
  /// `few_suffice`, for when there is no time, or there are no images, to wait for: three images or more will do where
  /// nothing can be mistaken, no image has two marks that its latency allows, and all that have one agree.
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
  std::deque<Seen> images_;  // newest 64
};

}  // namespace hueline::sync
