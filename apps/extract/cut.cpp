#include <fmt/format.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/commands.hpp"
#include "apps/exit_code.hpp"
#include "apps/log.hpp"
#include "core/remote_store.hpp"
#include "runtime/recording.hpp"
#include "storage/journal_part.hpp"

namespace hueline::apps {
namespace {

struct CutOptions {
  std::string recording, out;
  double from_s = 0, to_s = -1;
  std::vector<std::string> without;
  bool unpack = false;
};

/// Returns the sensors that are left out, by their numbers, or says which there are.
Result<std::vector<bool>> find_sensors(const storage::JournalHeader& header, const std::vector<std::string>& names) {
  std::vector<bool> out(header.sensors.size());
  for (const std::string& name : names) {
    bool is_known = false;
    std::string known;
    for (std::size_t id = 1; id < header.sensors.size(); ++id) {
      known += (known.empty() ? "" : ", ") + header.sensors[id].name;
      if (header.sensors[id].name != name) continue;
      out[id] = true;
      is_known = true;
    }
    if (!is_known)
      return Error{ErrorCode::Invalid,
                   fmt::format("--without {}: no such sensor in the recording; there are: {}", name, known)};
  }
  return out;
}

int cut(const CutOptions& options, bool recovers) {
  const std::string path = runtime::drive_file(options.recording);
  auto journal = runtime::open_journal(options.recording);
  if (!journal.ok()) {
    log_error(journal.error().message);
    return kInputUnreadable;
  }
  auto left_out = find_sensors((*journal)->header(), options.without);
  if (!left_out.ok()) {
    log_error(left_out.error().message);
    return kWrongUse;
  }
  storage::JournalPart which{options.from_s, {}, *left_out, options.unpack};
  if (options.to_s >= 0) which.to_s = options.to_s;
  if (which.to_s && *which.to_s <= which.from_s) {
    log_error("--to {} is not after --from {}", *which.to_s, which.from_s);
    return kWrongUse;
  }
  if (const Status within = storage::check_begin(**journal, options.from_s); !within.ok()) {
    log_error("--from {}: {}; give a smaller one", options.from_s, within.error().message);
    return kWrongUse;
  }
  if (is_address(path) && options.from_s > 0 && !(*journal)->has_index())
    log_warning("{} has no index, because it was cut off or damaged: more than the part is fetched", path);
  const auto result = storage::copy_part(**journal, path, which, options.out);
  if (!result.ok()) {
    log_error(result.error().message);
    return kOutputRefused;
  }
  fmt::print("{}: {} packets with {:.1f} MB, whole", options.out, result->packets,
             static_cast<double>(result->bytes) / 1e6);
  if (result->before + result->of_others > 0)
    fmt::print("; left out: {} packets before {} s, {} of sensors that were not wanted", result->before, options.from_s,
               result->of_others);
  fmt::print("\n");
  if (result->damages > 0)
    log_warning("{} parts of {} are damaged or missing; the first: {}", result->damages, path, result->first_damage);
  if (!result->end.ok()) log_warning("{}", result->end.error().message);
  if (result->packets == 0) {
    log_error("no packet of {} is {}", path, recovers ? "whole" : "in that part");
    return kNothingCame;
  }
  // That the end is missing is why a recording is recovered: all that came before it is there.
  const bool is_whole = result->damages == 0 && (result->end.ok() || recovers);
  return is_whole ? kDone : kInputUnreadable;
}

}  // namespace

void add_cut(Command& all) {
  auto options = std::make_shared<CutOptions>();
  Command command = all.command("cut", "copy some time or some sensors of a recording into a new one");
  command.required("RECORDING", options->recording, "drive.mcap, or a drive's folder").reads(options->recording);
  command.required("--out", options->out, "the new recording, an .mcap file")
      .writes_recording(options->out, storage::kPartOf);
  command.setting("--from", options->from_s, "s after the recording's first packet, as in the verdict", {0, 1e9});
  command.option("--to", options->to_s,
                 "likewise; what came then or later is left out; default: to the recording's end", {0, 1e9});
  command.option("--without", options->without, "sensors that are left out, by their names");
  command.flag("--unpack", options->unpack,
               "store images that the recording packs (pack_images in the rig) as they came, for other programs");
  command.footer(
      "A replay of the new recording begins with clocks that know nothing: begin 30 s before what you want to see.\n"
      "Example: hueline cut drives/today --from 1770 --to 1830 --out part.mcap\n"
      "Exit status: 0; 2 if the recording has no such time or sensor; 3 if it could be read only in part; 5 if no "
      "packet is in that part.\n"
      "More: docs/operating.md");
  command.runs([options] { return cut(*options, false); });
}

void add_recover(Command& all) {
  auto options = std::make_shared<CutOptions>();
  Command command = all.command(
      "recover", "copy everything that is whole in a recording that was cut or damaged into a new one, which is whole");
  command.required("RECORDING", options->recording, "drive.mcap, or a drive's folder; it is only read")
      .reads(options->recording);
  command.required("--out", options->out, "the new recording, an .mcap file")
      .writes_recording(options->out, storage::kPartOf);
  command.footer(
      "Example: hueline recover drives/today --out whole.mcap\n"
      "Exit status: 0, also if only the end of the recording is missing; 3 if damaged parts were left out; 5 if no "
      "packet is whole.\n"
      "More: docs/operating.md");
  command.runs([options] { return cut(*options, true); });
}

}  // namespace hueline::apps
