#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <memory>
#include <optional>
#include <stop_token>

#include "core/buffer.hpp"
#include "core/mutex.hpp"
#include "drivers/gige/aravis_camera.hpp"
#include "drivers/gige/chunk_reader.hpp"
#include "drivers/gige/image_packet.hpp"

namespace hueline::drivers {

/// Receives a camera's images into given memory: room for the header, then the pixels that Aravis writes. The receiving
/// thread is Aravis's own; it only stamps and queues images. All other functions are called by the reader's thread,
/// except interrupt().
class ImageStream {
 public:
  /// A finished image.
  struct Done {
    HostTime received{};  ///< when the last byte of the image had arrived
    ImageHeader header;
    Buffer packet;
  };
  /// Starts the stream and the acquisition. `config` and `memory` must outlive the stream.
  static Result<std::unique_ptr<ImageStream>> start(ArvCamera* camera, const AravisSource::Config& config,
                                                    PacketMemory& memory);
  ~ImageStream();
  /// Ends the stream. After it, only interrupt() and the destructor may be called.
  void stop();
  ImageStream(const ImageStream&) = delete;
  ImageStream& operator=(const ImageStream&) = delete;

  /// Gives the stream fresh buffers until it has Config::stream_buffers. Returns false if the memory ran out before.
  bool top_up();
  /// Returns the next finished image. Returns nothing after the time `wait`, when a stop is requested, or when
  /// interrupted.
  std::optional<Done> wait(std::chrono::milliseconds wait, std::stop_token stop);
  /// Ends the current wait and all later ones, because the camera is gone. Thread-safe.
  void interrupt();
  bool is_interrupted() const { return is_interrupted_; }

  /// Returns the bytes of one image.
  std::size_t payload_bytes() const { return payload_; }
  /// Returns what this stream has counted so far.
  ImageStreamCounts counts() const;

 private:
  struct Finished {
    GRef<ArvBuffer> buffer;
    HostTime at{};
    std::uint64_t missing_packets = 0;  // of the stream up to this image
  };
  ImageStream(const AravisSource::Config& config, PacketMemory& memory, std::size_t payload);
  static void on_event(void* self, ArvStreamCallbackType type, ArvBuffer* buffer);
  void take_finished();
  std::uint64_t info(const char* name) const;
  ImageHeader describe(ArvBuffer* buffer, std::uint64_t missing_packets) const;

  const AravisSource::Config& config_;
  const std::size_t payload_;
  ImageHeader expected_;  // describes the region that the camera was set to
  PacketMemory& memory_;
  std::unique_ptr<ChunkReader> chunks_;  // null: the camera reports no exposures
  GRef<ArvStream> owned_stream_;
  std::atomic<ArvStream*> stream_{nullptr};  // read by the receiving thread
  std::atomic<std::size_t> given_{0};        // number of buffers that the stream holds
  std::uint64_t missing_packets_ = 0;        // of the stream up to the latest image

  Mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<Finished> finished_ HUELINE_GUARDED_BY(mutex_);
  std::atomic<bool> is_interrupted_{false};
};

}  // namespace hueline::drivers
