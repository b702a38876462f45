#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "core/result.hpp"
#include "core/time.hpp"

namespace hueline::sync {

/// A whole second of GPS time, as the clock of one computer read it.
struct SecondSeen {
  std::int64_t second = 0;  ///< GPS seconds since 1980-01-06
  HostTime at{};            ///< the computer's clock at that second
  nanoseconds sigma{0};     ///< one sigma of `at`
};

/// Tag of the clock of another computer of the vehicle, which is a counter like that of any device.
struct OtherComputer {};
using OtherTime = DeviceTime<OtherComputer>;

/// Restates the clock of another computer in the clock of the first. Both counted the same seconds of GPS time, and the
/// difference of their clocks at these seconds is all that is used. It is a chain of straight lines between knots: at
/// each knot a line is fitted to the differences of the seconds around it, and differences that are far off the line
/// are left out. So one wrong edge changes nothing, and two oscillators may wander against each other as they warm up.
/// If all differences are the same, the result is that difference to the nanosecond.
///
/// The same input always gives the same result. Thread-safe: it does not change after it was made.
class ClockRelation {
 public:
  struct Config {
    std::chrono::seconds around{60};   ///< how far from a knot a second may lie that is used for it
    std::chrono::seconds spacing{30};  ///< largest distance of two knots while seconds come
    std::size_t least_seconds = 5;     ///< common seconds that are needed, of all and for each knot
    double least_share = 0.6;          ///< share of the seconds around a knot that must fit its line
    double rate_limit = 4e-4;          ///< largest believable difference of the clocks' rates
    /// How much the difference of the rates is taken to change, at one sigma, while no second tells.
    double wander = 1e-7;
    double step_rate = 1e-6;  ///< a larger change of rate from one knot to the next is a step of a clock
    nanoseconds most_sigma{std::chrono::milliseconds(20)};  ///< a relation that is known less well is refused
  };
  /// A point of the relation.
  struct Knot {
    OtherTime at{};
    nanoseconds offset{0};  ///< first clock minus other clock at `at`, rounded
    double rate = 0;        ///< change of the offset, s/s
    double sigma_ns = 0;    ///< one sigma of the offset
    double rate_sigma = 0;  ///< one sigma of the rate
    std::size_t seconds = 0, left_out = 0;
  };

  /// The relation of a clock to itself.
  ClockRelation() = default;

  /// Finds the relation from the seconds that both clocks read. The lists are in the order of their seconds. Errors:
  /// Invalid if there are too few common seconds; Malformed if the clocks contradict each other, so that one of them
  /// stepped or counts another second; Unsupported if sigma is too large. The messages are clauses about the two.
  static Result<ClockRelation> fit(const std::vector<SecondSeen>& first, const std::vector<SecondSeen>& other,
                                   const Config& config);
  static Result<ClockRelation> fit(const std::vector<SecondSeen>& first, const std::vector<SecondSeen>& other) {
    return fit(first, other, Config());
  }

  /// Returns the time of the first clock. It is later for a later `other`. Times that no computer can have, 73 years
  /// and more, are taken for the farthest that it can.
  HostTime convert(OtherTime other) const;
  /// Returns one sigma of convert(). It grows before the first and after the last common second, and in long gaps.
  nanoseconds sigma(OtherTime other) const;

  const std::vector<Knot>& knots() const { return knots_; }  ///< in the order of time; empty: the same clock
  std::size_t common_seconds() const { return common_seconds_; }
  std::size_t left_out() const { return left_out_; }  ///< of these, those that no knot could use
  /// Mean rate from the first knot to the last, s/s: of the first clock per the other, minus 1.
  double rate() const;

 private:
  struct Place {
    std::size_t left = 0, right = 0;          // the knots at both sides, or the nearest one twice
    double after_left = 0, before_right = 0;  // ns; negative outside
  };
  Place place_of(OtherTime other) const;
  static OtherTime possible(OtherTime other);

  std::vector<Knot> knots_;
  std::vector<double> offsets_ns_;  // of the knots, relative to base_
  nanoseconds base_{0};
  double wander_ = 0;
  std::size_t common_seconds_ = 0, left_out_ = 0;
};

}  // namespace hueline::sync
