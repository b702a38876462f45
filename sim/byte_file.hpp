#pragma once

#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>
#include <type_traits>

#include "core/output_file.hpp"
#include "core/result.hpp"

/// Reading and writing of the simulator's own files (drive.bin, truth.bin, sights.bin): little-endian numbers without
/// padding.
namespace hueline::sim {

static_assert(std::endian::native == std::endian::little, "numbers are written as they lie in memory");

/// Writes numbers and texts to a file, which replaces an existing one. After the first failure further calls do
/// nothing; `close()` reports it.
/// Thread safety: none.
class ByteWriter {
 public:
  explicit ByteWriter(const std::string& path) : path_(path) {
    int fd = -1;
    errno_ = -open_output(path, IfExists::Replace, fd);
    if (errno_ != 0) return;
    file_.reset(::fdopen(fd, "wb"));
    if (file_) return;
    errno_ = errno;
    ::close(fd);
  }
  void bytes(const void* data, std::size_t size) {
    if (!file_ || errno_ != 0 || size == 0) return;
    if (std::fwrite(data, 1, size, file_.get()) != size) errno_ = errno != 0 ? errno : EIO;
  }
  template <class T>
  void number(T x) {
    static_assert(std::is_arithmetic_v<T>);
    bytes(&x, sizeof x);
  }
  /// Writes a u32 length and then the bytes of `s`.
  void text(const std::string& s) {
    number(static_cast<std::uint32_t>(s.size()));
    bytes(s.data(), s.size());
  }
  /// Flushes and closes the file, and returns the first error of all calls. Nothing else reports errors: call it
  /// always.
  Status close() {
    if (file_ && std::fclose(file_.release()) != 0 && errno_ == 0) errno_ = errno;
    if (errno_ != 0) return output_error("write " + path_, errno_);
    return {};
  }

 private:
  struct Close {
    void operator()(std::FILE* f) const { std::fclose(f); }
  };
  std::string path_;
  std::unique_ptr<std::FILE, Close> file_;
  int errno_ = 0;
};

/// Reads what ByteWriter wrote. After the first failure every call returns a zero or an empty text; `status()` holds
/// that failure.
/// Thread safety: none.
class ByteReader {
 public:
  explicit ByteReader(const std::string& path) : path_(path), file_(std::fopen(path.c_str(), "rb")) {
    if (!file_) {
      status_ = io_error("opening " + path, errno);
      return;
    }
    std::fseek(file_.get(), 0, SEEK_END);
    left_ = static_cast<std::uint64_t>(std::max(0L, std::ftell(file_.get())));
    std::rewind(file_.get());
  }
  /// Reads `size` bytes. Returns false if that fails.
  bool bytes(void* data, std::size_t size) {
    if (!status_.ok()) return false;
    if (size > left_ || std::fread(data, 1, size, file_.get()) != size) {
      fail("ends before it is complete");
      return false;
    }
    left_ -= size;
    return true;
  }
  template <class T>
  T number() {
    T x{};
    bytes(&x, sizeof x);
    return x;
  }
  std::string text() {
    const auto size = number<std::uint32_t>();
    std::string s;
    if (fits(size, 1)) {
      s.resize(size);
      bytes(s.data(), size);
    }
    return s;
  }
  /// Returns true if `count` items of `size` bytes each can still be in the file. Call it before memory is reserved for
  /// them.
  bool fits(std::uint64_t count, std::uint64_t size) {
    if (status_.ok() && count > left_ / size) fail("states more items than it can hold");
    return status_.ok();
  }
  /// Records that the file is malformed. The message is the file's path followed by `what`.
  void fail(const std::string& what) {
    if (status_.ok()) status_ = Error{ErrorCode::Malformed, path_ + " " + what};
  }
  /// Returns the first failure, if there was one.
  const Status& status() const { return status_; }
  /// Returns how many bytes are not read yet.
  std::uint64_t left() const { return left_; }

 private:
  struct Close {
    void operator()(std::FILE* f) const { std::fclose(f); }
  };
  std::string path_;
  std::unique_ptr<std::FILE, Close> file_;
  std::uint64_t left_ = 0;
  Status status_;
};

}  // namespace hueline::sim
