#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "core/buffer.hpp"
#include "core/mutex.hpp"
#include "core/result.hpp"
#include "drivers/transport/file_descriptor.hpp"

namespace hueline::drivers::guest {

/// Owns a memory mapping.
class Mapping {
 public:
  Mapping() = default;
  /// Maps the first `bytes` of the file behind `fd`, shared with other processes.
  static Result<Mapping> map(int fd, std::size_t bytes, bool is_writable);
  Mapping(Mapping&& other) noexcept : bytes_(std::exchange(other.bytes_, {})) {}
  Mapping& operator=(Mapping&& other) noexcept {
    std::swap(bytes_, other.bytes_);
    return *this;
  }
  ~Mapping();
  std::span<std::byte> bytes() const { return bytes_; }

 private:
  std::span<std::byte> bytes_;
};

/// The host's end of the memory that holds the packets of a guest: a memfd of equal slots, sealed so that nobody can
/// shrink it while it is read. Each slot belongs to the guest, which may write it, or is lent to readers as a Buffer,
/// or has come back from them. Buffers keep the memory alive.
/// Thread-safe, because the last reader of a buffer gives its slot back from its own thread.
class SlotMemory final : public BufferLender, public std::enable_shared_from_this<SlotMemory> {
 public:
  /// Makes the memory. Errors: Invalid (a size beyond the bounds of protocol.hpp), Io.
  static Result<std::shared_ptr<SlotMemory>> create(std::uint64_t packet_bytes, std::size_t slots);

  int fd() const { return file_.get(); }
  std::uint64_t slot_bytes() const { return slot_bytes_; }
  std::size_t slots() const { return slots_; }

  /// Gives all slots that nobody reads to a new guest, after the old one is dead. Returns them.
  std::vector<std::uint32_t> hand_over();
  /// Gives the slots that readers gave back since the last call to the guest. Returns them.
  std::vector<std::uint32_t> take_returned();
  /// Lends what the guest wrote into a slot. Returns an empty buffer if the slot does not belong to the guest or has
  /// less room; the guest is then broken.
  Buffer lend(std::uint32_t slot, std::uint64_t bytes);

  void give_back(const std::byte* data) noexcept override;

 private:
  enum class State : std::uint8_t { Guest, Lent, Returned };
  SlotMemory(FileDescriptor file, Mapping mapping, std::uint64_t slot_bytes, std::size_t slots);

  const FileDescriptor file_;
  const Mapping mapping_;
  const std::uint64_t slot_bytes_;
  const std::size_t slots_;
  Mutex mutex_;
  std::vector<State> states_ HUELINE_GUARDED_BY(mutex_);
  std::vector<std::uint32_t> returned_
      HUELINE_GUARDED_BY(mutex_);  // has room for all slots, so that give_back() allocates nothing
};

}  // namespace hueline::drivers::guest
