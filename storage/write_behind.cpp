#include "storage/write_behind.hpp"

#include <pthread.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <new>
#include <utility>

namespace hueline::storage {

WriteBehind::WriteBehind(std::size_t piece_bytes, Write write) : write_(std::move(write)) {
  for (Piece& piece : pieces_) {
    piece.memory = BlockMemory::of(piece_bytes + BlockMemory::kBlock);
    if (!piece.memory.bytes) throw std::bad_alloc();
  }
  thread_ = std::thread([this] { write_pieces(); });
}

WriteBehind::~WriteBehind() {
  {
    const std::lock_guard lock(mutex_);
    is_ending_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

std::byte* WriteBehind::free_piece() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return handed_over_ - written_ < kPieces; });
  return error_ == 0 ? pieces_[handed_over_ % kPieces].memory.bytes.get() : nullptr;
}

void WriteBehind::hand_over(std::uint64_t offset, std::size_t begin, std::size_t size) {
  {
    const std::lock_guard lock(mutex_);
    Piece& piece = pieces_[handed_over_++ % kPieces];
    piece.offset = offset;
    piece.begin = begin;
    piece.size = size;
  }
  changed_.notify_all();
}

bool WriteBehind::is_settled() {
  const std::lock_guard lock(mutex_);
  return handed_over_ == written_;
}

int WriteBehind::settle(std::uint64_t& missing) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return handed_over_ == written_; });
  missing = missing_;
  return error_;
}

void WriteBehind::forget() {
  std::uint64_t missing = 0;
  (void)settle(missing);
  const std::lock_guard lock(mutex_);
  error_ = 0;
  missing_ = 0;
}

/// Returns how many of the waiting pieces can be written by one call: those that follow each other at blocks.
std::size_t WriteBehind::count_together() const {
  std::size_t count = 1;
  for (; count < kMostAtOnce && written_ + count < handed_over_; ++count) {
    const Piece& before = pieces_[(written_ + count - 1) % kPieces];
    const Piece& next = pieces_[(written_ + count) % kPieces];
    if (before.offset + before.size != next.offset || next.offset % BlockMemory::kBlock != 0) break;
  }
  return count;
}

void WriteBehind::write_pieces() {
  ::pthread_setname_np(::pthread_self(), "write-behind");
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [&] { return is_ending_ || written_ < handed_over_; });
    if (written_ == handed_over_) return;
    const std::size_t count = count_together();
    const std::uint64_t offset = pieces_[written_ % kPieces].offset;
    std::array<iovec, kMostAtOnce> parts;
    std::uint64_t left = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const Piece& piece = pieces_[(written_ + i) % kPieces];
      parts[i] = {piece.memory.bytes.get() + piece.begin, piece.size};
      left += piece.size;
    }
    if (error_ == 0) {
      lock.unlock();
      const int result = write_whole(offset, std::span(parts).first(count), left);
      lock.lock();
      error_ = result;
    }
    missing_ += left;
    written_ += count;
    changed_.notify_all();
  }
}

/// Writes all parts, one after another, and changes them and `left` as it goes.
int WriteBehind::write_whole(std::uint64_t offset, std::span<iovec> parts, std::uint64_t& left) const {
  while (left > 0) {
    const std::int64_t step = write_(offset, parts);
    if (step == -EINTR) continue;
    if (step < 0) return static_cast<int>(step);
    if (step == 0) return -EIO;  // POSIX does not promise progress here: do not call again for ever
    offset += static_cast<std::uint64_t>(step);
    left -= static_cast<std::uint64_t>(step);
    for (auto taken = static_cast<std::size_t>(step); taken > 0;) {
      iovec& part = parts.front();
      const std::size_t of_part = std::min(taken, part.iov_len);
      part.iov_base = static_cast<std::byte*>(part.iov_base) + of_part;
      part.iov_len -= of_part;
      taken -= of_part;
      if (part.iov_len == 0) parts = parts.subspan(1);
    }
  }
  return 0;
}

}  // namespace hueline::storage
