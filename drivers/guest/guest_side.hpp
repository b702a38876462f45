#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "core/packet.hpp"
#include "drivers/guest/packet_memory.hpp"
#include "drivers/guest/protocol.hpp"
#include "drivers/guest/slot_memory.hpp"

namespace hueline::drivers::guest {

/// The guest's view of the memory that it shares with its host. Thread-safe.
class GuestMemory final : public PacketMemory, public BufferLender, public std::enable_shared_from_this<GuestMemory> {
 public:
  /// `ask` sends NeedMemory; the answers come to map() and add() from another thread.
  explicit GuestMemory(std::function<Status(std::uint64_t)> ask) : ask_(std::move(ask)) {}

  Status prepare(std::size_t packet_bytes) override;
  MutableBuffer acquire(std::size_t bytes) override;
  std::size_t bytes_in_use() const override;
  std::size_t limit_bytes() const override;

  Status map(const Memory& memory, int fd);
  /// The host gives these slots to write. False: one of them does not exist.
  bool add(const std::vector<std::uint32_t>& slots);
  /// Which slot a packet lies in, which the host holds from now on.
  std::uint32_t hand_out(Buffer packet);

  void give_back(const std::byte* data) noexcept override;

 private:
  std::uint32_t slot_of(const std::byte* data) const;

  const std::function<Status(std::uint64_t)> ask_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  Mapping mapping_;
  std::uint64_t slot_bytes_ = 0;
  std::size_t slots_ = 0;
  bool has_begun_ = false;           // the first slots are here
  std::vector<std::uint32_t> free_;  // the last one given back is used first: its pages are there
  std::vector<Buffer> with_host_;
};

/// A guest's conversation with its host. A thread of its own listens, and says Alive while the call under way is within
/// its time.
class HostLink {
 public:
  explicit HostLink(int socket);
  HostLink(const HostLink&) = delete;

  const Config& config() const { return config_; }
  const std::shared_ptr<GuestMemory>& memory() const { return memory_; }
  /// Requested when the host wants the guest to end.
  std::stop_token stop() const { return stop_.get_token(); }
  /// Waits for room; a host that is gone ends the process.
  void send(const ToHost& message);
  /// The call that follows may take so long; then the guest is silent, and the host ends it.
  void allow(std::chrono::milliseconds time);

 private:
  void listen();
  void take(ToGuest message, FileDescriptor descriptor);

  const int socket_;
  Config config_;
  std::shared_ptr<GuestMemory> memory_;
  std::stop_source stop_;
  std::atomic<std::int64_t> allowed_until_ns_;
  std::jthread listener_;
};

/// The life of a guest: `make` builds the source of `link.config()`, whose packets then go to the host until either
/// side ends it. Does not return: the process ends without taking the library's objects apart, for what cannot be
/// closed in order is the system's to clean up.
using MakeSource = std::function<Result<std::unique_ptr<PacketSource>>(HostLink& link)>;
[[noreturn]] void serve(int socket, const MakeSource& make);

}  // namespace hueline::drivers::guest
