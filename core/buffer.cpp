#include "core/buffer.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <new>
#include <vector>

#include "core/mutex.hpp"

namespace hueline {

struct PoolState {
  explicit PoolState(std::size_t limit) : limit_bytes(limit) {}
  ~PoolState();

  const std::size_t limit_bytes;
  mutable Mutex mutex;
  std::size_t in_use HUELINE_GUARDED_BY(mutex) = 0;  // handed out now, by capacity
  std::size_t idle HUELINE_GUARDED_BY(mutex) = 0;    // waiting in `free`, by capacity
  std::array<std::vector<detail::BufferBlock*>, 64> free HUELINE_GUARDED_BY(mutex);
};

namespace {

constexpr std::align_val_t kAlignment{64};
constexpr std::size_t kSmallest = 256;

detail::BufferBlock* allocate(std::size_t capacity) {
  auto* block = new detail::BufferBlock;
  block->data = static_cast<std::byte*>(::operator new(capacity, kAlignment));
  block->capacity = capacity;
  return block;
}
detail::BufferBlock* lend(std::shared_ptr<BufferLender> lender, std::byte* data, std::size_t size) {
  auto* block = new detail::BufferBlock;
  block->lender = std::move(lender);
  block->data = data;
  block->capacity = block->size = size;
  return block;
}
void destroy(detail::BufferBlock* block) {
  ::operator delete(block->data, kAlignment);
  delete block;
}
std::size_t size_class(std::size_t capacity) { return static_cast<std::size_t>(std::countr_zero(capacity)); }

}  // namespace

PoolState::~PoolState() {
  for (auto& blocks : free)
    for (auto* block : blocks) destroy(block);
}

void detail::release(BufferBlock* block) {
  if (block->references.fetch_sub(1, std::memory_order_acq_rel) != 1) return;
  if (block->parent) {
    BufferBlock* const parent = block->parent;
    delete block;
    return release(parent);
  }
  if (block->lender) {
    block->lender->give_back(block->data);
    delete block;
    return;
  }
  if (!block->pool) return destroy(block);
  const std::shared_ptr<PoolState> pool = std::move(block->pool);
  {
    Lock lock(pool->mutex);
    pool->in_use -= block->capacity;
    if (pool->in_use + pool->idle + block->capacity <= pool->limit_bytes) {
      pool->free[size_class(block->capacity)].push_back(block);
      pool->idle += block->capacity;
      return;
    }
  }
  destroy(block);
}

Buffer Buffer::copy_of(std::span<const std::byte> bytes) {
  auto* block = allocate(bytes.size() ? bytes.size() : 1);
  block->size = bytes.size();
  if (!bytes.empty()) std::memcpy(block->data, bytes.data(), bytes.size());
  return Buffer(block);
}

Buffer Buffer::lent(std::shared_ptr<BufferLender> lender, std::span<const std::byte> bytes) {
  // The cast is safe, because nothing writes through a Buffer.
  return Buffer(lend(std::move(lender), const_cast<std::byte*>(bytes.data()), bytes.size()));
}

MutableBuffer MutableBuffer::of_size(std::size_t size) {
  auto* block = allocate(size ? size : 1);
  block->size = size;
  return MutableBuffer(block);
}

MutableBuffer MutableBuffer::lent(std::shared_ptr<BufferLender> lender, std::span<std::byte> memory) {
  return MutableBuffer(lend(std::move(lender), memory.data(), memory.size()));
}

Buffer Buffer::part(std::size_t offset, std::size_t size) const {
  if (!block_) return {};
  const std::size_t first = std::min(offset, block_->size);
  auto* block = new detail::BufferBlock;
  block->parent = block_->parent ? block_->parent : block_;
  block->parent->references.fetch_add(1, std::memory_order_relaxed);
  block->data = block_->data + first;
  block->size = block->capacity = std::min(size, block_->size - first);
  return Buffer(block);
}

BufferPool::BufferPool(std::size_t limit_bytes) : state_(std::make_shared<PoolState>(limit_bytes)) {}

MutableBuffer BufferPool::acquire(std::size_t size) {
  const std::size_t capacity = std::bit_ceil(size < kSmallest ? kSmallest : size);
  detail::BufferBlock* block = nullptr;
  std::vector<detail::BufferBlock*> evicted;  // freed outside the lock
  {
    Lock lock(state_->mutex);
    if (state_->in_use + capacity > state_->limit_bytes) return {};
    auto& reusable = state_->free[size_class(capacity)];
    if (!reusable.empty()) {
      block = reusable.back();
      reusable.pop_back();
      state_->idle -= capacity;
    } else {
      // Idle blocks of other sizes are freed, so that the limit holds for the pool's whole memory.
      for (auto& blocks : state_->free)
        while (!blocks.empty() && state_->in_use + state_->idle + capacity > state_->limit_bytes) {
          state_->idle -= blocks.back()->capacity;
          evicted.push_back(blocks.back());
          blocks.pop_back();
        }
    }
    state_->in_use += capacity;
  }
  for (auto* idle : evicted) destroy(idle);
  if (!block) block = allocate(capacity);
  block->references.store(1, std::memory_order_relaxed);
  block->pool = state_;
  block->size = size;
  return MutableBuffer(block);
}

std::size_t BufferPool::bytes_in_use() const {
  Lock lock(state_->mutex);
  return state_->in_use;
}
std::size_t BufferPool::limit_bytes() const { return state_->limit_bytes; }

}  // namespace hueline
