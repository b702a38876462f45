#include "drivers/v4l2/v4l2_stream.hpp"

#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>

#include "drivers/transport/host_clock.hpp"
#include "drivers/v4l2/v4l2_ioctl.hpp"

namespace hueline::drivers {
namespace {

std::size_t page_size() { return static_cast<std::size_t>(::sysconf(_SC_PAGESIZE)); }

/// The kernel's description of a buffer, with its plane if there are planes.
struct BufferWords {
  v4l2_buffer words{};
  std::array<v4l2_plane, VIDEO_MAX_PLANES> planes{};

  BufferWords(const V4l2Camera& camera, std::size_t index) {
    words.type = camera.buffer_type;
    words.memory = V4L2_MEMORY_MMAP;
    words.index = static_cast<std::uint32_t>(index);
    if (!camera.is_multiplanar()) return;
    words.m.planes = planes.data();
    words.length = 1;
  }
  BufferWords(const BufferWords&) = delete;
  BufferWords& operator=(const BufferWords&) = delete;
};

}  // namespace

std::byte* V4l2Stream::Memory::image() const { return begin + page_size(); }

Result<std::shared_ptr<V4l2Stream>> V4l2Stream::start(V4l2Camera camera, std::size_t buffers) {
  auto stream = std::make_shared<V4l2Stream>();
  stream->camera_ = std::move(camera);
  if (Status status = stream->map(buffers); !status) return status.error();
  const Lock lock(stream->mutex_);
  stream->is_streaming_ = true;
  for (std::size_t i = 0; i < stream->memory_.size(); ++i)
    if (!stream->queue(i)) return io_error("queue a buffer of " + stream->camera_.path, errno);
  int type = static_cast<int>(stream->camera_.buffer_type);
  if (v4l2_ioctl(stream->camera_.fd.get(), VIDIOC_STREAMON, &type) != 0) {
    Error error = io_error("start " + stream->camera_.path, errno);
    // A bus without bandwidth, a sensor that does not answer yet: another attempt may help.
    error.code = ErrorCode::Unavailable;
    return error;
  }
  return stream;
}

Status V4l2Stream::map(std::size_t buffers) {
  const int fd = camera_.fd.get();
  v4l2_requestbuffers request{};
  request.type = camera_.buffer_type;
  request.memory = V4L2_MEMORY_MMAP;
  request.count = static_cast<std::uint32_t>(buffers);
  if (v4l2_ioctl(fd, VIDIOC_REQBUFS, &request) != 0) {
    const int why = errno;
    Error error = io_error(fmt::format("request {} buffers of {}", buffers, camera_.path), why);
    error.code = ErrorCode::Unavailable;
    if (why == EBUSY) error.message += ": another program streams from it";
    return error;
  }
  for (std::size_t i = 0; i < request.count; ++i) {
    BufferWords buffer(camera_, i);
    if (v4l2_ioctl(fd, VIDIOC_QUERYBUF, &buffer.words) != 0)
      return io_error(fmt::format("ask for buffer {} of {}", i, camera_.path), errno);
    const std::size_t length = camera_.is_multiplanar() ? buffer.planes[0].length : buffer.words.length;
    const std::uint32_t offset = camera_.is_multiplanar() ? buffer.planes[0].m.mem_offset : buffer.words.m.offset;
    Memory memory;
    memory.size = page_size() + (length + page_size() - 1) / page_size() * page_size();
    void* room = ::mmap(nullptr, memory.size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (room == MAP_FAILED) return io_error("find room for a buffer", errno);
    memory.begin = static_cast<std::byte*>(room);
    memory_.push_back(memory);
    if (::mmap(memory.image(), length, PROT_READ, MAP_SHARED | MAP_FIXED, fd, offset) == MAP_FAILED)
      return io_error(fmt::format("map buffer {} of {}", i, camera_.path), errno);
  }
  return {};
}

V4l2Stream::~V4l2Stream() {
  stop();
  for (const Memory& memory : memory_) ::munmap(memory.begin, memory.size);
}

void V4l2Stream::stop() {
  const Lock lock(mutex_);
  if (is_streaming_) {
    int type = static_cast<int>(camera_.buffer_type);
    v4l2_ioctl(camera_.fd.get(), VIDIOC_STREAMOFF, &type);
  }
  is_streaming_ = false;
  queued_ = 0;
  camera_.fd = FileDescriptor();
}

int V4l2Stream::fd() const { return camera_.fd.get(); }

std::size_t V4l2Stream::queued() const {
  const Lock lock(mutex_);
  return queued_;
}

bool V4l2Stream::queue(std::size_t index) {
  BufferWords buffer(camera_, index);
  if (v4l2_ioctl(camera_.fd.get(), VIDIOC_QBUF, &buffer.words) != 0) return false;
  ++queued_;
  return true;
}

Result<V4l2Stream::Filled> V4l2Stream::take() {
  const Lock lock(mutex_);
  BufferWords buffer(camera_, 0);
  if (v4l2_ioctl(camera_.fd.get(), VIDIOC_DQBUF, &buffer.words) != 0) {
    const int why = errno;
    if (why == EAGAIN) return Error{ErrorCode::TimedOut, "no image"};
    Error error = io_error("take an image of " + camera_.path, why);
    // EIO, EPIPE, EINVAL: the driver has ended the stream. Only opening it again helps.
    error.code = ErrorCode::Disconnected;
    if (why == ENODEV) error.message = camera_.path + " is gone: was the camera unplugged?";
    return error;
  }
  if (queued_ > 0) --queued_;
  Filled filled;
  filled.index = buffer.words.index;
  if (filled.index >= memory_.size())
    return Error{ErrorCode::Disconnected, fmt::format("{} returned a buffer that it does not have", camera_.path)};
  const std::size_t room = memory_[filled.index].size - page_size();
  std::size_t offset = 0, used = buffer.words.bytesused;
  if (camera_.is_multiplanar()) {
    offset = std::min<std::size_t>(buffer.planes[0].data_offset, room);
    used = buffer.planes[0].bytesused - std::min(buffer.planes[0].bytesused, buffer.planes[0].data_offset);
  }
  used = std::min(used, room - offset);
  filled.header = camera_.header;
  filled.header.sequence = buffer.words.sequence;
  filled.header.flags = buffer.words.flags;
  filled.header.stamp =
      std::chrono::seconds(buffer.words.timestamp.tv_sec) + std::chrono::microseconds(buffer.words.timestamp.tv_usec);
  filled.header.used_bytes = static_cast<std::uint32_t>(used);
  filled.image = {memory_[filled.index].image() + offset, used};
  return filled;
}

bool V4l2Stream::can_lend(const Filled& filled) const { return filled.image.data() == memory_[filled.index].image(); }

Buffer V4l2Stream::lend(const Filled& filled) {
  std::byte* packet = memory_[filled.index].image() - kV4l2HeaderSize;
  encode_v4l2_header(filled.header, std::span<std::byte, kV4l2HeaderSize>(packet, kV4l2HeaderSize));
  return Buffer::lent(shared_from_this(), {packet, kV4l2HeaderSize + filled.image.size()});
}

void V4l2Stream::give_back(std::size_t index) {
  const Lock lock(mutex_);
  // If this fails, the camera is gone, and take() says so.
  if (is_streaming_) queue(index);
}

void V4l2Stream::give_back(const std::byte* data) noexcept {
  for (std::size_t i = 0; i < memory_.size(); ++i)
    if (memory_[i].image() - kV4l2HeaderSize == data) return give_back(i);
}

}  // namespace hueline::drivers
