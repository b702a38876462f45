#include "core/remote_store.hpp"

namespace hueline {
namespace {

constexpr std::string_view kScheme = "s3://";

/// As the kernel's files are the same in the whole program, so is the store that stands beside them.
RemoteStore*& the_store() {
  static RemoteStore* store = nullptr;
  return store;
}

Error no_store(const std::filesystem::path& address) {
  return {ErrorCode::Unsupported,
          address.string() + ": this program reads no object storage: copy the file to this computer"};
}

}  // namespace

bool is_address(const std::filesystem::path& path) { return path.native().starts_with(kScheme); }

void use_remote_store(RemoteStore* store) { the_store() = store; }

Result<std::shared_ptr<RemoteFile>> open_remote(const std::filesystem::path& address) {
  if (the_store() == nullptr) return no_store(address);
  return the_store()->open(address.string());
}

Result<std::vector<std::string>> list_remote(const std::filesystem::path& folder) {
  if (the_store() == nullptr) return no_store(folder);
  return the_store()->list(folder.string());
}

Status write_remote(const std::filesystem::path& address, const std::filesystem::path& file,
                    const std::string& sha256) {
  if (the_store() == nullptr) return no_store(address);
  return the_store()->write(address.string(), file, sha256);
}

}  // namespace hueline
