#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/packet.hpp"
#include "drivers/guest/guest_process.hpp"
#include "drivers/guest/protocol.hpp"
#include "drivers/guest/slot_memory.hpp"

namespace hueline::drivers {

/// Packets of a device that is spoken to through somebody else's library, in a process of its own: the library may
/// crash, hang or eat memory, and that is Disconnected for this device and nothing for anybody else. Packet::bytes lies
/// in memory that both processes share: what the library wrote is what is recorded, without a copy. Packet::received is
/// the guest's reading of CLOCK_MONOTONIC_RAW.
///
/// open() takes up to 100 ms a call and says TimedOut while the guest is still connecting its device: call it again.
/// Unavailable, Invalid,
/// ...: what the guest said of the device; Unavailable: it died or hung on the way. next(): Disconnected when the guest
/// said so, died (the message says by what) or has not said a word for Config::hung_after. close() takes
/// Config::stop_within at most; a guest that needs longer is killed. A guest that ends without a word has its last will
/// sent (protocol.hpp), so that the device takes a successor at once. Whatever breaks the protocol is a broken guest:
/// killed, Disconnected. Thread-bound; buffers may outlive it.
class GuestSource final : public PacketSource {
 public:
  struct Config {
    SensorId sensor = 1;
    std::filesystem::path program = guest::guest_program();
    std::string driver;      ///< which of the guest's drivers: the rig's word
    std::string text;        ///< its settings, by config_text.hpp
    std::size_t slots = 40;  ///< packets that the guest is filling or that are being read here
    std::chrono::milliseconds hung_after{1000};
    std::chrono::milliseconds started_within{5000};  ///< until the first word: the program is read from disk then
    std::chrono::milliseconds stop_within{300};
  };
  explicit GuestSource(Config config) : config_(std::move(config)) {}
  ~GuestSource() override { close(); }

  Status open() override;
  Result<Packet> next(std::stop_token stop) override;
  void close() override;

  /// Of the guest that runs; 0: none.
  pid_t guest_pid() const { return guest_ ? guest_->pid() : 0; }

 private:
  using Event = std::variant<guest::Running, Packet>;

  Status start();
  /// The next thing that concerns the caller. TimedOut after 100 ms. Any other error: the guest is gone.
  Result<Event> wait_for_event();
  Result<std::optional<Event>> handle(guest::ToHost& message);
  bool is_possible(HostTime stamp) const;
  Status give_memory(std::uint64_t packet_bytes);
  Status send(const guest::ToGuest& message, int descriptor = -1);
  void give_back_returned();
  /// Ends the guest by force and says why.
  Error broken(const std::string& why);
  Error died();
  void execute_will();
  void reap();

  const Config config_;
  std::optional<guest::GuestProcess> guest_;
  std::shared_ptr<guest::SlotMemory> memory_;  // kept for the next guest
  std::optional<guest::LastWill> will_;
  bool is_handed_over_ = false;  // the memory is this guest's
  bool was_heard_ = false;
  HostTime started_{}, heard_{}, losses_since_{};
  int losses_ = 0;  // since then
  std::vector<std::byte> message_;
};

}  // namespace hueline::drivers
