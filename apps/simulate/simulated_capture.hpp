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

/// A capture of a simulated drive on a computer whose disk or program fails, as `hueline capture` would run it but in
/// drive time: its queue, its recorder and its recording are the real ones, the disk below is sim::FaultyDisk.
namespace hueline::apps {

struct SimulatedCapture {
  struct Submitted {
    std::uint64_t sequence;
    SensorId sensor;
    PacketKind kind;
    std::uint32_t bytes;
    bool is_accepted;  ///< else the recorder's queue was full
  };
  std::vector<Submitted> packets;        ///< of for_each_simulated_packet in its order, as long as the program ran
  std::map<std::uint64_t, Packet> told;  ///< what the program itself put between them, by sequence
  HostTime end{};  ///< of the program: killed, powerless, its recording refused, or the drive over
  sim::FaultyDisk::Death death = sim::FaultyDisk::Death::None;
  Status recording;  ///< what the program says at its end; ok if it died
  /// Of the packets, all accepted ones below this sequence must be found in the file: what the program says at its end,
  /// or what a recording promises at any moment (docs/operating.md).
  std::uint64_t promised_end = 0;
};

/// The most memory that waits for the disk: what the smallest `capture --buffer` leaves for it, so that drives of
/// seconds show what a full queue does.
constexpr std::size_t kSimulatedQueueBytes = 8'000'000;

/// `file` is what is found when the computer runs again; its folder exists. Errors: those of for_each_simulated_packet;
/// Io: the recording could not be begun, or the real file failed.
Result<SimulatedCapture> capture_on_faulty_disk(const sim::Drive& drive, const sim::Timeline& timeline,
                                                const config::Rig& rig, sim::FaultyDisk& disk,
                                                const std::filesystem::path& file,
                                                std::size_t queue_bytes = kSimulatedQueueBytes);

/// The packets that the capture accepted, its own included, in their sequence, before they were written. `use`: false
/// ends.
Status for_each_accepted_packet(const SimulatedCapture& capture, const sim::Drive& drive, const sim::Timeline& timeline,
                                const config::Rig& rig, const std::function<bool(const Packet&)>& use);

}  // namespace hueline::apps
