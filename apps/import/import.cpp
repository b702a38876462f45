#include <fmt/format.h>

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include "apps/commands.hpp"
#include "apps/decode/decode_bag.hpp"
#include "apps/exit_code.hpp"
#include "apps/import/import_bag.hpp"
#include "apps/log.hpp"
#include "config/section.hpp"
#include "core/input_file.hpp"
#include "core/input_folder.hpp"
#include "storage/journal_reader.hpp"

namespace hueline::apps {
namespace {

struct ImportCommandOptions {
  std::string bag, out, origin, map;
  std::vector<std::string> clouds, images, poses;
};

/// Reads "48.1, 11.5, 560": latitude and longitude in degrees, ellipsoidal height in metres.
std::optional<Geodetic> parse_origin(const std::string& text) {
  constexpr double kDegree = std::numbers::pi / 180;
  double latitude = 0, longitude = 0, height = 0;
  char rest = 0;
  if (std::sscanf(text.c_str(), "%lf ,%lf ,%lf %c", &latitude, &longitude, &height, &rest) != 3) return {};
  if (!(std::abs(latitude) <= 90) || !(std::abs(longitude) <= 180) || !(std::abs(height) < 1e5)) return {};
  return Geodetic{latitude * kDegree, longitude * kDegree, height};
}

/// Returns an error if the folder has a rig that is not as an earlier import into it wrote it: somebody has completed
/// it.
Status check_rig_place(const std::filesystem::path& folder) {
  const std::filesystem::path rig = folder / "rig.yaml";
  std::error_code failed;
  if (!std::filesystem::exists(rig, failed)) return {};
  const auto text = read_input(rig, config::kMostConfiguration, "a rig");
  const auto earlier = storage::JournalReader::open(folder / "drive.mcap");
  if (text.ok() && earlier.ok())
    for (const auto& file : (*earlier)->header().files)
      if (file.name == "rig.yaml" && file.text == *text) return {};
  return Error{ErrorCode::Io,
               fmt::format("write {}: File exists, and is not as an import wrote it: choose another folder or move it "
                           "away; --force replaces it",
                           rig.string())};
}

int import_recording(const ImportCommandOptions& options, bool is_forced) {
  ImportOptions what{options.bag, options.out, {}, options.map, options.clouds, options.images, options.poses};
  if (!options.origin.empty()) {
    what.origin = parse_origin(options.origin);
    if (!what.origin) {
      log_error("--origin " + options.origin +
                ": give latitude, longitude (deg) and ellipsoidal height (m): 48.1,11.5,560");
      return kWrongUse;
    }
  }
  if (!is_folder(options.bag))
    if (const auto file = InputFile::open(options.bag); !file.ok()) {
      log_error(file.error().message);
      return kInputUnreadable;
    }
  if (const Status free = is_forced ? Status() : check_rig_place(options.out); !free.ok()) {
    log_error(free.error().message);
    return kOutputRefused;
  }
  const auto done = import_bag(what);
  if (!done.ok()) {
    log_error(done.error().message);
    if (done.error().code == ErrorCode::Invalid) return kWrongUse;
    return done.error().code == ErrorCode::Io ? kOutputRefused : kInputUnreadable;
  }
  std::fputs(topic_table(done->topics, done->became).c_str(), stdout);
  if (done->made.ok())
    fmt::print("{}/drive.mcap: {} packets; {}/rig.yaml describes their sensors\n", options.out, done->packets,
               options.out);
  for (const std::string& one : done->to_do) log_warning("{}", one);
  if (done->damages > 0) log_error("{} damaged parts were skipped; the first: {}", done->damages, done->first_damage);
  if (!done->end.ok()) log_error(done->end.error().message);
  if (!done->made.ok()) {
    log_error(done->made.error().message);
    return kInputUnreadable;
  }
  if (done->packets == 0) return kNothingCame;
  return done->damages > 0 || !done->end.ok() ? kInputUnreadable : kDone;
}

}  // namespace

void add_import(Command& all) {
  auto options = std::make_shared<ImportCommandOptions>();
  Command command = all.command("import", "make a drive of a recording of ROS, with a rig file to complete");
  command.required("RECORDING", options->bag, "MCAP, .db3 or .bag, or a folder with the files of one recording")
      .reads(options->bag);
  command.required("--out", options->out, "folder of the drive").writes_recording_into(options->out, kImportedFrom);
  command.option(
      "--origin", options->origin,
      "latitude, longitude (deg), ellipsoidal height (m) of the origin of local poses: Odometry, PoseStamped, /tf");
  command.option("--map", options->map,
                 "EPSG code of the map whose coordinates local poses are, as EPSG:32632 for UTM zone 32 north; with "
                 "--origin they count from the origin");
  command.option("--clouds", options->clouds,
                 "topics of the point clouds to take; default: of each frame the one with times and the most points");
  command.option("--images", options->images,
                 "topics of the images to take; default: of each camera the one with colours, a lens and the most "
                 "pixels, and grey ones only where none has colours");
  command.option("--poses", options->poses,
                 "topic that the pose is taken from, or one of NavSatFix and one of Imu; default: of the best kind the "
                 "one with the most messages");
  command.footer(
      "Datagrams of scanners are taken as they are; images and poses become packets of devices that hueline knows. The "
      "table says what each topic became. Then complete DRIVE/rig.yaml and run: hueline replay DRIVE --rig "
      "DRIVE/rig.yaml\n"
      "Example: hueline import street.bag --out street --map EPSG:32632\n"
      "Exit status: 0; 2 if a topic or the map cannot be used; 3 if the recording could be read only in part, or "
      "nothing of it can be used; 5 if it gives no packet.\n"
      "More: docs/operating.md");
  command.runs([options, command] { return import_recording(*options, command.is_given("--force")); });
}

}  // namespace hueline::apps
