#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "core/buffer.hpp"
#include "core/keys.hpp"
#include "core/packet.hpp"
#include "drivers/transport/host_clock.hpp"

namespace hueline::drivers {

/// Receives all frames of one CAN interface by SocketCAN (can0, vcan0, an slcan adapter), including CAN FD frames if
/// the interface carries them, and error frames. Each frame is one packet in the form of drivers/can/can_frame.hpp.
///
/// `received` is the kernel's time stamp of the end of the frame, converted to HostTime. The kernel takes it in the
/// adapter's interrupt; for a USB adapter it is the time at which the adapter's message came. If the adapter stamps
/// frames itself, its stamp is in the packet. The source only listens. The interface has to be set up before (`ip link
/// set can0 up type can bitrate 500000 restart-ms 100`).
///
/// Errors: next() returns Disconnected if the interface is set down or disappears; open() returns Unavailable until it
/// is back. Bus-off leaves the interface up; it arrives as an error frame, and so does the restart after it. Fault
/// packets: Overflow, if the socket's buffer or the pool was full.
/// Thread safety: none; one thread calls all functions.
class CanSource final : public PacketSource {
 public:
  struct Config {
    std::string interface;  ///< name of the network interface, 1 to 15 characters
    /// Size of the receive buffer that is requested from the kernel. A frame takes about 0.8 kB of it, so 2 MiB hold
    /// 0.5 s of a full 500 kbit/s bus.
    int receive_buffer_bytes = 2 << 20;
    int batch = 64;  ///< largest number of frames that one system call takes

    void visit(Keys& keys);
    KeyError validate() const;
  };

  CanSource(Config config, BufferPool pool);
  ~CanSource() override;
  CanSource(const CanSource&) = delete;
  CanSource& operator=(const CanSource&) = delete;

  Status open() override;
  Result<Packet> next(std::stop_token stop) override;
  void close() override;

 private:
  struct Slot;
  Status read();
  void deliver(Slot& slot, std::size_t size, const ClockOffset& offset);
  void push_overflow(HostTime time, std::uint64_t count, std::string detail);
  Error gone(const std::string& attempted, int why) const;

  const Config config_;
  BufferPool pool_;
  std::vector<Slot> slots_;
  std::deque<Packet> pending_;
  int fd_ = -1;
  std::uint32_t kernel_drops_ = 0;  ///< last value of the socket's drop counter (SO_RXQ_OVFL)
};

}  // namespace hueline::drivers
