#include "drivers/v4l2/v4l2_source.hpp"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstring>
#include <utility>

#include "drivers/transport/host_clock.hpp"

namespace hueline::drivers {
namespace {

constexpr int kImageWait_ms = 100;
constexpr std::size_t kMostBuffers = VIDEO_MAX_FRAME;
// A buffer waits in the driver's queue as long as this thread was held up, never this long.
constexpr nanoseconds kOldest = std::chrono::seconds(10);
// Some drivers calculate the end of an image before it has come.
constexpr nanoseconds kFarthestAhead = std::chrono::seconds(1);

}  // namespace

Status V4l2Source::open() {
  close();
  if (const std::string wrong = config_.validate(); !wrong.empty()) return Error{ErrorCode::Invalid, wrong};
  auto camera = open_v4l2_camera(config_);
  if (!camera) return camera.error();
  const std::size_t image = camera->image_bytes;
  const std::size_t buffers = config_.stream_buffers + (config_.zero_copy ? config_.images_in_flight : 0);
  auto stream = V4l2Stream::start(std::move(*camera), std::min(buffers, kMostBuffers));
  if (!stream) return stream.error();
  stream_ = std::move(*stream);
  pool_ = std::make_unique<BufferPool>(std::bit_ceil(kV4l2HeaderSize + image) * config_.images_in_flight);
  return {};
}

void V4l2Source::close() {
  if (stream_) stream_->stop();
  stream_.reset();
  pending_.clear();
}

Result<Packet> V4l2Source::next(std::stop_token stop) {
  if (!stream_) return Error{ErrorCode::Disconnected, "camera: not open"};
  if (pending_.empty()) {
    if (stop.stop_requested()) return Error{ErrorCode::Stopped, "stop was asked for"};
    pollfd waiting{stream_->fd(), POLLIN, 0};
    const int ready = ::poll(&waiting, 1, kImageWait_ms);
    if (ready < 0 && errno != EINTR) return io_error("wait for an image", errno);
    if (ready <= 0) return Error{ErrorCode::TimedOut, "no image"};
    const auto filled = stream_->take();
    if (!filled) return filled.error();
    auto packet = packet_of(*filled);
    if (packet && !pending_.empty()) std::swap(*packet, pending_.front());  // the fault belongs before the image
    if (packet) return packet;
  }
  if (pending_.empty()) return Error{ErrorCode::TimedOut, "no image"};
  Packet packet = std::move(pending_.front());
  pending_.pop_front();
  return packet;
}

Result<Packet> V4l2Source::packet_of(const V4l2Stream::Filled& filled) {
  Packet packet;
  packet.received = arrival_of(filled.header);
  if (config_.zero_copy && stream_->queued() >= config_.stream_buffers && stream_->can_lend(filled)) {
    packet.bytes = stream_->lend(filled);
    return packet;
  }
  MutableBuffer copy = pool_->acquire(kV4l2HeaderSize + filled.image.size());
  if (!copy) {
    stream_->give_back(filled.index);
    pending_.push_back(
        fault_packet(packet.received, FaultKind::Overflow, 1,
                     fmt::format("an image came while {} MB of images were held: recorder or pipeline is "
                                 "behind (images_in_flight)",
                                 pool_->bytes_in_use() >> 20)));
    return Error{ErrorCode::Exhausted, "no memory for an image"};
  }
  encode_v4l2_header(filled.header, std::span<std::byte, kV4l2HeaderSize>(copy.data(), kV4l2HeaderSize));
  std::memcpy(copy.data() + kV4l2HeaderSize, filled.image.data(), filled.image.size());
  stream_->give_back(filled.index);
  packet.bytes = std::move(copy).share();
  return packet;
}

HostTime V4l2Source::arrival_of(const V4l2Header& header) {
  const HostTime now = host_now();
  if (!header.is_monotonic()) return now;
  const HostTime stamp = to_host_time(header.stamp, KernelClock::Monotonic);
  const nanoseconds age = now - stamp;
  if (age < -kFarthestAhead || age > kOldest) {
    pending_.push_back(fault_packet(
        now, FaultKind::ClockStep, 1,
        fmt::format("the driver's stamp is {:.3f} s before the image was taken: it is of another clock, and `received` "
                    "is the time of taking it",
                    to_seconds(age))));
    return now;
  }
  return header.is_exposure_start() ? now : std::min(stamp, now);
}

}  // namespace hueline::drivers
