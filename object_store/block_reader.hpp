#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <stop_token>
#include <thread>
#include <vector>

#include "core/mutex.hpp"
#include "core/result.hpp"

namespace hueline::object_store {

/// Reads a file whose parts have to be asked for, each of which takes its time: in blocks, of which some are kept. Who
/// reads on gets what follows fetched beforehand by threads of its own, the further ahead the more was read without a
/// jump; who jumps gets the blocks that hold what was asked for, and no others. Thread-safe.
class BlockReader {
 public:
  /// Fills `out` with the bytes from `offset` on. It is called by several threads at a time, and ends soon, with
  /// Stopped, if `stop` asks for it.
  using Fetch = std::function<Status(std::uint64_t offset, std::span<std::byte> out, const std::stop_token& stop)>;
  struct Config {
    std::size_t block_bytes = std::size_t{1} << 20;
    std::size_t most_blocks_at_once = 8;  ///< in one call of Fetch
    std::size_t blocks_before_ahead = 8;  ///< that are read without a jump before any is fetched ahead
    std::size_t most_blocks_ahead = 32;
    std::size_t most_blocks_kept = 64;  ///< besides those that are being fetched
    std::size_t threads = 3;            ///< that fetch ahead
  };

  /// `head`: the first bytes of the file, if they are known.
  BlockReader(std::uint64_t size, Fetch fetch, Config config, std::span<const std::byte> head = {});
  /// Ends the fetching.
  ~BlockReader();

  /// Fills `out`; the range lies inside the file. Errors: those of Fetch, of each place once: a later call asks again.
  Status read(std::uint64_t offset, std::span<std::byte> out);

 private:
  struct Block {
    bool is_loading = true;
    std::optional<Error> error;
    std::vector<std::byte> bytes;
    std::uint64_t used = 0;  // number of the use
  };
  struct Run {
    std::uint64_t first = 0, count = 0;  // blocks
  };
  Run missing_run(std::uint64_t first, std::uint64_t end, std::uint64_t most) HUELINE_REQUIRES(mutex_);
  void look_ahead(std::uint64_t offset, std::uint64_t end) HUELINE_REQUIRES(mutex_);
  void load(Run run, const std::stop_token& stop);
  void forget_oldest() HUELINE_REQUIRES(mutex_);
  void work(const std::stop_token& stop);

  const std::uint64_t size_, blocks_;
  const Fetch fetch_;
  const Config config_;
  Mutex mutex_;
  std::condition_variable_any changed_;
  std::map<std::uint64_t, Block> kept_ HUELINE_GUARDED_BY(mutex_);
  std::deque<Run> wanted_ HUELINE_GUARDED_BY(mutex_);
  std::uint64_t uses_ HUELINE_GUARDED_BY(mutex_) = 0;
  std::uint64_t end_ HUELINE_GUARDED_BY(mutex_) = 0;     // where the last read() ended
  std::uint64_t on_end_ HUELINE_GUARDED_BY(mutex_) = 0;  // bytes that were read without a jump
  std::vector<std::jthread> threads_ HUELINE_GUARDED_BY(mutex_);
};

}  // namespace hueline::object_store
