#include "core/replaced_file.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <string>
#include <string_view>
#include <utility>

#include "core/output_file.hpp"

namespace hueline {

Result<std::optional<ReplacedFile>> ReplacedFile::plan(const std::filesystem::path& path) {
  if (Status allowed = check_output(path); !allowed) return allowed.error();
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status))
    return std::optional<ReplacedFile>();
  constexpr std::size_t kLongestName = 255;  // bytes, of Linux
  constexpr std::string_view kPart = ".part";
  std::string name = path.filename().string();
  name.resize(std::min(name.size(), kLongestName - kPart.size()));
  return std::optional(ReplacedFile(path.parent_path() / name.append(kPart), path, std::filesystem::exists(status)));
}

ReplacedFile::ReplacedFile(ReplacedFile&& other) noexcept
    : part_(std::move(other.part_)),
      path_(std::move(other.path_)),
      replaces_older_(other.replaces_older_),
      is_begun_(std::exchange(other.is_begun_, false)) {}

ReplacedFile& ReplacedFile::operator=(ReplacedFile&& other) noexcept {
  std::swap(part_, other.part_);
  std::swap(path_, other.path_);
  std::swap(replaces_older_, other.replaces_older_);
  std::swap(is_begun_, other.is_begun_);
  return *this;
}

ReplacedFile::~ReplacedFile() {
  if (is_begun_) ::unlink(part_.c_str());
}

int ReplacedFile::commit() {
  // Who may read the older file may read the new one. A file system without rights has nothing to keep.
  struct stat older {};
  if (::stat(path_.c_str(), &older) == 0) (void)::chmod(part_.c_str(), older.st_mode & 07777U);
  if (::rename(part_.c_str(), path_.c_str()) != 0) return -errno;
  is_begun_ = false;
  return 0;
}

}  // namespace hueline
