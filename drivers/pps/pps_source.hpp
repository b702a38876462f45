#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "core/packet.hpp"
#include "drivers/pps/pps_packet.hpp"

namespace hueline::drivers {

/// Reads PPS edges from the kernel (/dev/ppsN, RFC 2783; the carrier-detect line of a serial port; a GPIO line) or from
/// a local socket. Packet::bytes has the 24 bytes of pps_packet.hpp; Packet::received is the time of the edge itself.
/// The kernel is asked for the configured edge only; a socket delivers every edge that it gets. Lost edges show in the
/// sequence, and PpsDecoder counts them.
///
/// Kernel: stamps are on CLOCK_REALTIME and are converted to HostTime at once. A step of CLOCK_REALTIME is reported as
/// Fault ClockStep and does not move an edge: the offset between the clocks is known before and after the edge, and
/// only one of the two offsets puts the edge between the two looks at the device. If both do (a step shorter than the
/// wait), the edge is refused, not guessed. If the clock is set twice within one wait, an edge may be wrong by as much
/// as the shorter wait hides, at most 100 ms. If the device node vanishes, next() returns Disconnected. CAP_SYS_TIME is
/// needed only if the device must be told to capture the edge.
///
/// Serial port (serial_pps.hpp): as Kernel. GPIO line (gpio_pps.hpp): stamps are on CLOCK_MONOTONIC, which never steps.
///
/// Socket: AF_UNIX, SOCK_SEQPACKET; this side connects. Each message is one edge with the HostTime of the same
/// computer. If the peer closes the socket, next() returns Disconnected. Messages that are no edge are delivered with
/// `received` = now, and PpsDecoder reports them. Impossible stamps are handled where all packets enter (Ingest).
///
/// Thread safety: none; one thread calls all functions. next() waits at most about 100 ms.
class PpsSource : public PacketSource {
 public:
  enum class Interface : std::uint8_t { Kernel, Socket, Serial, Gpio };
  struct Config {
    Interface interface = Interface::Kernel;
    std::string path = "/dev/pps0";  ///< path of the device, the socket, the serial port or the GPIO chip
    std::uint32_t line = 0;          ///< GPIO only: number of the line in the chip
    PpsEdgeKind edge =
        PpsEdgeKind::Assert;  ///< not of a socket: the edge that is captured; give PpsDecoder the same one
    /// Returns an empty text if all values are allowed, else a sentence that names the key.
    std::string validate() const;
  };
  explicit PpsSource(Config config);
  ~PpsSource() override;

  Status open() override { return source_->open(); }
  Result<Packet> next(std::stop_token stop) override { return source_->next(std::move(stop)); }
  void close() override { source_->close(); }

 private:
  std::unique_ptr<PacketSource> source_;
};

}  // namespace hueline::drivers
