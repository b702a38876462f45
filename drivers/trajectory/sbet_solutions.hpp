#pragma once

#include <optional>

#include "core/frames.hpp"
#include "core/measurements.hpp"
#include "drivers/trajectory/sbet_record.hpp"

namespace hueline::drivers {

/// Makes navigation solutions of the records of an SBET. Each comes when the next record has come, because the velocity
/// is that of the places before and after. Thread safety: none.
class SbetSolutions {
 public:
  struct Config {
    int week = 0;            ///< GPS week in which the file's seconds begin
    bool is_utc = false;     ///< they are seconds of the same week in UTC
    Point<Body> point_body;  ///< the point whose places the file has, in Body, m
  };
  /// A solution with its heading as POSPac writes it, the platform heading minus the wander angle, and that angle.
  struct One {
    InsSolution solution;
    double wander = 0;
  };

  explicit SbetSolutions(const Config& config) : config_(config) {}

  /// Takes the next record, in order of time. Returns the solution of the one before; nothing at the first.
  std::optional<One> take(const SbetRecord& record);
  /// Returns the solution of the last record; nothing if there was none.
  std::optional<One> finish();

 private:
  One solution_of(const SbetRecord& record) const;
  std::optional<One> move_on(std::optional<One> next);

  const Config config_;
  std::optional<One> before_, here_;
};

}  // namespace hueline::drivers
