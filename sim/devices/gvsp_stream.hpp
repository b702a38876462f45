#pragma once

#include <netinet/in.h>

#include <cstdint>
#include <deque>
#include <stop_token>
#include <string>
#include <utility>

#include "core/buffer.hpp"
#include "core/mutex.hpp"
#include "core/result.hpp"
#include "sim/devices/camera_image.hpp"
#include "sim/devices/gvcp_control.hpp"
#include "sim/devices/gvsp_encode.hpp"
#include "sim/devices/socket.hpp"
#include "sim/wire/seeded_random.hpp"

namespace hueline::sim {

/// What a client wants streamed, and to which address, from the camera's registers.
struct StreamTarget {
  bool is_active = false;  ///< a client controls the camera and has started the acquisition
  sockaddr_in to{};
  std::uint32_t packet_bytes = 1400;  ///< including IP and UDP headers
  std::uint32_t packet_delay_ns = 0;
  bool may_fragment = true;
  std::uint32_t pixel_format = 0;
  CameraRegion region;
  CameraChunks chunks;
};

/// The stream side of a GigE Vision camera. It sends images as paced packets and keeps them for a while so that packets
/// can be sent again. Thread-safe, except that only one thread may call `send()`.
class GvspStream {
 public:
  struct Config {
    double link_bytes_per_second = 110e6;       ///< pace of the stream; 118e6 fill a gigabit link
    std::size_t images_kept = 4;                ///< number of images kept for packets that are requested again
    double lost_packet_share = 0;               ///< share of the data packets that are not sent at first, 0 .. 1
    std::uint64_t seed = 1;                     ///< seed of the lost packets
    std::uint16_t chunk_payload_type = 0x4001;  ///< GvspImage::payload_type of images with chunks
    std::string validate() const;
  };
  /// Numbers of packets and requests since the stream was opened.
  struct Counts {
    std::uint64_t packets_sent = 0, packets_lost_on_purpose = 0, packets_resent = 0, resends_refused = 0;
    std::uint64_t packets_failed = 0;  ///< refused by the kernel
  };

  GvspStream(const Config& config, FileDescriptor socket)
      : config_(config), socket_(std::move(socket)), losses_(config.seed, kStreamWireFault) {}

  /// Sets where and what to stream. Called whenever a client changed the camera's registers.
  void set_target(const StreamTarget& target);
  /// Returns whether a client has started the acquisition.
  bool is_active() const;
  /// Sends one image, paced, and returns when its trailer has left. Errors: Unavailable (no client has started the
  /// acquisition), Invalid (the client's region is not inside the image), Stopped.
  Status send(const CameraImage& image, const std::stop_token& stop);
  /// Sends packets of a kept image again, as requested.
  void send_again(const GvcpResend& request);
  /// Sends one packet of the size that the client tests.
  void send_test_packet();
  Counts counts() const;

 private:
  struct SentImage {
    GvspImage image;
    Buffer pixels;
    bool has_pixels = false;
    sockaddr_in to{};
    std::uint32_t packet_bytes = 0;
    std::uint32_t missing_packets = 0;  // counted from the first data packet
  };
  class Batch;  // packets that leave in one system call

  const Config config_;
  const FileDescriptor socket_;

  mutable Mutex mutex_;
  StreamTarget target_ HUELINE_GUARDED_BY(mutex_);
  std::uint64_t acquisitions_ HUELINE_GUARDED_BY(mutex_) = 0;
  std::deque<SentImage> kept_ HUELINE_GUARDED_BY(mutex_);
  Counts counts_ HUELINE_GUARDED_BY(mutex_);

  // Used by the thread that sends.
  SeededRandom losses_;
  std::uint64_t numbered_acquisition_ = 0, first_sequence_ = 0, last_sequence_ = 0;
};

}  // namespace hueline::sim
