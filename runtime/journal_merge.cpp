#include "runtime/journal_merge.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "runtime/ledger_join.hpp"
#include "storage/journal_writer.hpp"

namespace hueline::runtime {
namespace {

constexpr std::uint64_t kTellEvery = 4096;  // packets from one word about the progress to the next

/// Reads one of the recordings in its order, in the clock of the first.
class Cursor {
 public:
  Cursor(MergeInput& input, MergedJournal::Input& told) : input_(input), told_(told) {}

  const std::optional<Packet>& packet() const { return packet_; }
  /// The time that the recording has reached. It never falls.
  HostTime reached() const { return reached_; }

  /// Goes on to the next packet; there is none at the end.
  void advance() {
    packet_.reset();
    while (!is_over_) {
      auto next = input_.journal->next({});
      if (next.ok()) return take(std::move(*next));
      const Error& error = next.error();
      if (error.code == ErrorCode::Malformed) {
        if (told_.damages++ == 0) told_.first_damage = error.message;
        continue;
      }
      if (error.code != ErrorCode::EndOfData) told_.end = error;
      is_over_ = true;
    }
  }

 private:
  void take(Packet&& packet) {
    const sync::OtherTime there(packet.received.time_since_epoch());
    packet.received = input_.clock.convert(there);
    told_.largest_sigma = std::max(told_.largest_sigma, input_.clock.sigma(there));
    reached_ = std::exchange(has_begun_, true) ? std::max(reached_, packet.received) : packet.received;
    packet_ = std::move(packet);
  }

  MergeInput& input_;
  MergedJournal::Input& told_;
  std::optional<Packet> packet_;
  HostTime reached_{};
  bool has_begun_ = false, is_over_ = false;
};

class Merge {
 public:
  Merge(std::vector<MergeInput>& inputs, std::size_t sensors, storage::JournalWriter& writer)
      : inputs_(inputs), writer_(writer), ledgers_(sensors, ledger_inputs(inputs)) {
    result_.inputs.resize(inputs.size());
    for (std::size_t i = 0; i < inputs.size(); ++i) cursors_.emplace_back(inputs[i], result_.inputs[i]);
  }

  Result<MergedJournal> run(const std::stop_token& stop, const std::function<void(std::uint64_t)>& progress) {
    for (std::size_t i = 0; i < cursors_.size(); ++i)
      if (Status done = advance(i); !done.ok()) return done.error();
    std::uint64_t taken = 0;
    for (auto i = first(); i; i = first()) {
      if (stop.stop_requested()) return Error{ErrorCode::Stopped, "stopped"};
      if (progress && taken++ % kTellEvery == 0) progress(bytes_read());
      if (Status done = take(*i); !done.ok()) return done.error();
      if (Status done = advance(*i); !done.ok()) return done.error();
    }
    if (Status done = end(); !done.ok()) return done.error();
    return std::move(result_);
  }

 private:
  static std::vector<LedgerJoin::Input> ledger_inputs(const std::vector<MergeInput>& inputs) {
    std::vector<LedgerJoin::Input> out;
    for (const MergeInput& input : inputs) out.push_back({input.sensors, input.begins_late, input.is_ring});
    return out;
  }

  std::uint64_t bytes_read() const {
    std::uint64_t sum = 0;
    for (const MergeInput& input : inputs_) sum += input.journal->position();
    return sum;
  }

  /// Returns the recording whose packet is next.
  std::optional<std::size_t> first() const {
    std::optional<std::size_t> out;
    for (std::size_t i = 0; i < cursors_.size(); ++i)
      if (cursors_[i].packet() && (!out || cursors_[i].reached() < cursors_[*out].reached())) out = i;
    return out;
  }

  Status advance(std::size_t i) {
    cursors_[i].advance();
    const MergedJournal::Input& told = result_.inputs[i];
    if (cursors_[i].packet() || told.end.ok()) return {};
    return tell(1, fmt::format("{}: {}; what came behind is not here", inputs_[i].name, told.end.error().message));
  }

  Status take(std::size_t i) {
    const Packet& packet = *cursors_[i].packet();
    newest_ = std::max(newest_, cursors_[i].reached());
    if (ledgers_.take(i, packet)) return write_ledger();
    const std::vector<std::optional<SensorId>>& sensors = inputs_[i].sensors;
    const auto becomes = packet.sensor < sensors.size() ? sensors[packet.sensor] : std::nullopt;
    const bool is_left_out =
        !becomes || packet.kind == PacketKind::Ledger || (packet.kind == PacketKind::Tick && !inputs_[i].has_ticks);
    if (is_left_out) {
      ++result_.inputs[i].left_out;
      return {};
    }
    Packet out = packet;
    out.sensor = *becomes;
    ++result_.inputs[i].packets;
    return write(std::move(out));
  }

  Status write(Packet&& packet) {
    packet.sequence = ledgers_.keep(packet);
    ++result_.packets;
    result_.bytes += packet.bytes.size();
    return writer_.append(packet, newest_.time_since_epoch());
  }

  Status write_ledger() {
    return write(
        {kSystemSensor, PacketKind::Ledger, false, 0, newest_, Buffer::copy_of(encode_ledger(ledgers_.total()))});
  }

  Status tell(std::uint64_t count, std::string what) {
    return write(fault_packet(newest_, FaultKind::Lost, count, std::move(what)));
  }

  Status end() {
    ledgers_.finish();
    if (Status done = write_ledger(); !done.ok()) return done;
    for (std::size_t i = 0; i < inputs_.size(); ++i) {
      MergedJournal::Input& one = result_.inputs[i];
      one.missing = ledgers_.missing(i);
      one.unexplained = ledgers_.unexplained(i);
      one.ledgers = ledgers_.ledgers(i);
      one.contradictions = ledgers_.contradictions(i);
      if (one.unexplained == 0) continue;
      ledgers_.leave_gap(one.unexplained);
      if (Status done = tell(
              one.unexplained,
              fmt::format("{}: {} packets are missing in its sequence{}; of which sensor is not known", inputs_[i].name,
                          one.unexplained, one.ledgers > 0 ? " behind its last ledger" : ", and it has no ledger"));
          !done.ok())
        return done;
    }
    return {};
  }

  std::vector<MergeInput>& inputs_;
  storage::JournalWriter& writer_;
  LedgerJoin ledgers_;
  MergedJournal result_;
  std::vector<Cursor> cursors_;
  HostTime newest_{};
};

}  // namespace

Result<MergedJournal> merge_journals(std::vector<MergeInput>& inputs, const storage::JournalHeader& header,
                                     const std::filesystem::path& to, std::stop_token stop,
                                     const std::function<void(std::uint64_t)>& progress) {
  for (MergeInput& input : inputs)
    if (Status opened = input.journal->open(); !opened.ok()) return opened.error();
  auto writer = storage::JournalWriter::create(to, header, storage::JournalWriter::Config::of_copy());
  if (!writer.ok()) return writer.error();
  auto result = Merge(inputs, header.sensors.size(), *writer).run(stop, progress);
  if (!result.ok()) return result;
  if (const Status closed = writer->close(); !closed.ok()) return closed.error();
  return result;
}

}  // namespace hueline::runtime
