#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <vector>

#include "core/time.hpp"
#include "drivers/transport/ip_extractor.hpp"

namespace hueline::drivers {

/// One direction of a TCP connection: the bytes that `source` sends to `destination`.
struct TcpFlow {
  IpAddress source{}, destination{};
  std::uint16_t source_port = 0, destination_port = 0;
  auto operator<=>(const TcpFlow&) const = default;
};

/// Bytes of a flow, in the order in which they were sent.
struct TcpPiece {
  TcpFlow flow;
  HostTime received{};        ///< when the capture had all bytes up to the end of this piece; never decreases in a flow
  bool is_beginning = false;  ///< the first piece of a connection whose beginning was captured
  /// The piece does not follow the one before: bytes are missing in the capture, or a new connection has the same
  /// addresses and ports.
  bool is_interrupted = false;
  std::uint64_t missing = 0;     ///< bytes before this piece that the capture does not have; 0 for a new connection
  std::vector<std::byte> bytes;  ///< may be empty if bytes are missing at the end of a flow
};

/// Puts the segments of TCP connections in order: segments that come late, twice or overlap. A segment that waits for
/// one before it is held until 256 KiB or 1024 segments of its flow wait; then the one before counts as missing in the
/// capture. At most 256 flows are followed; the one that has been silent for longest gives way to a new one.
/// A connection whose beginning is not in the capture is read from its first segment on.
/// Thread safety: none; one thread calls all functions.
/// Source: RFC 9293.
class TcpStreams {
 public:
  /// Takes a segment that was captured at `time`.
  void take(const TcpSegment& segment, HostTime time);
  /// Returns the next piece that is in order, or nothing if more segments are needed.
  std::optional<TcpPiece> next();
  /// Releases the segments that wait for others. Call it after the last segment.
  void finish();

  /// Returns the bytes that came a second time and were left out.
  std::uint64_t repeated_bytes() const { return repeated_; }

 private:
  struct Waiting {
    HostTime time{};
    std::vector<std::byte> bytes;
    std::size_t cut_off = 0;
  };
  /// Positions count the bytes of the flow; the lower 32 bits are TCP's sequence number.
  struct State {
    std::uint64_t first = 0, next = 0;
    HostTime newest{};
    std::uint64_t used = 0;                             ///< running number of the segment that came last
    bool is_beginning = false, is_interrupted = false;  // of the next piece
    std::uint64_t missing = 0;
    std::map<std::uint64_t, Waiting> waiting;
    std::size_t waiting_bytes = 0;
  };

  State& state_of(const TcpFlow& flow);
  void begin(State& state, std::uint32_t sequence);
  void deliver(const TcpFlow& flow, State& state, HostTime time, std::uint64_t at, std::span<const std::byte> bytes,
               std::size_t cut_off);
  void release(const TcpFlow& flow, State& state, bool gives_up);
  void close(const TcpFlow& flow, State& state);

  std::map<TcpFlow, State> flows_;
  std::deque<TcpPiece> ready_;
  std::uint64_t segments_ = 0, repeated_ = 0;
};

}  // namespace hueline::drivers
