#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/input_file.hpp"
#include "core/input_folder.hpp"
#include "core/remote_store.hpp"

namespace hueline::test {

/// A store whose addresses s3://here/NAME are the files of a folder. While it lives, this program reads them.
class FolderStore final : public RemoteStore {
 public:
  explicit FolderStore(std::filesystem::path folder) : folder_(std::move(folder)) { use_remote_store(this); }
  ~FolderStore() override { use_remote_store(nullptr); }

  Result<std::shared_ptr<RemoteFile>> open(const std::string& address) override {
    auto file = InputFile::open(place_of(address));
    if (!file.ok()) return file.error();
    return std::shared_ptr<RemoteFile>(std::make_shared<File>(std::move(*file)));
  }
  Result<std::vector<std::string>> list(const std::string& folder) override { return list_folder(place_of(folder)); }
  Status write(const std::string& address, const std::filesystem::path& file, const std::string&) override {
    std::error_code failed;
    std::filesystem::copy_file(file, place_of(address), failed);
    return failed ? Status(io_error("copy " + file.string(), failed.value())) : Status();
  }

 private:
  class File final : public RemoteFile {
   public:
    explicit File(InputFile file) : file_(std::move(file)) {}
    std::uint64_t size() const override { return file_.size(); }
    Status read(std::uint64_t offset, std::span<std::byte> out) override { return file_.read(offset, out); }

   private:
    InputFile file_;
  };
  std::filesystem::path place_of(const std::string& address) const {
    return folder_ / std::filesystem::path(address.substr(std::string("s3://here").size())).relative_path();
  }

  const std::filesystem::path folder_;
};

}  // namespace hueline::test
