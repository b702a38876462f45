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

/// All frames of one CAN interface (SocketCAN: can0, vcan0, an slcan adapter), CAN FD where the interface carries it,
/// error frames included: a packet a frame, in the form of drivers/can/can_frame.hpp. `received` is the kernel's stamp
/// of the end of the frame, taken in the adapter's interrupt (adapters on USB: when their message came), converted to
/// HostTime; the adapter's own stamp, where it makes one, is in the packet. Listens only; the interface is set up by
/// others (`ip link set can0 up type can bitrate 500000 restart-ms 100`).
///
/// Disconnected: the interface was set down or went away; open() is Unavailable until it is back. Bus-off leaves the
/// interface up: it comes as an error frame, and so does the restart. Fault packets: Overflow (the socket's buffer or
/// the pool was full). Thread-bound.
class CanSource final : public PacketSource {
 public:
  struct Config {
    std::string interface;  ///< network interface, 1 to 15 characters
    /// Asked of the kernel; a frame takes about 0.8 kB of it, so 2 MiB hold 0.5 s of a full 500 kbit/s bus.
    int receive_buffer_bytes = 2 << 20;
    int batch = 64;  ///< frames taken by one system call

    void visit(Keys& keys);
    KeyError validate() const;
  };

  CanSource(SensorId sensor, Config config, BufferPool pool);
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

  const SensorId sensor_;
  const Config config_;
  BufferPool pool_;
  std::vector<Slot> slots_;
  std::deque<Packet> pending_;
  int fd_ = -1;
  std::uint32_t kernel_drops_ = 0;  ///< running total of SO_RXQ_OVFL
};

}  // namespace hueline::drivers
