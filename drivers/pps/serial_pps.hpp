#pragma once

#include <memory>
#include <string>
#include <utility>

#include "drivers/pps/kernel_pps.hpp"
#include "drivers/transport/file_descriptor.hpp"

namespace hueline::drivers {

/// Reads PPS edges from the carrier-detect line (DCD) of a serial port. The kernel's own line discipline for pulses
/// (N_PPS, module pps_ldisc) stamps them in its interrupt handler and makes a device /dev/ppsN, which is read as by
/// KernelPps. The port serves the pulse alone while it is open: another program cannot read the receiver's text from
/// it. open() needs CAP_SYS_TIME, and CAP_SYS_MODULE if pps_ldisc is not loaded.
class SerialPps final : public PacketSource {
 public:
  SerialPps(std::string port, PpsEdgeKind edge) : port_(std::move(port)), edge_(edge) {}

  Status open() override;
  Result<Packet> next(std::stop_token stop) override;
  void close() override;

 private:
  const std::string port_;
  const PpsEdgeKind edge_;
  FileDescriptor tty_;
  std::unique_ptr<KernelPps> pps_;
};

/// Returns the device that the kernel made for the pulses of a serial port, such as /dev/pps1. `sysfs` is
/// /sys/class/pps; a test passes its own. Error: Unavailable.
Result<std::string> find_pps_of(const std::string& port, const std::string& sysfs = "/sys/class/pps");

}  // namespace hueline::drivers
