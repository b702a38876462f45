#include "storage/write_behind.hpp"

#include <pthread.h>

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

void WriteBehind::write_pieces() {
  ::pthread_setname_np(::pthread_self(), "write-behind");
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [&] { return is_ending_ || written_ < handed_over_; });
    if (written_ == handed_over_) return;
    const Piece& piece = pieces_[written_ % kPieces];
    std::uint64_t left = piece.size;
    if (error_ == 0) {
      lock.unlock();
      const int result = write_whole(piece, left);
      lock.lock();
      error_ = result;
    }
    missing_ += left;
    ++written_;
    changed_.notify_all();
  }
}

int WriteBehind::write_whole(const Piece& piece, std::uint64_t& left) const {
  while (left > 0) {
    const std::uint64_t done = piece.size - left;
    const std::int64_t step = write_(piece.offset + done, {piece.memory.bytes.get() + piece.begin + done, left});
    if (step == -EINTR) continue;
    if (step < 0) return static_cast<int>(step);
    if (step == 0) return -EIO;  // POSIX does not promise progress here: do not call again for ever
    left -= static_cast<std::uint64_t>(step);
  }
  return 0;
}

}  // namespace hueline::storage
