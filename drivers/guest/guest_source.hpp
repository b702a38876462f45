#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/packet.hpp"
#include "drivers/guest/guest_process.hpp"
#include "drivers/guest/protocol.hpp"
#include "drivers/guest/slot_memory.hpp"

namespace hueline::drivers {

/// Reads a device through a library of another maker that runs in a process of its own, the guest. If the library
/// crashes, hangs or uses too much memory, this source returns Disconnected; nothing else in the program is affected.
///
/// Packet::bytes lies in memory that both processes share: what the library wrote is recorded without a copy.
/// Packet::received is CLOCK_MONOTONIC_RAW as the guest read it.
///
/// open() takes up to 100 ms a call. It returns TimedOut while the guest is still connecting its device; call it again.
/// Its other errors are those that the guest reported about the device, and Unavailable if the guest died or hung
/// meanwhile.
/// next() returns Disconnected if the guest reported it, if the guest died (the message says by what), or if nothing
/// came from the guest for Config::hung_after. A guest that breaks the protocol is killed, and next() returns
/// Disconnected.
/// close() takes at most Config::stop_within; a guest that needs longer is killed.
///
/// If a guest ends without a message, its last will (protocol.hpp) is sent, so that the device accepts the next guest
/// at once.
/// Thread safety: none; one thread calls all functions. Buffers may outlive the source.
class GuestSource final : public PacketSource {
 public:
  struct Config {
    std::filesystem::path program = guest::guest_program();
    std::string driver;                          ///< the driver of the guest, by the rig's word
    std::string text;                            ///< the driver's settings, as config_text.hpp writes them
    std::size_t slots = 40;                      ///< packets that the guest fills or that are read here, together
    std::chrono::milliseconds hung_after{1000};  ///< longest time without a message from a guest
    /// Longest time until the first message; the program is read from disk meanwhile.
    std::chrono::milliseconds started_within{5000};
    std::chrono::milliseconds stop_within{300};  ///< longest time that a guest may take to end
  };
  explicit GuestSource(Config config) : config_(std::move(config)) {}
  ~GuestSource() override { close(); }

  Status open() override;
  Result<Packet> next(std::stop_token stop) override;
  void close() override;

  /// Returns the process id of the running guest, or 0.
  pid_t guest_pid() const { return guest_ ? guest_->pid() : 0; }

 private:
  using Event = std::variant<guest::Running, Packet>;

  Status start();
  /// Waits for the next event, at most 100 ms, then TimedOut. After any other error the guest is gone.
  Result<Event> wait_for_event();
  Result<std::optional<Event>> handle(guest::ToHost& message);
  bool is_possible(HostTime stamp) const;
  Status give_memory(std::uint64_t packet_bytes);
  Status send(const guest::ToGuest& message, int descriptor = -1);
  void give_back_returned();
  /// Kills the guest and returns the reason as an error.
  Error broken(const std::string& why);
  Error died();
  void execute_will();
  void reap();

  const Config config_;
  std::optional<guest::GuestProcess> guest_;
  std::shared_ptr<guest::SlotMemory> memory_;  // kept for the next guest
  std::optional<guest::LastWill> will_;
  bool is_handed_over_ = false;  // whether this guest has the memory
  bool was_heard_ = false;
  HostTime started_{}, heard_{}, losses_since_{};
  int losses_ = 0;  // since losses_since_
  std::vector<std::byte> message_;
};

}  // namespace hueline::drivers
