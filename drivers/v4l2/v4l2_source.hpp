#pragma once

#include <deque>
#include <memory>
#include <string>
#include <utility>

#include "core/packet.hpp"
#include "drivers/v4l2/v4l2_config.hpp"
#include "drivers/v4l2/v4l2_stream.hpp"

namespace hueline::drivers {

/// Receives the images of a V4L2 camera (UVC, CSI, GMSL) by the kernel's interface.
///
/// Packet::bytes is the header of v4l2_packet.hpp and then what the driver wrote. As long as the driver has
/// `stream_buffers` empty buffers left, packets lie in its memory and nothing is copied; otherwise images are copied to
/// the pool. `received` is the buffer's stamp if the driver says that it is of CLOCK_MONOTONIC and names the end of the
/// image, and if it is not later than the time of taking the buffer; otherwise it is that time. The stamp itself is in
/// the packet in any case.
///
/// Errors of open(): Unavailable if the camera is absent or held by another program. Invalid if it does not take a
/// setting; the message says what it has.
/// Errors of next(): Disconnected if the camera is gone or its driver has ended the stream.
/// Fault packets: Overflow if the pool was full; ClockStep if the stamp of a buffer is more than 1 s later or 10 s
/// earlier than the time of taking it. Lost images show as gaps of the sequence, and V4l2Decoder counts them. Thread
/// safety: none; one thread calls all functions. Packets may be released on any thread.
class V4l2Source final : public PacketSource {
 public:
  explicit V4l2Source(V4l2Config config) : config_(std::move(config)) {}
  ~V4l2Source() override { close(); }

  Status open() override;
  Result<Packet> next(std::stop_token stop) override;
  void close() override;

 private:
  Result<Packet> packet_of(const V4l2Stream::Filled& filled);
  HostTime arrival_of(const V4l2Header& header);

  const V4l2Config config_;
  std::shared_ptr<V4l2Stream> stream_;
  std::unique_ptr<BufferPool> pool_;
  std::deque<Packet> pending_;  // that next() still has to return
};

}  // namespace hueline::drivers
