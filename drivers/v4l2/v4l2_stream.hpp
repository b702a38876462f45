#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/buffer.hpp"
#include "core/mutex.hpp"
#include "core/result.hpp"
#include "drivers/v4l2/v4l2_camera.hpp"

namespace hueline::drivers {

/// The buffers of a streaming camera, in the driver's memory (V4L2_MEMORY_MMAP). Before each buffer lie the 64 bytes of
/// a packet's header, so a filled buffer is a whole packet and can be lent without a copy. The memory outlives the
/// stream until no packet refers to it.
/// Thread safety: one thread calls all functions; packets may be released on any thread.
class V4l2Stream final : public BufferLender, public std::enable_shared_from_this<V4l2Stream> {
 public:
  /// Requests `buffers` buffers (the driver may give fewer or more), queues them and starts. Errors: Unavailable if
  /// another program streams or the camera is gone; Io.
  static Result<std::shared_ptr<V4l2Stream>> start(V4l2Camera camera, std::size_t buffers);
  /// Use start().
  V4l2Stream() = default;
  ~V4l2Stream() override;
  V4l2Stream(const V4l2Stream&) = delete;
  V4l2Stream& operator=(const V4l2Stream&) = delete;

  int fd() const;

  /// A buffer that the driver has filled.
  struct Filled {
    std::size_t index = 0;
    V4l2Header header;
    std::span<const std::byte> image;  ///< header.used_bytes bytes in the driver's memory
  };
  /// Takes the next filled buffer. Errors: TimedOut if there is none, Disconnected if the camera is gone or its driver
  /// gave up, Io.
  Result<Filled> take();
  /// Number of buffers that the driver can fill now.
  std::size_t queued() const;
  /// Returns whether the buffer can be lent: its image begins where the driver's memory does.
  bool can_lend(const Filled& filled) const;
  /// Makes a packet of the buffer without a copy. The driver gets the buffer back after the last reference is gone.
  Buffer lend(const Filled& filled);
  /// Gives the buffer back to the driver at once.
  void give_back(std::size_t index);
  void give_back(const std::byte* data) noexcept override;

  /// Stops streaming and closes the device. Lent buffers stay readable.
  void stop();

 private:
  struct Memory {
    std::byte* begin = nullptr;  // a page for the header, and the driver's memory behind it
    std::size_t size = 0;        // of both
    std::byte* image() const;
  };
  Status map(std::size_t buffers);
  bool queue(std::size_t index) HUELINE_REQUIRES(mutex_);

  V4l2Camera camera_;  // its fd is guarded by mutex_, once the stream has started
  std::vector<Memory> memory_;
  mutable Mutex mutex_;
  bool is_streaming_ HUELINE_GUARDED_BY(mutex_) = false;
  std::size_t queued_ HUELINE_GUARDED_BY(mutex_) = 0;
};

}  // namespace hueline::drivers
