#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>

#include "storage/file_writer.hpp"

namespace hueline::products {

/// A text that is written in large pieces. The first error is remembered and returned by close(). Thread safety: none.
class TextFile {
 public:
  /// Creates the file, or replaces it. Errors: Io.
  static Result<TextFile> create(const std::filesystem::path& path) {
    auto file = storage::FileWriter::replace(path);
    if (!file) return file.error();
    return TextFile(std::move(*file));
  }

  void add(std::string_view text) {
    buffer_ += text;
    if (buffer_.size() >= kPiece) flush();
  }
  /// Writes the rest and closes the file. Errors: Io, also of earlier pieces.
  Status close() {
    flush();
    const Status closed = file_.close();
    return status_ ? closed : status_;
  }

 private:
  static constexpr std::size_t kPiece = 1 << 16;
  explicit TextFile(storage::FileWriter file) : file_(std::move(file)) {}
  void flush() {
    if (status_) status_ = file_.write(storage::as_bytes(buffer_));
    buffer_.clear();
  }

  storage::FileWriter file_;
  std::string buffer_;
  Status status_;
};

}  // namespace hueline::products
