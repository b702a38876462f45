#include "apps/score/score_recording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "apps/simulate/simulated_recording.hpp"
#include "runtime/pipeline.hpp"
#include "storage/journal_reader.hpp"

namespace hueline::apps {
namespace {

bool same(const Packet& a, const Packet& b) {
  const auto x = a.bytes.bytes(), y = b.bytes.bytes();
  return a.sensor == b.sensor && a.kind == b.kind && a.shed == b.shed && a.sequence == b.sequence &&
         a.received == b.received && std::equal(x.begin(), x.end(), y.begin(), y.end());
}

/// Reads the packets of a file to its end, one after the other, and skips damaged chunks.
class Found {
 public:
  explicit Found(storage::JournalReader& reader) : reader_(reader) { advance(); }
  const std::optional<Packet>& packet() const { return packet_; }
  void advance() {
    while (true) {
      Result<Packet> read = reader_.next({});
      if (read.ok()) {
        packet_ = std::move(*read);
        return;
      }
      if (read.error().code == ErrorCode::Malformed) {
        ++damaged_;
        continue;
      }
      end_ = read.error().code;
      packet_.reset();
      return;
    }
  }
  ErrorCode end() const { return end_; }
  std::uint64_t damaged() const { return damaged_; }

 private:
  storage::JournalReader& reader_;
  std::optional<Packet> packet_;
  ErrorCode end_ = ErrorCode::EndOfData;
  std::uint64_t damaged_ = 0;
};

/// For one sensor: the packets that are not in the file, and how many of them the faults in the file report.
struct Losses {
  std::uint64_t packets = 0, bytes = 0, told = 0;
  void add(std::uint64_t size) { ++packets, bytes += size; }
};

const char* word(sim::FaultyDisk::Death death) {
  switch (death) {
    case sim::FaultyDisk::Death::ProcessKill:
      return "the program was killed";
    case sim::FaultyDisk::Death::PowerCut:
      return "the power was cut";
    case sim::FaultyDisk::Death::None:
      break;
  }
  return "";
}

/// Adds to the facts how many lost packets of each sensor no fault reports, or are reported though they are not lost.
void count_untold(const std::map<SensorId, Losses>& losses_of, score::RecordingFacts& facts) {
  for (const auto& [sensor, losses] : losses_of) {
    const std::uint64_t untold =
        losses.packets > losses.told ? losses.packets - losses.told : losses.told - losses.packets;
    facts.untold += untold;
    if (losses.packets > 0) facts.untold_bytes += losses.bytes * untold / losses.packets;
  }
}

/// Returns how the recording ended, and what was found when it was read back.
std::string end_text(const SimulatedCapture& capture, const Found& found) {
  const std::string ended = capture.death != sim::FaultyDisk::Death::None ? word(capture.death)
                            : capture.recording.ok()                      ? "recorded to the end"
                                                                          : "the recording ended early";
  return fmt::format("{}; reading it back: {}, {} damaged places", ended, name(found.end()), found.damaged());
}

}  // namespace

Result<RecoveredRecording> judge_recording(const SimulatedCapture& capture, const std::filesystem::path& file,
                                           const sim::Drive& drive, const sim::Timeline& timeline,
                                           const config::Rig& rig, int threads) {
  auto reader = storage::JournalReader::open(file);
  if (!reader.ok()) return reader.error();
  RecoveredRecording out;
  score::RecordingFacts& facts = out.facts;
  CloudPrintSink sink(out.cloud);
  runtime::Pipeline pipeline(rig, threads, sink);
  Found found(**reader);
  std::map<SensorId, Losses> inside, behind;              // losses before and after the last packet of the file
  std::vector<std::pair<SensorId, std::size_t>> missing;  // packets missing since the latest packet of the file
  std::uint64_t end_sequence = 0;
  HostTime last = kSimulatedHostBegin;
  const auto keep_missing = [&](std::map<SensorId, Losses>& where) {
    for (const auto& [sensor, size] : missing) where[sensor].add(size);
    missing.clear();
  };
  const Status compared = for_each_accepted_packet(capture, drive, timeline, rig, [&](const Packet& sent) {
    ++facts.came;
    const bool is_promised = sent.sequence < capture.promised_end;
    facts.promised += is_promised;
    for (; found.packet() && found.packet()->sequence < sent.sequence; found.advance()) ++facts.changed;
    if (!found.packet() || found.packet()->sequence != sent.sequence) {
      facts.promised_missing += is_promised;
      missing.emplace_back(sent.sensor, sent.bytes.size());
      return true;
    }
    keep_missing(inside);
    end_sequence = sent.sequence + 1;
    last = std::max(last, sent.received);
    if (same(*found.packet(), sent)) {
      ++facts.recovered;
      pipeline.process(sent);
      if (sent.kind == PacketKind::Fault)
        if (const auto fault = decode_fault(sent.sensor, sent.received, sent.bytes.bytes());
            fault.ok() && fault->kind == FaultKind::Overflow)
          inside[sent.sensor].told += fault->count, facts.told += fault->count;
    } else {
      ++facts.changed;
      facts.promised_missing += is_promised;
    }
    found.advance();
    return true;
  });
  if (!compared.ok()) return compared.error();
  pipeline.flush();
  keep_missing(behind);
  for (; found.packet(); found.advance()) ++facts.changed;
  for (const auto& packet : capture.packets) {
    if (packet.is_accepted) continue;
    ++facts.came, ++facts.refused;
    (packet.sequence < end_sequence ? inside : behind)[packet.sensor].add(packet.bytes);
  }
  // The reader of a cut recording, or the program at its end, reports everything after the last packet as a whole.
  const bool is_end_told =
      !capture.recording.ok() || (capture.death != sim::FaultyDisk::Death::None && found.end() == ErrorCode::Truncated);
  if (!is_end_told)
    for (const auto& [sensor, losses] : behind)
      inside[sensor].packets += losses.packets, inside[sensor].bytes += losses.bytes;
  count_untold(inside, facts);
  facts.end_lost_s = to_seconds(capture.end - last);
  facts.end = end_text(capture, found);
  return out;
}

}  // namespace hueline::apps
