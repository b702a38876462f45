#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

#include "sim/faults/fault.hpp"
#include "sim/wire/seeded_random.hpp"

namespace hueline::sim {

/// Simulates the disk below a file that is appended to, with the faults of a scenario, in drive time. It computes only
/// numbers: how many bytes a call accepts, how long it takes, and which bytes exist afterwards. The caller keeps the
/// bytes themselves. Errors are negative errno values, as Linux gives them. Equal lines, seeds and calls give equal
/// answers.
///
/// Appended bytes enter the kernel's memory at once. From there they reach the medium, also at once unless a line slows
/// it. `sync()` waits until all of them are on the medium; only bytes that a `sync()` covered are certain to survive. A
/// disk that turned read-only answers EIO to the first `sync()`, because the waiting bytes are lost, and EROFS to
/// everything after it.
class FaultyDisk {
 public:
  /// Ignores lines that concern neither the disk nor the process.
  FaultyDisk(const std::vector<FaultLine>& lines, std::uint64_t seed);

  /// Returns true for faults that happen in this class and not to what the devices send.
  static bool concerns(FaultType type);

  /// How the program ends.
  enum class Death { None, ProcessKill, PowerCut };
  /// Returns how the program ends by the earliest of the lines that end it; `death_ns()` says when.
  Death death() const { return death_; }
  std::int64_t death_ns() const { return death_ns_; }

  /// Sets the drive time of the next calls. Time never goes back. After `death_ns()` calls change nothing.
  void set_now(std::int64_t now_ns) { now_ns_ = std::max(now_ns_, now_ns); }
  /// Returns the drive time at which the latest call returned.
  std::int64_t now_ns() const { return now_ns_; }

  /// Appends `bytes` bytes. Returns how many were accepted, or -ENOSPC, or -EROFS; -EIO after the program's end.
  std::int64_t append(std::uint64_t bytes);
  /// Returns 0, -EIO or -EROFS. Returns -EIO with the time at `death_ns()` if the program ends while it waits.
  int sync();
  /// Returns 0 or -EROFS; -EIO after the program's end.
  int truncate(std::uint64_t size);
  bool is_dead() const { return death_ != Death::None && now_ns_ >= death_ns_; }

  /// The content of the file when the computer runs again.
  struct Remains {
    std::uint64_t size = 0;
    struct Range {
      std::uint64_t begin, end;
    };
    std::vector<Range> zeros;  ///< ranges inside `size` that never reached the medium
  };
  /// Returns what is left. After a kill or a regular end that is everything. After a power cut, or on a disk that
  /// turned read-only, it is what was synced and any of the other pages, some of them torn.
  Remains remains() const;

 private:
  std::int64_t written_by(std::int64_t from_ns, double bytes) const;
  const FaultLine* line_at(FaultType type) const;

  const std::vector<FaultLine> lines_;
  const std::uint64_t seed_;
  Death death_ = Death::None;
  std::int64_t death_ns_ = INT64_MAX;
  std::int64_t now_ns_ = INT64_MIN;
  std::int64_t medium_idle_ns_ = INT64_MIN;  // when everything that was appended so far will be on the medium
  std::uint64_t size_ = 0, synced_ = 0;
  bool lost_what_waited_ = false;
  std::optional<std::uint64_t> full_size_;  // set while a DiskFull line is active
};

}  // namespace hueline::sim
