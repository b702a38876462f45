#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "core/mutex.hpp"
#include "core/packet.hpp"
#include "drivers/guest/packet_memory.hpp"
#include "drivers/guest/protocol.hpp"
#include "drivers/guest/slot_memory.hpp"

namespace hueline::drivers::guest {

/// The guest's end of the memory that it shares with the host. Thread-safe.
class GuestMemory final : public PacketMemory, public BufferLender, public std::enable_shared_from_this<GuestMemory> {
 public:
  /// `ask` sends NeedMemory. The answers come to map() and add() from another thread.
  explicit GuestMemory(std::function<Status(std::uint64_t)> ask) : ask_(std::move(ask)) {}

  Status prepare(std::size_t packet_bytes) override;
  MutableBuffer acquire(std::size_t bytes) override;
  std::size_t bytes_in_use() const override;
  std::size_t limit_bytes() const override;

  /// Maps the memory that the host made; `fd` came with the message.
  Status map(const Memory& memory, int fd);
  /// Takes slots that the host gives to the guest. Returns false if one of them does not exist.
  bool add(const std::vector<std::uint32_t>& slots);
  /// Gives a packet to the host and returns its slot. The host holds it from then on.
  std::uint32_t hand_out(Buffer packet);

  void give_back(const std::byte* data) noexcept override;

 private:
  std::uint32_t slot_of(const std::byte* data) const HUELINE_REQUIRES(mutex_);

  const std::function<Status(std::uint64_t)> ask_;
  mutable Mutex mutex_;
  std::condition_variable_any changed_;
  Mapping mapping_ HUELINE_GUARDED_BY(mutex_);
  std::uint64_t slot_bytes_ HUELINE_GUARDED_BY(mutex_) = 0;
  std::size_t slots_ HUELINE_GUARDED_BY(mutex_) = 0;
  bool has_begun_ HUELINE_GUARDED_BY(mutex_) = false;  // whether the first slots have come
  // The slot given back last is used first, because its pages are already in memory.
  std::vector<std::uint32_t> free_ HUELINE_GUARDED_BY(mutex_);
  std::vector<Buffer> with_host_ HUELINE_GUARDED_BY(mutex_);
};

/// The guest's connection to its host. A thread of its own receives messages, and sends Alive while the library's
/// current call is within its allowed time.
class HostLink {
 public:
  explicit HostLink(int socket);
  HostLink(const HostLink&) = delete;

  /// Returns the settings that the host sent first.
  const Config& config() const { return config_; }
  const std::shared_ptr<GuestMemory>& memory() const { return memory_; }
  /// Returns the token by which the host asks the guest to end.
  std::stop_token stop() const { return stop_.get_token(); }
  /// Sends a message. Waits while the socket is full. If the host is gone, it ends the process.
  void send(const ToHost& message);
  /// Sets how long the library's next call may take. After that the guest stops sending Alive, and the host ends it.
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

/// Runs a guest: `make` makes the source of `link.config()`, whose packets are sent to the host until either side ends.
/// It does not return. The process ends without destroying the library's objects; the operating system cleans up what
/// cannot be closed in order.
using MakeSource = std::function<Result<std::unique_ptr<PacketSource>>(HostLink& link)>;
[[noreturn]] void serve(int socket, const MakeSource& make);

}  // namespace hueline::drivers::guest
