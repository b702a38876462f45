#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace hueline::test {

/// A file for writers, removed with this object. It is not a file in memory, because its path there would be a link,
/// and the program does not write through links.
class WrittenFile {
 public:
  WrittenFile() {
    const int fd = ::mkstemp(path_.data());
    if (fd < 0) std::abort();
    ::close(fd);
  }
  WrittenFile(const WrittenFile&) = delete;
  WrittenFile& operator=(const WrittenFile&) = delete;
  ~WrittenFile() { ::unlink(path_.c_str()); }

  std::filesystem::path path() const { return path_; }
  std::string contents() const {
    std::ifstream in(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }

 private:
  std::string path_ = (std::filesystem::temp_directory_path() / "hueline-fuzz-XXXXXX").string();
};

/// Makes up to `most` edits of a file, three bytes of the fuzzer each: a place and a byte. Few edits leave much of the
/// file whole, so that they reach code behind its header.
inline void edit(std::string& file, const std::uint8_t* data, std::size_t size, std::size_t most) {
  for (; size >= 3 && most > 0; data += 3, size -= 3, --most)
    file[(static_cast<std::size_t>(data[0]) << 8 | data[1]) % file.size()] = static_cast<char>(data[2]);
}

/// A file in memory with a path, for readers that open files.
class MemoryFile {
 public:
  explicit MemoryFile(const std::string& bytes) : fd_(::memfd_create("fuzz", 0)) {
    if (fd_ < 0) std::abort();
    for (std::size_t done = 0; done < bytes.size();) {
      const ssize_t step = ::write(fd_, bytes.data() + done, bytes.size() - done);
      if (step <= 0) std::abort();
      done += static_cast<std::size_t>(step);
    }
  }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  ~MemoryFile() { ::close(fd_); }

  std::filesystem::path path() const { return "/proc/self/fd/" + std::to_string(fd_); }

 private:
  int fd_;
};

}  // namespace hueline::test
