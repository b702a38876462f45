#pragma once

#include <deque>
#include <utility>

#include "core/time.hpp"

namespace hueline::survey {

/// Chooses one of every so many moments of a head. Exposures of several cameras that belong to one moment are chosen or
/// left together. The choice depends on the exposures alone. Thread safety: none.
class SomeMoments {
 public:
  /// One moment in `every` is chosen, beginning with the third or, if `every` is smaller, the last of the first
  /// `every`. Exposures nearer than `together` are one moment.
  SomeMoments(int every, nanoseconds together) : every_(every), together_(together) {}
  /// Returns whether the moment of the exposure with this middle is chosen. Call it once for each exposure, in the
  /// order in which they come.
  bool chooses(GpsTime mid);

 private:
  int every_;
  nanoseconds together_;
  std::uint64_t count_ = 0;
  std::deque<std::pair<GpsTime, bool>> recent_;
};

}  // namespace hueline::survey
