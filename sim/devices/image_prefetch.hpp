#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>

#include "core/bounded_queue.hpp"
#include "core/buffer.hpp"
#include "core/result.hpp"

namespace hueline::sim {

/// Reads files ahead, in order, so that playing waits for the disk only if the disk is slower than the drive. Memory is
/// reused, because at 300 MB/s fresh pages would cost more than the reading.
class ImagePrefetch {
 public:
  using Image = Result<Buffer>;

  /// `next_file` returns the paths in their order, and nothing if there are no more or if it was stopped; another
  /// thread calls it. `bytes_ahead` is the largest number of bytes that may wait to be taken.
  using NextFile = std::function<std::optional<std::string>(const std::stop_token&)>;
  ImagePrefetch(NextFile next_file, std::size_t bytes_ahead);

  /// Returns the bytes of the next file, or the error that prevented reading it (Io). Empty if there are no more files
  /// or if it was stopped. Only one thread may call it.
  std::optional<Image> next(const std::stop_token& stop) { return queue_.pop(stop); }

 private:
  BufferPool pool_;
  BoundedQueue<Image> queue_;
  std::jthread thread_;
};

}  // namespace hueline::sim
