#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <utility>

/// Reference-counted byte buffers from a bounded pool. The transport writes an exposure of 30 MB once; recorder,
/// decoder and fusion read it without a copy.
namespace hueline {

class BufferPool;
struct PoolState;

/// The owner of memory that is lent to buffers and returned later: shared memory, or a library's own buffers.
class BufferLender {
 public:
  virtual ~BufferLender() = default;
  /// Called once for each lent buffer when nothing refers to the memory at `data` any more, on the thread that released
  /// it last.
  virtual void give_back(const std::byte* data) noexcept = 0;
};

namespace detail {
struct BufferBlock {
  std::atomic<std::uint32_t> references{1};
  std::shared_ptr<PoolState> pool;       // null: plain heap memory, freed on the last release
  std::shared_ptr<BufferLender> lender;  // if set, it gets `data` back on the last release
  BufferBlock* parent = nullptr;         // if set, `data` lies inside this block, which is kept until the last release
  std::size_t capacity = 0, size = 0;
  std::byte* data = nullptr;
};
void release(BufferBlock* block);
}  // namespace detail

/// An immutable, shared buffer. A copy refers to the same bytes. As thread-safe as std::shared_ptr.
class Buffer {
 public:
  Buffer() = default;
  Buffer(const Buffer& other) : block_(other.block_) {
    if (block_) block_->references.fetch_add(1, std::memory_order_relaxed);
  }
  Buffer(Buffer&& other) noexcept : block_(std::exchange(other.block_, nullptr)) {}
  // Not one operator that takes its operand by value: in templates clang 14 forgets to destroy the operand of `x = {}`.
  Buffer& operator=(const Buffer& other) noexcept { return *this = Buffer(other); }
  Buffer& operator=(Buffer&& other) noexcept {
    Buffer taken(std::move(other));
    std::swap(block_, taken.block_);
    return *this;
  }
  ~Buffer() {
    if (block_) detail::release(block_);
  }

  /// Copies `bytes` to the heap, outside any pool. For tests, small events and files.
  static Buffer copy_of(std::span<const std::byte> bytes);

  /// Refers to `bytes` without a copy. `lender` is kept alive at least as long as the buffer, and gets the memory back
  /// after the last reference is gone.
  static Buffer lent(std::shared_ptr<BufferLender> lender, std::span<const std::byte> bytes);

  /// Returns a part of this buffer without a copy. The part keeps the whole memory alive. `offset` and `size` are
  /// limited to the buffer.
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

/// A buffer with one owner, who may write to it until share(). It can be moved, but not copied.
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

  /// Returns a 64-byte aligned buffer on the heap, outside any pool. Its bytes are not set.
  static MutableBuffer of_size(std::size_t size);
  /// Refers to `memory` without a copy, with size() == memory.size(). The rest is as in Buffer::lent().
  static MutableBuffer lent(std::shared_ptr<BufferLender> lender, std::span<std::byte> memory);

  explicit operator bool() const { return block_ != nullptr; }
  std::byte* data() { return block_->data; }
  std::size_t size() const { return block_ ? block_->size : 0; }
  std::size_t capacity() const { return block_ ? block_->capacity : 0; }
  /// Sets the used size, at most capacity().
  void resize(std::size_t size) { block_->size = size < block_->capacity ? size : block_->capacity; }
  std::span<std::byte> bytes() { return {block_->data, block_->size}; }
  /// Converts the buffer to an immutable one and gives up the right to write.
  Buffer share() && { return Buffer(std::exchange(block_, nullptr)); }

 private:
  friend class BufferPool;
  explicit MutableBuffer(detail::BufferBlock* block) : block_(block) {}
  detail::BufferBlock* block_ = nullptr;
};

/// A bounded pool of buffers. Block sizes are powers of two; blocks that are returned are kept for reuse, up to the
/// limit. Thread-safe. Buffers may outlive the pool.
class BufferPool {
 public:
  /// `limit_bytes` is the most that may be in use at one time, counted by capacity.
  explicit BufferPool(std::size_t limit_bytes);

  /// Returns a 64-byte aligned buffer with size() == `size`. Returns an empty one if the limit is reached; the caller
  /// then reports the loss as a Fault of kind Overflow.
  MutableBuffer acquire(std::size_t size);

  std::size_t bytes_in_use() const;
  std::size_t limit_bytes() const;

 private:
  std::shared_ptr<PoolState> state_;
};

}  // namespace hueline
