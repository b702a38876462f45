#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "apps/commands.hpp"
#include "apps/exit_code.hpp"
#include "apps/export/profile.hpp"
#include "apps/log.hpp"
#include "core/output_file.hpp"

namespace hueline::apps {
namespace {

std::vector<std::unique_ptr<ExportProfile>> export_profiles() {
  std::vector<std::unique_ptr<ExportProfile>> all;
  for (const auto make : {make_laz_profile, make_copc_profile, make_ply_profile, make_e57_profile, make_images_profile,
                          make_trajectory_profile})
    all.push_back(make());
  return all;
}

struct Export {
  ExportWords words;
  std::string profile = "laz";
  std::vector<std::unique_ptr<ExportProfile>> profiles = export_profiles();

  int run() {
    ExportProfile& chosen =
        **std::find_if(profiles.begin(), profiles.end(), [&](const auto& one) { return one->word() == profile; });
    const Status allowed = chosen.writes_folder(words) ? check_output_folder(words.out) : check_output(words.out);
    if (!allowed.ok()) {
      log_error(allowed.error().message);
      return kOutputRefused;
    }
    return chosen.run(words);
  }
};

}  // namespace

void add_export(Command& all) {
  auto data = std::make_shared<Export>();
  Command command = all.command("export", "write the results of a drive in the files that other programs import");
  command
      .required("DRIVE", data->words.drive,
                "a drive's folder; or a cloud (.las, .laz) for the profiles laz, copc, ply and e57")
      .reads(data->words.drive);
  std::vector<std::string> words;
  std::string footer;
  for (const auto& one : data->profiles) {
    words.emplace_back(one->word());
    footer += (footer.empty() ? "" : "\n") + words.back() + "  " + one->help();
  }
  command.setting("--profile", data->profile, "what to write", words);
  command.required("--out", data->words.out, "the file to write; with the profile images and with --split a folder");
  command.setting("--threads", data->words.threads, "number of threads that compress; it does not change the files",
                  {1, 64});
  command.option("--split", data->words.split,
                 "laz, copc: parts of the cloud in the folder --out: strips of the drive (time:60s, distance:500m) or "
                 "tiles of the map (tile:100m)");
  command.option("--rig", data->words.rig, "images, trajectory, distance: rig file to use instead of the recorded one")
      .reads(data->words.rig);
  for (const auto& one : data->profiles) one->declare(command);
  command.footer(footer);
  command.runs([data] { return data->run(); });
}

}  // namespace hueline::apps
