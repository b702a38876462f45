#include "apps/capture/trajectory_options.hpp"

#include <fmt/format.h>

#include <locale>
#include <optional>
#include <sstream>

#include "apps/log.hpp"
#include "core/input_file.hpp"
#include "runtime/recording.hpp"

namespace hueline::apps {
namespace {

/// Reads "0.1,-0.25,1.2", metres.
std::optional<Point<Body>> parse_point(const std::string& text) {
  Point<Body> point;
  std::istringstream words(text);
  words.imbue(std::locale::classic());
  char first = 0, second = 0;
  words >> point.xyz.x() >> first >> point.xyz.y() >> second >> point.xyz.z();
  const bool is_whole = !words.fail() && (words >> std::ws).eof();
  if (!is_whole || first != ',' || second != ',' || !(point.xyz.norm() <= 100)) return {};
  return point;
}

}  // namespace

void TrajectoryOptions::declare(Command& command, const std::string& prefix) {
  command.option(
      "--trajectory", sbet,
      prefix +
          "trajectory that was calculated after the drive (SBET), to be used in place of the POS's solutions; it "
          "is compared with them first");
  command.option("--trajectory-sigma", smrmsg, prefix + "its accuracies (SMRMSG)");
  command.setting("--trajectory-time", time,
                  prefix + "what its times are: seconds of the GPS week, or of the same week in UTC", {"gps", "utc"});
  command.option(
      "--trajectory-point", point,
      prefix + "the point of the vehicle whose places it has, if it is not the POS's: right,forward,up of that, in m");
  command.reads(sbet).reads(smrmsg);
}

Status TrajectoryOptions::check_files() const {
  for (const std::string& path : {sbet, smrmsg})
    if (!path.empty())
      if (const auto file = InputFile::open(path); !file.ok()) return file.error();
  return {};
}

Result<std::unique_ptr<runtime::PostTrajectory>> TrajectoryOptions::open(
    const runtime::PostTrajectory::OwnSolutions& own) const {
  if (sbet.empty()) {
    if (smrmsg.empty() && point.empty()) return std::unique_ptr<runtime::PostTrajectory>();
    return Error{ErrorCode::Invalid,
                 "--trajectory-sigma and --trajectory-point belong to --trajectory, which is missing"};
  }
  if (Status there = check_files(); !there.ok()) return there.error();
  runtime::PostTrajectory::Config config{sbet, smrmsg, time == "utc", {}};
  if (!point.empty()) {
    const auto parsed = parse_point(point);
    if (!parsed)
      return Error{
          ErrorCode::Invalid,
          fmt::format("--trajectory-point {}: give three numbers with commas between them, right,forward,up of "
                      "the POS's point, in metres and at most 100 m from it",
                      point)};
    config.point_body = *parsed;
  }
  return runtime::PostTrajectory::open(config, own);
}

Result<std::unique_ptr<runtime::PostTrajectory>> TrajectoryOptions::open(const std::string& recording,
                                                                         const std::string& rig) const {
  return open([&](const std::function<void(const InsSolution&)>& use) -> Status {
    auto once = runtime::Recording::open(recording, rig);
    if (!once.ok()) return once.error();
    const Status read = runtime::for_each_solution(*once, use);
    if (!read.ok()) log_warning("{}", read.error().message);
    return {};
  });
}

}  // namespace hueline::apps
