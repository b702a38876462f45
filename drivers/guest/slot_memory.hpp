#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "core/buffer.hpp"
#include "core/result.hpp"
#include "drivers/transport/file_descriptor.hpp"

namespace hueline::drivers::guest {

/// Mapped memory; unmapped at the end.
class Mapping {
 public:
  Mapping() = default;
  /// Of the whole file behind `fd`, shared.
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

/// The host's side of the memory that packets of a guest lie in: a memfd of equal slots, sealed so that nobody can
/// shrink it under a reader. A slot is the guest's to write, or lent to readers as a Buffer, or back from them. Buffers
/// keep the memory alive. Thread-safe: the last reader of a buffer gives its slot back from its own thread.
class SlotMemory final : public BufferLender, public std::enable_shared_from_this<SlotMemory> {
 public:
  /// Invalid: a size beyond protocol.hpp's bounds. Io.
  static Result<std::shared_ptr<SlotMemory>> create(std::uint64_t packet_bytes, std::size_t slots);

  int fd() const { return file_.get(); }
  std::uint64_t slot_bytes() const { return slot_bytes_; }
  std::size_t slots() const { return states_.size(); }

  /// For a new guest, when the old one is dead: every slot that nobody reads. They are the guest's then.
  std::vector<std::uint32_t> hand_over();
  /// Slots that readers gave back since the last call. They are the guest's then.
  std::vector<std::uint32_t> take_returned();
  /// What the guest wrote into a slot. Empty: the slot is not the guest's, or has no room for so much: the guest is
  /// broken.
  Buffer lend(std::uint32_t slot, std::uint64_t bytes);

  void give_back(const std::byte* data) noexcept override;

 private:
  enum class State : std::uint8_t { Guest, Lent, Returned };
  SlotMemory(FileDescriptor file, Mapping mapping, std::uint64_t slot_bytes, std::size_t slots);

  const FileDescriptor file_;
  const Mapping mapping_;
  const std::uint64_t slot_bytes_;
  std::mutex mutex_;
  std::vector<State> states_;
  std::vector<std::uint32_t> returned_;  // reserved for all
};

}  // namespace hueline::drivers::guest
