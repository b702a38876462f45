#pragma once

#include <filesystem>
#include <optional>
#include <utility>

#include "core/result.hpp"

namespace hueline {

/// The name beside an output under which its new content is written, so that an older file of that name stays whole
/// until the new one is, and for ever if it never is. The name ends with ".part". The destructor removes that file if
/// it did not take the older one's place. After a crash it stays, and the next writing of the same output begins it
/// anew. It can be moved, but not copied. Thread safety: none.
class ReplacedFile {
 public:
  /// Plans to replace `path`. Nothing if there is something that cannot be replaced, such as a pipe or a device: it is
  /// to be opened as it is. Errors: those of check_output(), and Io if a new file cannot be made in the folder.
  static Result<std::optional<ReplacedFile>> plan(const std::filesystem::path& path);
  ReplacedFile(ReplacedFile&& other) noexcept;
  ReplacedFile& operator=(ReplacedFile&& other) noexcept;
  ~ReplacedFile();

  /// Where the new content is to be written.
  const std::filesystem::path& part() const { return part_; }
  /// Whether there was an older file. If so, sync the new one before commit(): a computer that stops shall leave one of
  /// the two.
  bool replaces_older() const { return replaces_older_; }
  /// Takes note that part() was opened for writing and is to be removed if it stays a part.
  void begin() { is_begun_ = true; }
  /// Gives the new content the name of the older one, and its rights. Call it when everything is written and closed.
  /// Returns 0 or minus errno; then the older file is as it was.
  int commit();

 private:
  ReplacedFile(std::filesystem::path part, std::filesystem::path path, bool replaces_older)
      : part_(std::move(part)), path_(std::move(path)), replaces_older_(replaces_older) {}
  std::filesystem::path part_, path_;
  bool replaces_older_ = false, is_begun_ = false;
};

}  // namespace hueline
