#pragma once

#include <memory>
#include <string>

#include "core/packet.hpp"
#include "drivers/pps/pps_packet.hpp"

namespace hueline::drivers {

/// PPS edges from the kernel (/dev/ppsN, RFC 2783) or from a local socket. Packet::bytes is the 24 bytes of
/// pps_packet.hpp and Packet::received the edge itself. Every edge that comes over the socket is handed on; of the
/// kernel only the configured one is asked for. Lost edges show in the sequence and are counted by PpsDecoder.
///
/// Kernel: stamps are CLOCK_REALTIME, converted to HostTime at once. A step of CLOCK_REALTIME is reported as Fault
/// ClockStep and does not move an edge: the offset between the clocks is known before and after the edge, and only one
/// of the two puts the edge between two looks at the device. Where both do (a step shorter than the wait) the edge is
/// refused, not guessed. Set twice within one wait, the clock may leave an edge wrong by as much as the shorter wait
/// hides: at most 100 ms. A device node that vanishes is Disconnected. Needs CAP_SYS_TIME only if the device must be
/// told to capture the edge.
///
/// Socket: SOCK_SEQPACKET of AF_UNIX, this side connects; one message an edge, HostTime of the same machine. A peer
/// that hangs up is Disconnected. Messages that are not an edge are handed on with `received` = now (PpsDecoder says
/// what is wrong). Stamps that cannot be are judged where all packets enter.
///
/// Thread-bound. next() waits at most about 100 ms.
class PpsSource : public PacketSource {
 public:
  enum class Interface : std::uint8_t { Kernel, Socket };
  struct Config {
    SensorId sensor = 1;
    Interface interface = Interface::Kernel;
    std::string path = "/dev/pps0";          ///< of the device or of the socket
    PpsEdgeKind edge = PpsEdgeKind::Assert;  ///< kernel only: the edge to capture; give PpsDecoder the same
    /// Empty when fine, else a sentence that names the key.
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
