#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "config/rig.hpp"
#include "runtime/health.hpp"

namespace hueline::runtime {

class Summary;

/// What becomes of a drive.
enum class Grade : std::uint8_t {
  Good,     ///< use it
  Remarks,  ///< usable, but something is worse than the rig wants
  Again,    ///< drive again, all of it or the places that are named
};
/// Returns it in words: "good", "usable with remarks", "drive again".
const char* name(Grade grade);

/// A reason for a grade.
struct Remark {
  Grade grade = Grade::Remarks;
  std::string sensor;             ///< or "drive"
  std::string text;               ///< what is wrong, with its measure and the rig's threshold
  double begin_s = 0, end_s = 0;  ///< s after the first packet; the whole drive if both are 0
  std::optional<GpsTime> begin, end;
  std::optional<Geodetic> place;  ///< where it began
  double length_m = 0;            ///< the path that it lasted
};

/// The judgement of a whole drive.
struct Verdict {
  Grade grade = Grade::Good;
  std::vector<Remark> remarks;  ///< the gravest first, then in order of time
  double alarm_share = 0;       ///< of the driven path, or of the time if the vehicle stood
  /// Returns three lines for the terminal: the grade, the gravest reasons, and where to go on.
  std::string text() const;
  nlohmann::ordered_json json() const;
};

/// Returns a share in percent, rounded down to tenths: one that is just too small must not look like what is wanted.
double percent_below(double share);

/// Judges a drive by its health and its figures. What was not there before the vehicle moved, and what ended with the
/// drive (HealthLimits::end), is no reason. Call it after Pipeline::report().
Verdict judge_drive(const config::Rig& rig, const Health& health, const Summary& summary);

}  // namespace hueline::runtime
