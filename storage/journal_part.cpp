#include "storage/journal_part.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "core/remote_store.hpp"
#include "storage/journal_writer.hpp"

namespace hueline::storage {
PartChoice::Fate PartChoice::judge(const Packet& packet) {
  if (!std::exchange(has_begun_, true)) {
    begin_ = packet.received;
    begin_sequence_ = packet.sequence;
  }
  // The stamps of different devices do not come quite in order: the time of the drive is that of the newest.
  newest_ = std::max(newest_, packet.received - begin_);
  if (part_.to_s && newest_ >= from_seconds(*part_.to_s)) return Fate::Stop;
  if (newest_ < from_seconds(part_.from_s)) {
    ++before_;
    return Fate::LeaveOut;
  }
  if (!std::exchange(has_first_, true)) first_ = packet.sequence;
  if (packet.kind == PacketKind::Ledger && is_new_order()) {
    ++ledgers_;
    return Fate::LeaveOut;
  }
  if (packet.sensor < part_.left_out.size() && part_.left_out[packet.sensor]) {
    ++of_others_;
    return Fate::LeaveOut;
  }
  return Fate::Keep;
}

bool PartChoice::is_new_order() const { return first_ > 0 || std::ranges::count(part_.left_out, true) > 0; }

Result<CopiedPart> copy_part(JournalReader& journal, const std::string& name, const JournalPart& part,
                             const std::filesystem::path& to) {
  JournalHeader header = journal.header();
  for (const char* key : {kSegmentRecording, kSegmentNumber, kSegmentFollows, kSegmentRemoved, kSegmentRemovedPackets,
                          kSegmentRemovedBytes})
    header.about.erase(key);
  header.about[kPartOf] = fmt::format("{}, {} s to {}", name, part.from_s,
                                      part.to_s ? fmt::format("{} s", *part.to_s) : std::string("its end"));
  header.has_packed_images = header.has_packed_images && !part.unpacks_images;
  auto writer = JournalWriter::create(to, header, JournalWriter::Config::of_copy());
  if (!writer.ok()) return writer.error();
  CopiedPart result;
  PartChoice choice(part);
  bool has_begun = false;
  for (;;) {
    auto packet = journal.next({});
    if (!packet.ok()) {
      if (packet.error().code == ErrorCode::EndOfData) break;
      if (packet.error().code == ErrorCode::Malformed) {
        if (result.damages++ == 0) result.first_damage = packet.error().message;
        continue;
      }
      result.end = packet.error();
      break;
    }
    const auto fate = choice.judge(*packet);
    if (!std::exchange(has_begun, true) && part.from_s > 0)
      journal.skip_before(choice.begin() + from_seconds(part.from_s));
    if (fate == PartChoice::Fate::Stop) {
      result.ends_early = true;
      break;
    }
    if (fate == PartChoice::Fate::LeaveOut) continue;
    packet->sequence = choice.sequence_of(*packet);
    if (Status written = writer->append(*packet, choice.newest()); !written.ok()) return written.error();
    ++result.packets;
    result.bytes += packet->bytes.size();
  }
  result.before = choice.before();
  result.of_others = choice.of_others();
  if (Status closed = writer->close(); !closed.ok()) return closed.error();
  return result;
}

Status check_begin(JournalReader& journal, double from_s) {
  const std::filesystem::path& path = journal.segments().front().path;
  if (from_s <= 0 || is_address(path)) return {};
  const auto newest = journal.newest();
  const auto& first = journal.peek();
  if (!newest || !first.ok()) return {};  // who reads it will say why
  const nanoseconds duration = std::max(*newest - first->received, nanoseconds(0));
  if (from_seconds(from_s) <= duration) return {};
  return Error{ErrorCode::Invalid, fmt::format("{} has only {:.1f} s", path.string(), to_seconds(duration))};
}

}  // namespace hueline::storage
