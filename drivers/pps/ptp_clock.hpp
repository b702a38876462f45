#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "core/packet.hpp"
#include "drivers/pps/ptp_packet.hpp"
#include "drivers/transport/file_descriptor.hpp"

namespace hueline::drivers {

/// Reads a PTP hardware clock (/dev/ptpN, linux/ptp_clock.h), which ptp4l of linuxptp sets, and compares it with the
/// computer's clock soon after each of its seconds begins. Where the hardware reads both at once, that is used
/// (PTP_SYS_OFFSET_PRECISE), else the shortest of several comparisons (PTP_SYS_OFFSET_EXTENDED, or PTP_SYS_OFFSET).
///
/// Packet::bytes has the 32 bytes of ptp_packet.hpp; Packet::received is the HostTime of the comparison. A second that
/// passed while this program did not run has no packet.
/// Errors of open(): Unavailable (no such device, or no right to it), Unsupported (it is no PTP clock). Of next():
/// TimedOut; Stopped; Disconnected, if the clock is gone.
/// Thread safety: none; one thread calls all functions. next() waits at most about 100 ms.
class PtpClock final : public PacketSource {
 public:
  explicit PtpClock(std::string path) : path_(std::move(path)) {}

  Status open() override;
  Result<Packet> next(std::stop_token stop) override;
  void close() override { clock_ = {}; }

 private:
  enum class Comparison : std::uint8_t { Precise, Extended, Basic };
  Result<PtpPacket> compare(Comparison how) const;
  Result<PtpPacket> compare();

  const std::string path_;
  FileDescriptor clock_;
  Comparison how_ = Comparison::Precise;
  std::optional<std::int64_t> awaited_;  // the second of the PTP clock that is delivered next
  std::uint64_t sequence_ = 0;
};

}  // namespace hueline::drivers
