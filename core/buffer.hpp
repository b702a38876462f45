#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <utility>

/// Reference-counted byte buffers from a bounded pool: an exposure of 30 MB is written once by the transport and read
/// by recorder, decoder and fusion without a copy.
namespace hueline {

class BufferPool;
struct PoolState;

/// Owner of memory that buffers lie in and that it wants back: shared memory, a library's own buffers.
class BufferLender {
 public:
  virtual ~BufferLender() = default;
  /// Nobody reads the buffer at `data` any more. Called once for each lent buffer, by whichever thread held it last.
  virtual void give_back(const std::byte* data) noexcept = 0;
};

namespace detail {
struct BufferBlock {
  std::atomic<std::uint32_t> references{1};
  std::shared_ptr<PoolState> pool;       // null: plain heap, freed on last release
  std::shared_ptr<BufferLender> lender;  // set: gets `data` back on last release
  BufferBlock* parent = nullptr;         // set: `data` lies inside this block, which is held until the last release
  std::size_t capacity = 0, size = 0;
  std::byte* data = nullptr;
};
void release(BufferBlock* block);
}  // namespace detail

/// Immutable, shared. Copying copies a reference. Thread-safe in the way std::shared_ptr is.
class Buffer {
 public:
  Buffer() = default;
  Buffer(const Buffer& other) : block_(other.block_) {
    if (block_) block_->references.fetch_add(1, std::memory_order_relaxed);
  }
  Buffer(Buffer&& other) noexcept : block_(std::exchange(other.block_, nullptr)) {}
  Buffer& operator=(Buffer other) noexcept {
    std::swap(block_, other.block_);
    return *this;
  }
  ~Buffer() {
    if (block_) detail::release(block_);
  }

  /// A heap copy of `bytes`, outside any pool: for tests, small events and files.
  static Buffer copy_of(std::span<const std::byte> bytes);

  /// `bytes` as they are, without a copy; `lender` lives at least as long as the buffer and gets them back after the
  /// last reference.
  static Buffer lent(std::shared_ptr<BufferLender> lender, std::span<const std::byte> bytes);

  /// A part of this buffer without a copy; it keeps the whole memory alive. `offset` and `size` are clipped to the
  /// buffer.
  Buffer part(std::size_t offset, std::size_t size) const;

  std::span<const std::byte> bytes() const {
    return block_ ? std::span<const std::byte>(block_->data, block_->size) : std::span<const std::byte>();
  }
  const std::byte* data() const { return block_ ? block_->data : nullptr; }
  std::size_t size() const { return block_ ? block_->size : 0; }
  bool empty() const { return size() == 0; }

 private:
  friend class MutableBuffer;
  explicit Buffer(detail::BufferBlock* block) : block_(block) {}
  detail::BufferBlock* block_ = nullptr;
};

/// Unique and writable until `share()`. Move-only.
class MutableBuffer {
 public:
  MutableBuffer() = default;
  MutableBuffer(MutableBuffer&& other) noexcept : block_(std::exchange(other.block_, nullptr)) {}
  MutableBuffer& operator=(MutableBuffer&& other) noexcept {
    std::swap(block_, other.block_);
    return *this;
  }
  ~MutableBuffer() {
    if (block_) detail::release(block_);
  }

  /// `memory` without a copy, with size() == memory.size(); as Buffer::lent().
  static MutableBuffer lent(std::shared_ptr<BufferLender> lender, std::span<std::byte> memory);

  explicit operator bool() const { return block_ != nullptr; }
  std::byte* data() { return block_->data; }
  std::size_t size() const { return block_ ? block_->size : 0; }
  std::size_t capacity() const { return block_ ? block_->capacity : 0; }
  /// Sets the used size; at most capacity().
  void resize(std::size_t size) { block_->size = size < block_->capacity ? size : block_->capacity; }
  std::span<std::byte> bytes() { return {block_->data, block_->size}; }
  /// Gives up the right to write.
  Buffer share() && { return Buffer(std::exchange(block_, nullptr)); }

 private:
  friend class BufferPool;
  explicit MutableBuffer(detail::BufferBlock* block) : block_(block) {}
  detail::BufferBlock* block_ = nullptr;
};

/// Bounded pool with power-of-two size classes; freed blocks are kept for reuse up to the limit. Thread-safe. Buffers
/// may outlive the pool.
class BufferPool {
 public:
  /// `limit_bytes`: the most that may be handed out at a time, counted by capacity.
  explicit BufferPool(std::size_t limit_bytes);

  /// A buffer of at least `size` bytes with size() == size, 64-byte aligned; an empty one when the limit is reached:
  /// the caller counts the loss as Fault Overflow.
  MutableBuffer acquire(std::size_t size);

  std::size_t bytes_in_use() const;
  std::size_t limit_bytes() const;

 private:
  std::shared_ptr<PoolState> state_;
};

}  // namespace hueline
