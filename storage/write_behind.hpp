#pragma once

#include <sys/uio.h>

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <thread>

namespace hueline::storage {

/// Memory at the address of a block, from which a disk can fetch bytes by itself.
struct BlockMemory {
  static constexpr std::size_t kBlock = 4096;  ///< a multiple of the blocks of all usual disks
  struct Free {
    void operator()(std::byte* memory) const { std::free(memory); }
  };
  std::unique_ptr<std::byte, Free> bytes;

  /// Returns memory of `size` bytes, a multiple of kBlock; null if there is none.
  static BlockMemory of(std::size_t size) {
    return {std::unique_ptr<std::byte, Free>(static_cast<std::byte*>(std::aligned_alloc(kBlock, size)))};
  }
};

/// Writes pieces of memory one after another with a thread of its own, while the next pieces are filled. Up to four
/// pieces that wait for the disk are handed to it at once, so that it has something to do all the time. After the first
/// piece that cannot be written nothing more is, so that there is never a gap.
/// Thread safety: none; one thread calls all functions.
class WriteBehind {
 public:
  static constexpr std::size_t kMostAtOnce = 4;  ///< pieces
  /// Writes some of the bytes, as pwritev() does, and returns their number or minus errno. Called on the other thread.
  /// All but the last of the parts end at a block of the file.
  using Write = std::function<std::int64_t(std::uint64_t offset, std::span<const iovec> parts)>;

  /// Each of the eight pieces has room for `piece_bytes`, a multiple of BlockMemory::kBlock, after the first block.
  /// Throws std::system_error if there can be no thread, and std::bad_alloc if there is no memory.
  WriteBehind(std::size_t piece_bytes, Write write);
  /// Waits until everything is written.
  ~WriteBehind();

  /// Waits until one of the pieces may be filled. Returns its memory, at the address of a block; null after an error.
  std::byte* free_piece();
  /// Hands over the last free_piece(): `size` of its bytes from `begin` on are to be written at `offset`.
  void hand_over(std::uint64_t offset, std::size_t begin, std::size_t size);
  /// Returns whether nothing waits to be written.
  bool is_settled();
  /// Waits until everything is written. Returns 0, or minus errno of the first piece that could not be. `missing`: how
  /// many of the last bytes were not written.
  int settle(std::uint64_t& missing);
  /// Settles, and forgets the error.
  void forget();

 private:
  static constexpr std::size_t kPieces = 8;
  struct Piece {
    BlockMemory memory;
    std::uint64_t offset = 0;
    std::size_t begin = 0, size = 0;
  };
  void write_pieces();
  std::size_t count_together() const;
  int write_whole(std::uint64_t offset, std::span<iovec> parts, std::uint64_t& left) const;

  Write write_;
  Piece pieces_[kPieces];
  std::mutex mutex_;
  std::condition_variable changed_;
  std::uint64_t handed_over_ = 0, written_ = 0;  // pieces
  int error_ = 0;
  std::uint64_t missing_ = 0;  // bytes after the error
  bool is_ending_ = false;
  std::thread thread_;  // the last member: it uses the others
};

}  // namespace hueline::storage
