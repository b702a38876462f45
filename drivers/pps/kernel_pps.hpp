#pragma once

#include <optional>
#include <string>
#include <utility>

#include "core/packet.hpp"
#include "drivers/pps/edge_placer.hpp"
#include "drivers/pps/pps_packet.hpp"

namespace hueline::drivers {

/// Reads PPS edges from /dev/ppsN (RFC 2783, linux/pps.h). PpsSource says what it promises.
class KernelPps : public PacketSource {
 public:
  KernelPps(std::string path, PpsEdgeKind edge) : path_(std::move(path)), edge_(edge) {}
  ~KernelPps() override { close(); }
  KernelPps(const KernelPps&) = delete;
  KernelPps& operator=(const KernelPps&) = delete;

  Status open() override;
  Result<Packet> next(std::stop_token stop) override;
  void close() override;

 private:
  /// The latest edge of the configured kind that the kernel holds.
  struct Seen {
    std::uint32_t sequence = 0;
    nanoseconds stamp{0};  ///< on CLOCK_REALTIME
  };
  /// Waits for a new edge of either kind. If `wait` is zero, it returns at once what there is.
  Result<Seen> fetch(nanoseconds wait) const;
  Status capture() const;
  Result<Packet> deliver(const Seen& seen, const ClockReading& now);
  Packet fault(const ClockReading& now, std::uint64_t count, std::string detail) const;
  bool is_gone() const;

  const std::string path_;
  const PpsEdgeKind edge_;
  int fd_ = -1;
  std::uint32_t last_sequence_ = 0;  // as the kernel counts, in 32 bits
  std::uint64_t sequence_ = 0;       // the same without wrapping
  ClockReading last_look_;           // when the device held last_sequence_ and nothing newer
  std::optional<Packet> held_;       // the edge that follows a Fault packet
};

}  // namespace hueline::drivers
