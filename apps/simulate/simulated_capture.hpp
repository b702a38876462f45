#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <vector>

#include "config/rig.hpp"
#include "core/packet.hpp"
#include "sim/drive.hpp"
#include "sim/faults/faulty_disk.hpp"
#include "sim/wire/timeline.hpp"

/// The capture of a simulated drive on a computer whose disk or program fails. It works like `hueline capture`, but in
/// drive time: the queue, the recorder and the recording are the real ones, and the disk below them is sim::FaultyDisk.
namespace hueline::apps {

/// What a simulated capture received, accepted and promised.
struct SimulatedCapture {
  struct Submitted {
    std::uint64_t sequence;
    SensorId sensor;
    PacketKind kind;
    std::uint32_t bytes;
    bool is_accepted;  ///< false: the recorder's queue was full
  };
  std::vector<Submitted> packets;  ///< packets of for_each_simulated_packet in their order, as long as the program ran
  std::map<std::uint64_t, Packet> told;  ///< packets that the program itself inserted between them, by sequence
  /// Time at which the program ended: it was killed, lost power, had its recording refused, or the drive was over.
  HostTime end{};
  sim::FaultyDisk::Death death = sim::FaultyDisk::Death::None;
  Status recording;  ///< status of the recording at the program's end; ok if the program died
  /// All accepted packets with a smaller sequence must be found in the file. The value follows from the status at the
  /// program's end, or from what a recording promises at any moment (docs/operating.md).
  std::uint64_t promised_end = 0;
};

/// The most memory that waits for the disk. It is what the smallest `capture --buffer` leaves for the disk, so that a
/// full queue shows in drives of a few seconds.
constexpr std::size_t kSimulatedQueueBytes = 8'000'000;

/// Captures a drive on a computer with the faults of `disk`. `file` receives what is found when the computer runs
/// again; its folder must exist.
/// Errors: those of for_each_simulated_packet; Io if the recording could not be started or the real file failed.
Result<SimulatedCapture> capture_on_faulty_disk(const sim::Drive& drive, const sim::Timeline& timeline,
                                                const config::Rig& rig, sim::FaultyDisk& disk,
                                                const std::filesystem::path& file,
                                                std::size_t queue_bytes = kSimulatedQueueBytes);

/// Calls `use` with the packets that the capture accepted, including its own, in the order of their sequence and as
/// they were before they were written. Stops when `use` returns false.
Status for_each_accepted_packet(const SimulatedCapture& capture, const sim::Drive& drive, const sim::Timeline& timeline,
                                const config::Rig& rig, const std::function<bool(const Packet&)>& use);

}  // namespace hueline::apps
