#include <fmt/format.h>

#include <cstring>
#include <memory>
#include <nlohmann/json.hpp>
#include <variant>
#include <vector>

#include "apps/commands.hpp"
#include "apps/exit_code.hpp"
#include "apps/log.hpp"
#include "core/decoder.hpp"
#include "core/json_text.hpp"
#include "core/printable.hpp"
#include "runtime/ingest.hpp"
#include "runtime/ledger.hpp"
#include "runtime/recording.hpp"
#include "storage/journal_segments.hpp"

namespace hueline::apps {
namespace {

using Json = nlohmann::ordered_json;

struct VerifyRecordingOptions {
  std::string recording;
  bool json = false;
};

/// What a source lost before its packets entered, as its decoder and the faults in the recording tell it.
struct Source {
  std::string name;
  std::unique_ptr<Decoder> decoder;
  std::uint64_t kernel = 0;  ///< packets that buffers of this computer had no room for, before they could be taken
  std::uint64_t lost = 0;    ///< units that miss in the device's own count
  std::uint64_t refusals = 0;

  void take(const Fault& fault) {
    if (fault.kind == FaultKind::Lost) lost += fault.count;
    if (fault.kind == FaultKind::Overflow) (runtime::Ingest::is_refusal(fault) ? refusals : kernel) += fault.count;
  }
  void take(const std::vector<Measurement>& measured) {
    for (const Measurement& one : measured)
      if (const auto* fault = std::get_if<Fault>(&one)) take(*fault);
  }
};

/// All that was found out about a recording.
struct Found {
  std::vector<Source> sources;  ///< by SensorId
  runtime::LedgerCheck check;
  Status read;  ///< how reading ended
  std::uint64_t packets = 0;
  storage::RemovedSegments removed;
  bool begins_late = false;

