#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>

#include "core/buffer.hpp"
#include "drivers/gige/aravis_camera.hpp"
#include "drivers/gige/image_packet.hpp"

namespace hueline::drivers {

/// A camera's images in the memory that they are given: header room, then the pixels that Aravis writes. The receiving
/// thread is Aravis's; it only stamps and queues. Everything else belongs to the reader's thread.
class ImageStream {
 public:
  struct Done {
    HostTime received{};
    ImageHeader header;
    Buffer packet;
  };
  static Result<std::unique_ptr<ImageStream>> start(ArvCamera* camera, const AravisSource::Config& config,
                                                    PacketMemory& memory);
  ~ImageStream();
  /// Ends the stream; nothing but destruction and interrupt() may follow.
  void stop();
  ImageStream(const ImageStream&) = delete;
  ImageStream& operator=(const ImageStream&) = delete;

  /// Gives the stream fresh buffers up to Config::stream_buffers. False if the pool ran out before.
  bool top_up();
  /// The next finished image, or nothing after `wait`, at a stop, or when interrupted.
  std::optional<Done> wait(std::chrono::milliseconds wait, std::stop_token stop);
  /// Ends a wait and all later ones: the camera is gone. Thread-safe.
  void interrupt();
  bool is_interrupted() const { return is_interrupted_; }

  ImageStreamCounts counts() const;

 private:
  struct Finished {
    GRef<ArvBuffer> buffer;
    HostTime at{};
    std::uint64_t missing_packets = 0;  // of the stream so far
  };
  ImageStream(const AravisSource::Config& config, PacketMemory& memory, std::size_t payload);
  static void on_event(void* self, ArvStreamCallbackType type, ArvBuffer* buffer);
  void take_finished();
  std::uint64_t info(const char* name) const;
  ImageHeader describe(ArvBuffer* buffer, std::uint64_t missing_packets) const;

  const AravisSource::Config& config_;
  const std::size_t payload_;
  ImageHeader expected_;  // the region that the camera was set to
  PacketMemory& memory_;
  GRef<ArvStream> owned_stream_;
  std::atomic<ArvStream*> stream_{nullptr};  // for the receiving thread
  std::atomic<std::size_t> given_{0};        // buffers that the stream holds
  bool is_gige_ = false;                     // set before the first buffer is given
  std::uint64_t missing_packets_ = 0;        // at the last image

  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<Finished> finished_;
  std::atomic<bool> is_interrupted_{false};
};

}  // namespace hueline::drivers
