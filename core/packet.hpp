#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "core/buffer.hpp"
#include "core/fault.hpp"
#include "core/pixel_rows.hpp"
#include "core/result.hpp"
#include "core/time.hpp"

namespace hueline {

/// The kind of a packet. Everything that can change the output enters as a packet, so a replay needs nothing else.
enum class PacketKind : std::uint8_t {
  Wire = 0,     ///< bytes of a device, exactly as received
  Fault = 1,    ///< the bytes of encode_fault(); made by a reader or by Ingest
  Tick = 2,     ///< the tick of a watchdog; its bytes are those of encode_tick(), or none
  Command = 3,  ///< an operator's command: the bytes of encode_command()
  Ledger = 4,   ///< what has entered until here, by sensor: the bytes of encode_ledger() (runtime/ledger.hpp)
};

/// The smallest unit that a transport delivers whole: a datagram, a piece of a byte stream, a camera image, a PPS edge.
/// It is not changed after Ingest has accepted it; recorder and pipeline share it.
struct Packet {
  SensorId sensor = kSystemSensor;
  PacketKind kind = PacketKind::Wire;
  /// The pipeline was full when this packet arrived, so it is recorded but not decoded. Ingest decides this and records
  /// it; a replay follows the recorded decision.
  bool shed = false;
  /// Position in the one order of arrival. A gap means packets that the recorder's queue refused.
  std::uint64_t sequence = 0;
  /// The stamp that is closest to the hardware: the kernel's stamp of a datagram's arrival, the PPS edge, the end of an
  /// image.
  HostTime received{};
  Buffer bytes;  ///< exactly what arrived; decoders find the device's own stamp in it
  /// Where the samples of an uncompressed image lie in `bytes`, if the recording packs it; it changes nothing else.
  PixelRows rows{};
};
using PacketPtr = std::shared_ptr<const Packet>;

/// Returns the packet of a fault that a source noticed at `time`.
inline Packet fault_packet(HostTime time, FaultKind kind, std::uint64_t count, std::string detail) {
  const Fault fault{kSystemSensor, kind, time, count, std::move(detail)};
  return {kSystemSensor, PacketKind::Fault, false, 0, time, Buffer::copy_of(encode_fault(fault))};
}

/// Returns the bytes of a tick: how many bytes are free on the disk of the recording, as 8 bytes, little endian.
inline std::vector<std::byte> encode_tick(std::uint64_t free_bytes) {
  std::vector<std::byte> out(8);
  for (std::size_t i = 0; i < 8; ++i) out[i] = static_cast<std::byte>(free_bytes >> (8 * i));
  return out;
}
/// Returns what a tick says about the disk; empty if it says nothing.
inline std::optional<std::uint64_t> decode_tick(std::span<const std::byte> bytes) {
  if (bytes.size() != 8) return {};
  std::uint64_t out = 0;
  for (std::size_t i = 0; i < 8; ++i) out |= std::to_integer<std::uint64_t>(bytes[i]) << (8 * i);
  return out;
}

/// Interface of everything that delivers packets: hardware, recordings, simulated devices and test data.
/// Thread safety: none; one reader thread makes all calls.
class PacketSource {
 public:
  virtual ~PacketSource() = default;
  /// Connects, configures and starts the source. The caller calls it again after Disconnected. Errors: Unavailable,
  /// Invalid, Io. TimedOut means that opening continues and needs longer than about 100 ms: the caller checks whether
  /// it shall stop, and calls again.
  virtual Status open() = 0;
  /// Returns the next packet, with `kind`, `received` and `bytes` set. A source does not know which sensor of the rig
  /// it belongs to: its reader sets `sensor`. Waits for about 100 ms at most, then returns TimedOut. After Disconnected
  /// the caller waits and opens the source again. EndOfData means the end of a recording. Losses that the transport
  /// itself can see (drop counters of the kernel, incomplete images) are returned as Fault packets.
  virtual Result<Packet> next(std::stop_token stop) = 0;
  /// Closes the source.
  virtual void close() = 0;
};

}  // namespace hueline
