#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

#include "sim/faults/fault.hpp"
#include "sim/wire/seeded_random.hpp"

namespace hueline::sim {

/// The disk below a file that is appended to, in drive time, spoilt by a scenario's lines. Numbers only: it says what a
/// call takes, how long, and which bytes are there afterwards; the bytes themselves are the caller's. Errors are minus
/// errno, as Linux gives them. The same lines, seed and calls give the same answers.
///
/// What is appended goes to the kernel's memory at once and from there to the medium, at once too unless a line slows
/// it; sync() waits until all of it is there, and only what a sync() covered is there for certain. A disk that turned
/// read-only says EIO to the first sync (what waited is gone) and EROFS from then on.
class FaultyDisk {
 public:
  /// Lines that do not concern the disk or the process do nothing.
  FaultyDisk(const std::vector<FaultLine>& lines, std::uint64_t seed);

  /// True of the faults that happen here, not to what the devices send.
  static bool concerns(FaultType type);

  enum class Death { None, ProcessKill, PowerCut };
  /// The first of the lines that end the program, and when.
  Death death() const { return death_; }
  std::int64_t death_ns() const { return death_ns_; }

  /// Drive time of the next calls. It does not go back; after death() nobody calls any more, and calls do nothing.
  void set_now(std::int64_t now_ns) { now_ns_ = std::max(now_ns_, now_ns); }
  /// When the latest call came back.
  std::int64_t now_ns() const { return now_ns_; }

  /// Bytes taken of so many, or -ENOSPC, -EROFS; -EIO after death.
  std::int64_t append(std::uint64_t bytes);
  /// 0, -EIO, -EROFS. If the program dies meanwhile, it never comes back.
  int sync();
  /// 0, -EROFS.
  int truncate(std::uint64_t size);
  bool is_dead() const { return death_ != Death::None && now_ns_ >= death_ns_; }

  /// What is found when the computer runs again.
  struct Remains {
    std::uint64_t size = 0;
    struct Range {
      std::uint64_t begin, end;
    };
    std::vector<Range> zeros;  ///< inside `size`: never reached the medium
  };
  /// Everything after a kill and a good end; after a power cut, or of a disk that turned read-only, what was synced and
  /// any pages of the rest, torn ones too.
  Remains remains() const;

 private:
  std::int64_t written_by(std::int64_t from_ns, double bytes) const;
  const FaultLine* line_at(FaultType type) const;

  const std::vector<FaultLine> lines_;
  const std::uint64_t seed_;
  Death death_ = Death::None;
  std::int64_t death_ns_ = INT64_MAX;
  std::int64_t now_ns_ = INT64_MIN;
  std::int64_t medium_idle_ns_ = INT64_MIN;  // when all that was appended so far will be on the medium
  std::uint64_t size_ = 0, synced_ = 0;
  bool lost_what_waited_ = false;
  std::optional<std::uint64_t> full_size_;  // of the line that is on
};

}  // namespace hueline::sim
