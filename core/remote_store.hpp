#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/result.hpp"

/// Files that lie in a network, with an address in the place of a path: "s3://bucket/key". This folder knows no
/// protocol: a program that reads such files names the store that does (object_store/), and then whatever reads an
/// InputFile reads them too. Parts of an address are joined as those of a path (`folder / "drive.mcap"`); do not make
/// it absolute or canonical.
namespace hueline {

/// A file that lies elsewhere.
class RemoteFile {
 public:
  virtual ~RemoteFile() = default;
  /// Returns the size when the file was opened, in bytes.
  virtual std::uint64_t size() const = 0;
  /// Fills `out` with the bytes from `offset` on; the range lies inside the file. Waits for the network. Errors: Io if
  /// it does not give them, or if the file is not the one any more that was opened. Thread-safe.
  virtual Status read(std::uint64_t offset, std::span<std::byte> out) = 0;
};

/// Opens and lists files that lie elsewhere. Thread-safe.
class RemoteStore {
 public:
  virtual ~RemoteStore() = default;
  /// Errors: Io if there is no such file or it may not be read; Invalid if the address or what is configured is wrong.
  virtual Result<std::shared_ptr<RemoteFile>> open(const std::string& address) = 0;
  /// Returns the names of what lies in a folder, those of its folders with a slash at the end; nothing if there is no
  /// such folder. Errors: those of open().
  virtual Result<std::vector<std::string>> list(const std::string& folder) = 0;
  /// Puts a file of this computer at an address, where it replaces what is there. Others see it when it is whole, and
  /// not before. `sha256`: of the file, as 64 small hexadecimal digits; a file that is there with the same is left as
  /// it is. Errors: those of open(); Io if the storage does not take it, or the file changes meanwhile.
  virtual Status write(const std::string& address, const std::filesystem::path& file, const std::string& sha256) = 0;
};

/// Returns whether `path` is an address of object storage ("s3://...").
bool is_address(const std::filesystem::path& path);

/// Names the store of this program; null: it reads files of this computer only. To be called before anything is opened,
/// and when nothing is open any more. The store must exist until then.
void use_remote_store(RemoteStore* store);

/// Opens the file at an address. Errors: those of RemoteStore::open(); Unsupported if this program has no store.
Result<std::shared_ptr<RemoteFile>> open_remote(const std::filesystem::path& address);
/// Lists a folder at an address. Errors: those of RemoteStore::list(); Unsupported if this program has no store.
Result<std::vector<std::string>> list_remote(const std::filesystem::path& folder);
/// Puts a file at an address. Errors: those of RemoteStore::write(); Unsupported if this program has no store.
Status write_remote(const std::filesystem::path& address, const std::filesystem::path& file, const std::string& sha256);

}  // namespace hueline
