#include "drivers/trajectory/sbet_solutions.hpp"

#include <chrono>
#include <utility>

#include "core/calendar.hpp"
#include "core/geodesy.hpp"

namespace hueline::drivers {
namespace {
constexpr nanoseconds kLongestGap{1'000'000'000};  // over which a velocity is taken
}

SbetSolutions::One SbetSolutions::solution_of(const SbetRecord& record) const {
  One out;
  InsSolution& solution = out.solution;
  out.wander = record.wander;
  solution.time = from_gps_week(config_.week, from_seconds(record.second));
  if (config_.is_utc) solution.time += utc_offset_from_table(solution.time);
  solution.attitude = {record.roll, record.pitch, record.platform_heading - record.wander};
  solution.position = record.position;
  if (!config_.point_body.xyz.isZero()) {
    const Transform<Ecef, Enu> T_ecef_enu = ecef_from_enu(record.position);
    solution.position =
        to_geodetic(T_ecef_enu * Point<Enu>{rotation_enu_body(solution.attitude) * -config_.point_body.xyz});
  }
  solution.is_good = true;
  solution.sigma = record.sigma;
  return out;
}

std::optional<SbetSolutions::One> SbetSolutions::move_on(std::optional<One> next) {
  std::optional<One> out = std::exchange(here_, std::move(next));
  if (!out) return out;
  const auto is_near = [&](const std::optional<One>& other) {
    return other && std::chrono::abs(other->solution.time - out->solution.time) <= kLongestGap;
  };
  const InsSolution& from = is_near(before_) ? before_->solution : out->solution;
  const InsSolution& to = is_near(here_) ? here_->solution : out->solution;
  if (from.time != to.time) {
    const Vector<Ecef> way = to_ecef(to.position) - to_ecef(from.position);
    out->solution.velocity_enu =
        (ecef_from_enu(out->solution.position).inverse() * way).xyz / to_seconds(to.time - from.time);
  }
  before_ = out;
  return out;
}

std::optional<SbetSolutions::One> SbetSolutions::take(const SbetRecord& record) { return move_on(solution_of(record)); }
std::optional<SbetSolutions::One> SbetSolutions::finish() { return move_on({}); }

}  // namespace hueline::drivers
