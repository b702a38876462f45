#pragma once

#include <cstddef>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "core/bounded_queue.hpp"
#include "core/buffer.hpp"
#include "core/result.hpp"

namespace hueline::sim {

/// Reads files ahead, in order, so that playing never waits for the disk unless the disk is slower than the drive.
/// Memory is used again: at 300 MB/s fresh pages would cost more than the reading.
class ImagePrefetch {
 public:
  using Image = Result<Buffer>;

  /// `bytes_ahead`: the most that may wait to be taken.
  ImagePrefetch(std::vector<std::string> files, std::size_t bytes_ahead);

  /// The next file's bytes, or why it could not be read (Io). Empty: no more files, or stopped. Thread-bound.
  std::optional<Image> next(const std::stop_token& stop) { return queue_.pop(stop); }

 private:
  BufferPool pool_;
  BoundedQueue<Image> queue_;
  std::jthread thread_;
};

}  // namespace hueline::sim
