#include <fmt/format.h>

#include <algorithm>
#include <map>
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
  std::map<std::string, std::string> owners;  // of options, the profile that alone has it
  std::vector<std::string> of_recording;      // options of the profiles that read the recording
  std::vector<std::unique_ptr<ExportProfile>> profiles = export_profiles();

  /// Returns what was asked of the profile that it cannot do; empty if nothing was. Done without it, the file would not
  /// be what was meant.
  std::string wrong_wish(const ExportProfile& chosen, const Command& command) const {
    for (const auto& [option, owner] : owners)
      if (owner != profile && command.is_given(option))
        return fmt::format("{} is of the profile {}, and the profile is {}", option, owner, profile);
    if (!words.split.empty() && !chosen.splits())
      return fmt::format("--split: the profile {} does not split; laz and copc do", profile);
    if (!chosen.reads_recording(words))
      for (const std::string& option : of_recording)
        if (command.is_given(option))
          return fmt::format("{}: the profile {} writes the cloud as it is; `hueline replay {}` makes it again", option,
                             profile, option);
    std::string name = words.out;
    for (char& letter : name)
      if (letter >= 'A' && letter <= 'Z') letter = static_cast<char>(letter - 'A' + 'a');
    if (chosen.writes_folder(words) || chosen.ending().empty() || chosen.is_name(name)) return {};
    const ExportProfile* meant = nullptr;
    for (const auto& one : profiles)
      if (!one->ending().empty() && one->is_name(name)) meant = one.get();
    return fmt::format("{}: the profile {} writes a file that ends in {}{}", words.out, profile, chosen.ending(),
                       meant == nullptr ? "" : fmt::format("; is --profile {} meant?", meant->word()));
  }

  int run(const Command& command) {
    ExportProfile& chosen =
        **std::find_if(profiles.begin(), profiles.end(), [&](const auto& one) { return one->word() == profile; });
    if (const std::string wrong = wrong_wish(chosen, command); !wrong.empty()) {
      log_error(wrong);
      return kWrongUse;
    }
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
  const auto added_since = [&command](std::size_t before) {
    auto all_now = command.options();
    all_now.erase(all_now.begin(), all_now.begin() + static_cast<std::ptrdiff_t>(before));
    return all_now;
  };
  const std::size_t common = command.options().size();
  command.option("--rig", data->words.rig, "images, trajectory, distance: rig file to use instead of the recorded one")
      .reads(data->words.rig);
  data->words.trajectory.declare(command, "images, trajectory, distance: ");
  data->of_recording = added_since(common);
  for (const auto& one : data->profiles) {
    const std::size_t before = command.options().size();
    one->declare(command);
    for (const std::string& option : added_since(before)) data->owners[option] = one->word();
  }
  command.footer(footer +
                 "\nExample: hueline export drives/today --profile copc --out today.copc.laz\n"
                 "Exit status: 0; 3 if the cloud or the recording could be read only in part; 5 if there is nothing to "
                 "export.\n"
                 "More: docs/formats.md");
  command.runs([data, command] { return data->run(command); });
}

}  // namespace hueline::apps
