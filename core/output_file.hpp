#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "core/result.hpp"

/// All files that this program writes are opened here. The functions make sure that nothing is overwritten by mistake:
/// no file that is being read (under any of its names), no file behind a link, and no file in a folder that another
/// capture or replay is writing.
namespace hueline {

/// What to do if the file exists already.
enum class IfExists {
  Refuse,
  Replace,
  Continue,  ///< keeps what is in it, so that a program goes on with a file of its own
};

/// Opens `path` for writing from its beginning; with Continue nothing in it is changed. Returns 0 and sets `fd`, or
/// returns minus errno.
///
/// Besides what the kernel refuses, these are refused: a symbolic link (-ELOOP); with Replace, a file that is open as
/// an InputFile (-EBUSY); a file in a folder that another program holds as an OutputFolder (-EWOULDBLOCK). A file that
/// has further names (hard links) is not overwritten: it keeps its content under the other names, and `path` becomes a
/// new file. Pipes and devices are opened as they are; opening a pipe waits for its reader.
int open_output(const std::filesystem::path& path, IfExists if_exists, int& fd);

/// Checks what open_output() with Replace would answer, without changing or making anything. A command calls it before
/// the work whose result it will write. A missing folder is an error. The answer can change later, because other
/// programs continue meanwhile.
Status check_output(const std::filesystem::path& path);

/// Returns an Error of kind Io with errno in words and what to do about it.
Error output_error(const std::string& attempted, int errno_value);

/// Writes a file with `text` and checks every step. It takes the place of an older one when it is whole
/// (core/replaced_file.hpp). Errors: Io.
Status write_output(const std::filesystem::path& path, std::string_view text);
Status write_output(const std::filesystem::path& path, std::span<const std::byte> bytes);

/// A folder that receives a command's results. While it is open, no other OutputFolder can be the same folder, and no
/// other program of this project opens a file in it for writing. The lock is an flock(), which ends with the process in
/// any case. File systems without such locks are used without protection. It can be moved, but not copied.
class OutputFolder {
 public:
  /// Opens the folder, and makes it and those above it if necessary. Errors: Io; Unavailable if another command is
  /// writing into the folder.
  static Result<OutputFolder> open(const std::filesystem::path& path);
  OutputFolder(OutputFolder&& other) noexcept;
  OutputFolder& operator=(OutputFolder&& other) noexcept;
  ~OutputFolder();

  const std::filesystem::path& path() const { return path_; }

  /// Returns whether another program holds this folder open.
  static bool is_held_by_another(const std::filesystem::path& path);

 private:
  OutputFolder(std::filesystem::path path, int fd) : path_(std::move(path)), fd_(fd) {}
  std::filesystem::path path_;
  int fd_ = -1;
};

/// Checks what OutputFolder::open() and opening the first file in it would answer, without making anything.
Status check_output_folder(const std::filesystem::path& path);

}  // namespace hueline
