#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <utility>

#include "core/input_file.hpp"
#include "object_store/s3_client.hpp"

namespace hueline::object_store {

/// Puts one file at one address, in one request, or in parts (multipart upload) if it is large. The storage gets the
/// SHA-256 of each request's content, with which AWS and others compare what arrives, and the object has that of the
/// file as its metadata "sha256". One thread uses an upload.
class S3Upload {
 public:
  /// `sha256`: of the file.
  S3Upload(S3Client& client, S3Address address, std::string sha256)
      : client_(client), address_(std::move(address)), sha256_(std::move(sha256)) {}

  /// Sends the file, unless the object is there already. Errors: those of RemoteStore::write().
  Status send(const std::filesystem::path& path);

 private:
  Result<bool> is_there(std::uint64_t size);
  Status send_whole(std::span<const std::byte> content);
  Status send_parts(const InputFile& file, std::uint64_t part_bytes);
  Result<std::string> send_each_part(const InputFile& file, std::uint64_t part_bytes, const std::string& upload);

  S3Client& client_;
  const S3Address address_;
  const std::string sha256_;
};

}  // namespace hueline::object_store