  std::uint64_t refusals() const {
    std::uint64_t sum = 0;
    for (const Source& source : sources) sum += source.refusals;
    return sum;
  }
  /// Returns why the recording is not whole, or ok.
  Status trouble() const;
  /// Returns the sentence about a recording without trouble.
  std::string words() const;
};

Status Found::trouble() const {
  std::vector<std::string> reasons;
  if (!read.ok()) reasons.push_back(read.error().message);
  if (check.missing() > 0)
    reasons.push_back(
        fmt::format("{} packets that were recorded are missing; the table says of which source{}", check.missing(),
                    removed.packets > 0 ? fmt::format(" ({} of them were removed by the ring)", removed.packets) : ""));
  if (check.contradictions() > 0)
    reasons.push_back(fmt::format("{} of {} ledgers contradict the packets around them: the file was changed",
                                  check.contradictions(), check.ledgers()));
  if (check.gaps_behind_the_last() > (check.ledgers() > 0 ? 0 : refusals()))
    reasons.push_back(fmt::format("{} packets are missing in the sequence {}", check.gaps_behind_the_last(),
                                  check.ledgers() > 0 ? "behind the last ledger; of which source is not known"
                                                      : "and not told as refused; of which source is not known"));
  if (reasons.empty()) return {};
  return Error{ErrorCode::Truncated, fmt::format("not whole: {}", fmt::join(reasons, "; "))};
}

std::string Found::words() const {
  if (check.ledgers() == 0)
    return fmt::format(
        "no gap: the sequence of the {} packets has none that was not told; there is no ledger in it (it was cut from "
        "another recording, ended early, or is older than ledgers)",
        packets);
  std::string out =
      fmt::format("whole: the {} packets are all that entered{}, by {} ledgers", packets,
                  refusals() > 0 || check.removed() > 0 ? " but for those that the table names" : "", check.ledgers());
  if (check.behind_the_last() > 1)
    out += fmt::format("; of the last {} only the sequence is proved, because the recording ends without a ledger",
                       check.behind_the_last());
  if (begins_late) out += fmt::format("; {} packets came before this file begins", check.removed());
  return out;
}

Json account_json(const Source& source, const runtime::LedgerCheck::Account& one) {
  Json out = {{"source", source.name},       {"received", one.received}, {"recorded", one.here},
              {"refused", one.refused},      {"missing", one.missing},   {"removed", one.removed},
              {"not_fused", one.shed},       {"bytes", one.bytes},       {"lost_in_buffers", source.kernel},
              {"lost_by_count", source.lost}};
  if (source.decoder) {
    const DecodeCounts counts = source.decoder->counts();
    out.update({{"malformed_messages", counts.malformed_messages}, {"malformed_bytes", counts.malformed_bytes}});
  }
  return out;
}

int show(const Found& found, bool as_json) {
  const Status trouble = found.trouble();
  Json rows = Json::array();
  for (std::size_t i = 0; i < found.sources.size(); ++i)
    rows.push_back(account_json(found.sources[i], i < found.check.accounts().size() ? found.check.accounts()[i]
                                                                                    : runtime::LedgerCheck::Account()));
  if (as_json) {
    Json out = {{"is_whole", trouble.ok()},
                {"packets", found.packets},
                {"ledgers", found.check.ledgers()},
                {"packets_behind_last_ledger", found.check.behind_the_last()},
                {"sources", rows}};
    if (!trouble.ok()) out["error"] = trouble.error().message;
    std::fputs((json_text(out, 2) + "\n").c_str(), stdout);
  } else {
    constexpr std::array columns{"received",  "recorded",        "refused",       "missing",           "removed",
                                 "not_fused", "lost_in_buffers", "lost_by_count", "malformed_messages"};
    constexpr std::array heads{"received",  "recorded", "refused", "missing",  "removed",
                               "not fused", "buffers",  "gaps",    "malformed"};
    std::string text = fmt::format("{:16}", "source");
    for (const char* head : heads) text += fmt::format("{:>11}", head);
    text += '\n';
    for (const Json& row : rows) {
      text += fmt::format("{:16}", printable(row["source"].get<std::string>()));
      for (const char* column : columns) text += fmt::format("{:11}", row.value(column, std::uint64_t{0}));
      text += '\n';
    }
    if (trouble.ok() && found.packets > 0) text += found.words() + "\n";
    std::fputs(text.c_str(), stdout);
  }
  if (trouble.ok() && found.packets > 0) return kDone;
  log_error(trouble.ok() ? "no packet is in the recording: nothing came before it ended" : trouble.error().message);
  return trouble.ok() ? kNothingCame : kInputUnreadable;
}

int verify(const VerifyRecordingOptions& options) {
  auto recording = runtime::Recording::open(runtime::drive_file(options.recording));
  if (!recording.ok()) {
    log_error(recording.error().message);
    return opening_status(recording.error());
  }
  const bool begins_late = storage::SegmentPlace::of(recording->journal->header()).number > 1;
  Found found{.sources = {}, .check = runtime::LedgerCheck(begins_late), .read = {}, .removed = {}};
  found.begins_late = begins_late;
  for (const auto& name : recording->rig.sensor_names()) found.sources.push_back({.name = name, .decoder = nullptr});
  for (const auto& sensor : recording->rig.sensors) found.sources[sensor.id].decoder = sensor.device->make_decoder();
  std::vector<Measurement> measured;
  found.read = recording->for_each([&](const Packet& packet) {
    found.check.take(packet);
    ++found.packets;
    if (packet.sensor >= found.sources.size()) return true;
    Source& source = found.sources[packet.sensor];
    if (packet.kind == PacketKind::Fault) {
      if (const auto fault = decode_fault(packet.sensor, packet.received, packet.bytes.bytes()); fault.ok()) {
        source.take(*fault);
        if (source.decoder && fault->kind == FaultKind::Disconnected) source.decoder->reset();
      }
    } else if (packet.kind == PacketKind::Wire && source.decoder) {
      measured.clear();
      source.decoder->decode(packet, measured);
      source.take(measured);
    }
    return true;
  });
  for (Source& source : found.sources) {
    if (!source.decoder) continue;
    measured.clear();
    source.decoder->flush(measured);
    source.take(measured);
  }
  found.removed = recording->journal->removed();
  found.check.finish(found.removed.packets);
  return show(found, options.json);
}

}  // namespace

void add_verify_recording(Command& all) {
  auto options = std::make_shared<VerifyRecordingOptions>();
  Command command = all.command(kVerify.word,
                                "prove that a recording is whole: that everything that entered is in it; "
                                "or compare points with the truth of a simulator's scenario");
  command.required("RECORDING", options->recording,
                   "drive.mcap or a drive's folder; with --scenario, what `hueline-office verify --help` says");
  command.reads(options->recording);
  command.flag("--json", options->json, "print JSON, for programs");
  command.footer(
      "The ledgers in a recording say how many packets of each source had entered. The table has a line for each:\n"
      "  received   packets that reached the program: the sum of recorded, refused, missing and removed\n"
      "  recorded   in the file\n"
      "  refused    not recorded, because the disk was too slow or full\n"
      "  missing    were recorded, and are not in the file any more\n"
      "  removed    by a ring, or in a segment before the one that was named\n"
      "  not fused  of those recorded: the program was too slow to use them while driving; a replay leaves them out "
      "too\n"
      "Losses on the way to the program:\n"
      "  buffers    packets that a buffer of this computer had no room for\n"
      "  gaps       what misses in the device's own count, in its unit, wherever it was lost\n"
      "  malformed  messages whose bytes violate their format\n"
      "Example: hueline verify drives/today\n"
      "Exit status: 0 if the recording is whole; 3 if packets are missing or damaged; 5 if no packet is in it.\n"
      "More: docs/operating.md");
  command.runs([options] { return verify(*options); });
}

}  // namespace hueline::apps
