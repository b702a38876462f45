#include "sim/devices/image_prefetch.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <limits>
#include <utility>

#include "sim/devices/socket.hpp"

namespace hueline::sim {
namespace {

ImagePrefetch::Image read_file(const std::string& path, BufferPool& pool) {
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  struct stat info {};
  if (!file || ::fstat(file.get(), &info) != 0) return io_error("read the image " + path, errno);
  MutableBuffer bytes = pool.acquire(static_cast<std::size_t>(info.st_size));
  if (!bytes) return Error{ErrorCode::Exhausted, "no memory for the image " + path};
  std::size_t have = 0;
  while (have < bytes.size()) {
    const ssize_t n = ::read(file.get(), bytes.data() + have, bytes.size() - have);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return io_error("read the image " + path, errno);
    if (n == 0) break;
    have += static_cast<std::size_t>(n);
  }
  bytes.resize(have);
  return std::move(bytes).share();
}

}  // namespace

ImagePrefetch::ImagePrefetch(NextFile next_file, std::size_t bytes_ahead)
    : pool_(std::numeric_limits<std::size_t>::max()),
      queue_({256, bytes_ahead}),
      thread_([this, next_file = std::move(next_file)](const std::stop_token& stop) {
        while (const std::optional<std::string> file = next_file(stop)) {
          Image image = read_file(*file, pool_);
          const std::size_t weight = image.ok() ? image->size() + 1 : 1;
          if (!queue_.push(std::move(image), stop, weight)) return;
        }
        queue_.close();
      }) {}

}  // namespace hueline::sim
