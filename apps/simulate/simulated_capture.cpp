#include "apps/simulate/simulated_capture.hpp"

#include <algorithm>
#include <memory>
#include <utility>

#include "apps/simulate/simulated_disk.hpp"
#include "apps/simulate/simulated_recording.hpp"
#include "runtime/ingest.hpp"
#include "runtime/live_run.hpp"
#include "runtime/recorder.hpp"
#include "runtime/recording.hpp"
#include "storage/recording_config.hpp"

namespace hueline::apps {
namespace {

constexpr std::int64_t kForEver = INT64_MAX;

std::int64_t drive_ns(HostTime t) { return (t - kSimulatedHostBegin).count(); }

/// The recorder and its queue, run step by step.
class Steps {
 public:
  Steps(const config::Rig& rig, sim::FaultyDisk& disk, std::unique_ptr<storage::SegmentedJournal> journal,
        std::size_t queue_bytes)
      : disk_(disk),
        record_({runtime::LiveRun::Config().record_queue.items, queue_bytes}),
        pipeline_({runtime::LiveRun::Config().pipeline_queue.items}),
        ingest_(std::vector<runtime::Ingest::Sensor>(rig.sensors.size() + 1), record_, pipeline_,
                {runtime::LiveRun::Config().pipeline_queue.items}),
        recorder_(std::move(journal)) {}

  /// Runs the recorder until `now_ns`. Returns false if the program is dead or its recording has failed.
  bool run_until(std::int64_t now_ns) {
    while (free_at_ns_ <= now_ns && record_.size() > 0 && !disk_.is_dead() && failed_.ok()) {
      const PacketPtr packet = *record_.pop();
      disk_.set_now(std::max(free_at_ns_, drive_ns(packet->received)));
      if (disk_.is_dead()) break;
      failed_ = recorder_.take(*packet, std::chrono::nanoseconds(disk_.now_ns()));
      newest_taken_ = std::max(newest_taken_, packet->received);
      free_at_ns_ = disk_.now_ns();
    }
    if (now_ns != kForEver && now_ns >= disk_.death_ns()) disk_.set_now(now_ns);
    return !disk_.is_dead() && failed_.ok();
  }

  void submit(const Packet& packet, SimulatedCapture& out) {
    const bool is_accepted = ingest_.submit(packet);
    if (packet.kind == PacketKind::Fault)
      return keep_told(~std::uint64_t{0}, out);  // runtime::Ingest decides when and how it reports a fault
    const std::uint64_t sequence = ingest_.next_sequence() - 1;
    out.packets.push_back(
        {sequence, packet.sensor, packet.kind, static_cast<std::uint32_t>(packet.bytes.size()), is_accepted});
    newest_ = std::max(newest_, packet.received);
    if (is_accepted) accepted_.push_back({newest_, sequence});
    keep_told(sequence, out);
  }

  /// Ends the drive.
  void finish(SimulatedCapture& out) {
    if (!run_until(kForEver)) return;
    ingest_.tell_the_rest({});
    keep_told(~std::uint64_t{0}, out);
    run_until(kForEver);
  }

  /// Ends the program: nothing more is accepted. Stores what the program promises or reports about its recording.
  void close(SimulatedCapture& out) {
    out.death = disk_.is_dead() ? disk_.death() : sim::FaultyDisk::Death::None;
    if (out.death != sim::FaultyDisk::Death::None) {
      const nanoseconds span = out.death == sim::FaultyDisk::Death::PowerCut
                                   ? from_seconds(storage::RecordingConfig().power_cut_s)
                                   : storage::JournalWriter::Config().chunk_time;
      // Arrivals are slightly out of order, because a pulse is stamped before it is reported.
      constexpr nanoseconds kDisorder = std::chrono::milliseconds(1);
      for (const auto& one : accepted_)
        if (one.by <= newest_taken_ - span - kDisorder) out.promised_end = one.sequence + 1;
      return;
    }
    const Status closed = recorder_.close();
    out.recording = failed_.ok() ? closed : failed_;
    out.promised_end = out.recording.ok() ? ingest_.next_sequence() : recorder_.end_sequence();
  }

 private:
  struct Accepted {
    HostTime by;  // newest arrival up to this packet
    std::uint64_t sequence;
  };
  void keep_told(std::uint64_t but_this, SimulatedCapture& out) {
    while (pipeline_.size() > 0)
      if (const PacketPtr packet = *pipeline_.pop(); packet->sequence != but_this)
        out.told.emplace(packet->sequence, *packet);
  }

  sim::FaultyDisk& disk_;
  runtime::PacketQueue record_, pipeline_;
  runtime::Ingest ingest_;
  runtime::Recorder recorder_;
  Status failed_;
  std::int64_t free_at_ns_ = INT64_MIN;
  HostTime newest_ = kSimulatedHostBegin, newest_taken_ = kSimulatedHostBegin;
  std::vector<Accepted> accepted_;
};

}  // namespace

Result<SimulatedCapture> capture_on_faulty_disk(const sim::Drive& drive, const sim::Timeline& timeline,
                                                const config::Rig& rig, sim::FaultyDisk& disk,
                                                const std::filesystem::path& file, std::size_t queue_bytes) {
  SimulatedDisk simulated(disk);
  disk.set_now(0);
  storage::SegmentedJournal::Config config;
  config.segment.if_exists = storage::IfExists::Replace;
  auto journal = storage::SegmentedJournal::create(file, runtime::journal_header(rig), config, simulated);
  if (!journal.ok()) return journal.error();
  SimulatedCapture out;
  {
    Steps steps(rig, disk, std::make_unique<storage::SegmentedJournal>(std::move(*journal)), queue_bytes);
    bool is_running = true;
    const Status fed = for_each_simulated_packet(drive, timeline, rig, [&](const Packet& packet) {
      is_running = steps.run_until(drive_ns(packet.received));
      if (is_running) {
        steps.submit(packet, out);
        out.end = std::max(out.end, packet.received);
      }
      return is_running;
    });
    if (!fed.ok()) return fed.error();
    if (is_running) steps.finish(out);
    steps.close(out);
  }
  if (out.death != sim::FaultyDisk::Death::None) out.end = kSimulatedHostBegin + nanoseconds(disk.death_ns());
  if (const Status left = simulated.leave_remains(file); !left.ok()) return left.error();
  return out;
}

Status for_each_accepted_packet(const SimulatedCapture& capture, const sim::Drive& drive, const sim::Timeline& timeline,
                                const config::Rig& rig, const std::function<bool(const Packet&)>& use) {
  std::size_t number = 0;
  auto told = capture.told.begin();
  const auto give_told = [&](std::uint64_t below) {
    for (; told != capture.told.end() && told->first < below; ++told)
      if (!use(told->second)) return false;
    return true;
  };
  bool goes_on = true;
  const Status fed = for_each_simulated_packet(drive, timeline, rig, [&](const Packet& packet) {
    if (packet.kind == PacketKind::Fault) return true;  // these are among the packets that the program inserted
    if (number == capture.packets.size()) return false;
    const SimulatedCapture::Submitted submitted = capture.packets[number++];
    goes_on = give_told(submitted.sequence);
    if (!goes_on || !submitted.is_accepted) return goes_on;
    Packet sequenced = packet;
    sequenced.sequence = submitted.sequence;
    return goes_on = use(sequenced);
  });
  if (fed.ok() && goes_on) give_told(~std::uint64_t{0});
  return fed;
}

}  // namespace hueline::apps
