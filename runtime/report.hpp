#pragma once

#include <string>

#include "config/rig.hpp"
#include "runtime/drive_map.hpp"
#include "runtime/summary.hpp"
#include "runtime/verdict.hpp"

namespace hueline::runtime {

/// Returns the report of a drive: one HTML page without any other file, which prints on a page of A4. It has the
/// verdict with its reasons, the map (driven, coloured, without points, weak GNSS, places to drive again) and the
/// figures of coverage, colour, time, trajectory and losses. The same input gives the same bytes.
std::string drive_report(const config::Rig& rig, const Verdict& verdict, const Summary& summary, const DriveMap& map);

}  // namespace hueline::runtime
