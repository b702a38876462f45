#include "drivers/arrival_watch.hpp"

#include <fmt/format.h>

namespace hueline::drivers {

std::string ArrivalWatch::Finding::words(std::string_view clock) const {
  if (kind == FaultKind::ClockStep)
    return fmt::format("{} moved {:.6f} s against the arrivals", clock, to_seconds(moved));
  return fmt::format("a packet came {:.3f} s later than {} says: a network or a computer held it back",
                     -to_seconds(moved), clock);
}

std::optional<ArrivalWatch::Finding> ArrivalWatch::add(nanoseconds passed, nanoseconds waited) {
  const nanoseconds moved = passed - waited;
  if (moved < -kJitter && passed < nanoseconds(0)) {
    fallen_.reset();
    return Finding{FaultKind::ClockStep, moved};
  }
  if (moved < -kJitter) {
    fallen_ = Fallen{(fallen_ ? fallen_->behind : nanoseconds(0)) - moved, nanoseconds(0)};
    return Finding{FaultKind::Silent, moved};
  }
  if (!fallen_) return moved > kJitter ? std::optional(Finding{FaultKind::ClockStep, moved}) : std::nullopt;
  fallen_->behind -= moved;
  fallen_->since += waited;
  const Fallen now = *fallen_;
  const bool is_back = now.behind <= kJitter;
  if (!is_back && now.since <= kBurst) return {};
  fallen_.reset();
  const bool has_jumped = !is_back || now.behind < -kJitter;
  return has_jumped ? std::optional(Finding{FaultKind::ClockStep, -now.behind}) : std::nullopt;
}

}  // namespace hueline::drivers
