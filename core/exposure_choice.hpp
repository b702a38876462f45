#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/result.hpp"
#include "core/time.hpp"

namespace hueline {

/// Which exposures of a drive a command takes.
struct ExposureChoice {
  int every = 1;  ///< the first of so many moments, counted from the first of the drive
  /// Numbers of exposures as in cloud.las, as ranges with both ends; empty: all.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> numbers;
  std::optional<GpsTime> from, to;  ///< both ends belong to it

  /// Returns whether `number` lies in one of the ranges, or there is none.
  bool has_number(std::uint32_t number) const;
  /// Returns the first number of the ranges that is not one of the drive's exposures.
  std::optional<std::uint32_t> missing_number(const std::set<std::uint32_t>& exposures) const;
  /// Returns whether `time` lies between `from` and `to`.
  bool has_time(GpsTime time) const { return (!from || *from <= time) && (!to || time <= *to); }
  /// Reads "all", "every:N", or numbers and ranges such as "3,7,20-30". Errors: Invalid, with what is allowed.
  static Result<ExposureChoice> parse(const std::string& text);
  /// Sets `from` and `to`, in GPS seconds; NaN leaves one out. Errors: Invalid, for a time before 1990, which is a
  /// second of the drive or of its week, and if the end lies before the beginning.
  Status limit(double from_s, double to_s);
};

}  // namespace hueline
