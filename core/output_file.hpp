#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/result.hpp"

/// The one door through which this program opens a file to write it. What is written never lands on something else than
/// the name says: not on a file that is being read (under any name), not behind a link, not in a folder that another
/// capture or replay is writing.
namespace hueline {

enum class IfExists { Refuse, Replace };

/// Opens `path` to be written from its begin: 0 and the descriptor, or minus errno. Refused besides what the kernel
/// refuses: a symbolic link (-ELOOP); with Replace, a file that is open as an InputFile (-EBUSY); a file in a folder
/// that somebody else holds as an OutputFolder (-EWOULDBLOCK). A file with further names (hard links) is not written
/// over: it keeps its bytes under the others, and `path` becomes a new file. Pipes and devices are written to as they
/// are; a pipe's reader is waited for.
int open_output(const std::filesystem::path& path, IfExists if_exists, int& fd);

/// What open_output() would say to Replace, before the work whose result is to be written there; nothing is changed or
/// made. A missing folder is an error. Later it may say something else: others go on meanwhile.
Status check_output(const std::filesystem::path& path);

/// Error{Io} with the errno in words and what to do about it.
Error output_error(const std::string& attempted, int errno_value);

/// Replaces the file by `text`; every step is checked. Errors: Io.
Status write_output(const std::filesystem::path& path, std::string_view text);

/// A folder that receives a command's results. While this lives nobody else's OutputFolder can be the same folder, and
/// no other program of ours opens a file in it to write (flock: it ends with the process, however that ends). File
/// systems without such locks are written to without. Move-only.
class OutputFolder {
 public:
  /// Makes the folder and those above it if they are not there. Errors: Io; Unavailable if another capture, replay or
  /// the like writes into it.
  static Result<OutputFolder> open(const std::filesystem::path& path);
  OutputFolder(OutputFolder&& other) noexcept;
  OutputFolder& operator=(OutputFolder&& other) noexcept;
  ~OutputFolder();

  const std::filesystem::path& path() const { return path_; }

 private:
  OutputFolder(std::filesystem::path path, int fd) : path_(std::move(path)), fd_(fd) {}
  std::filesystem::path path_;
  int fd_ = -1;
};

/// What OutputFolder::open() and the first file in it would meet, before the work is done; nothing is made.
Status check_output_folder(const std::filesystem::path& path);

}  // namespace hueline
