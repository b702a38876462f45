#pragma once

#include <memory>
#include <stop_token>
#include <vector>

#include "core/buffer.hpp"
#include "core/fault.hpp"
#include "core/result.hpp"
#include "core/time.hpp"

namespace hueline {

/// What a packet is. Everything that can change the outcome is a packet: replay needs nothing else.
enum class PacketKind : std::uint8_t {
  Wire = 0,     ///< bytes of a device, exactly as received
  Fault = 1,    ///< encode_fault(); made by the reader or by Ingest
  Tick = 2,     ///< a watchdog's tick; no bytes
  Command = 3,  ///< an operator's command, UTF-8
};

/// The smallest unit that a transport delivers whole: datagram, piece of a byte stream, camera image, PPS edge.
/// Immutable once ingested; shared between recorder and pipeline.
struct Packet {
  SensorId sensor = kSystemSensor;
  PacketKind kind = PacketKind::Wire;
  /// Decided and recorded by Ingest: the pipeline was full, so this packet is recorded but not decoded. Replay obeys
  /// it.
  bool shed = false;
  std::uint64_t sequence = 0;  ///< position in the one ingest order; gaps are packets that the recorder's queue refused
  HostTime
      received{};  ///< stamp closest to the hardware: kernel stamp of the datagram's arrival, PPS edge, image complete
  Buffer bytes;    ///< exactly what came; decoders find the device's own stamp in it
};
using PacketPtr = std::shared_ptr<const Packet>;

/// Hardware, recordings, simulated devices and vectors of a test: one interface. Thread-bound: one reader calls it.
class PacketSource {
 public:
  virtual ~PacketSource() = default;
  /// Connects, configures, starts. Called again after Disconnected. Errors: Unavailable, Invalid, Io. TimedOut: it is
  /// on the way, and needs longer than about 100 ms; the caller looks whether it shall stop, and calls again.
  virtual Status open() = 0;
  /// The next packet; `sensor`, `kind`, `received` and `bytes` are set. Waits at most about 100 ms, then TimedOut.
  /// Disconnected: the caller backs off and opens again. EndOfData: a recording is over. A Fault packet is returned for
  /// what the transport itself can see lost (kernel drop counters, incomplete images).
  virtual Result<Packet> next(std::stop_token stop) = 0;
  virtual void close() = 0;
};

}  // namespace hueline
