#pragma once

#include <netinet/in.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <utility>

#include "sim/devices/camera_registers.hpp"
#include "sim/wire/little_endian.hpp"

namespace hueline::sim {

/// A request to send packets of an image again, from `first` to `last`.
struct GvcpResend {
  std::uint16_t block_id = 0;
  std::uint32_t first = 0, last = 0;
};

/// What a control datagram causes.
struct GvcpOutcome {
  Bytes answer;  ///< empty: there is no answer
  bool is_test_packet_due = false;
  bool has_resend = false;
  GvcpResend resend;
};

/// The control side of a GigE Vision camera (GVCP 1.x): discovery, registers, memory, one controller with a heartbeat,
/// packet resend. It takes bytes and times and returns bytes; it has no socket and no clock. Thread safety: none.
class GvcpControl {
 public:
  explicit GvcpControl(std::unique_ptr<CameraRegisters> registers) : registers_(std::move(registers)) {}

  /// Handles a datagram that came from `from` at `now_ns`.
  GvcpOutcome handle(std::span<const std::byte> datagram, const sockaddr_in& from, std::int64_t now_ns);
  /// Drops a controller that was silent for longer than its heartbeat timeout, and stops the stream. Returns true if it
  /// dropped one.
  bool check_heartbeat(std::int64_t now_ns);

  /// Returns whether a client controls the camera.
  bool is_controlled() const { return is_controlled_; }
  CameraRegisters& registers() { return *registers_; }

 private:
  std::uint16_t write_register(std::uint32_t address, std::span<const std::byte> bytes, const sockaddr_in& from,
                               GvcpOutcome& outcome);
  bool is_controller(const sockaddr_in& address) const;
  void release();

  std::unique_ptr<CameraRegisters> registers_;
  bool is_controlled_ = false;
  sockaddr_in controller_{};
  std::int64_t heard_ns_ = 0;
};

}  // namespace hueline::sim
