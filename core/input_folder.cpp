#include "core/input_folder.hpp"

#include <algorithm>
#include <system_error>

#include "core/remote_store.hpp"

namespace hueline {
namespace fs = std::filesystem;

Result<std::vector<std::string>> list_folder(const fs::path& folder) {
  if (is_address(folder)) return list_remote(folder);
  std::vector<std::string> names;
  std::error_code failed;
  for (fs::directory_iterator at(folder.empty() ? "." : folder, failed), end; !failed && at != end;
       at.increment(failed))
    names.push_back(at->path().filename().string());
  if (failed) return io_error("list " + folder.string(), failed.value());
  return names;
}

bool is_folder(const fs::path& path) {
  if (is_address(path)) {
    const auto names = list_remote(path);
    return names.ok() && !names->empty();
  }
  std::error_code unknown;
  return fs::is_directory(path, unknown);
}

bool holds(const fs::path& folder, const std::string& name) {
  if (is_address(folder)) {
    const auto names = list_remote(folder);
    return names.ok() && std::ranges::find(*names, name) != names->end();
  }
  std::error_code unknown;
  return fs::is_directory(folder.empty() ? "." : folder, unknown) && fs::exists(folder / name, unknown);
}

fs::path absolute_name(const fs::path& path) {
  // Normal forms of paths have one slash where an address has two.
  if (is_address(path)) {
    std::string address = path.string();
    while (address.ends_with('/')) address.pop_back();
    return address;
  }
  fs::path out = fs::absolute(path).lexically_normal();
  return out.has_filename() ? out : out.parent_path();
}

}  // namespace hueline
