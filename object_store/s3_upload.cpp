#include "object_store/s3_upload.hpp"

#include <fmt/format.h>
#include <openssl/evp.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <vector>

namespace hueline::object_store {
namespace {

constexpr std::uint64_t kPart = std::uint64_t{64} << 20;  // bytes; also the largest file that is sent in one request
constexpr std::uint64_t kMostParts = 10'000;              // what S3 allows
constexpr const char* kMetadata = "x-amz-meta-sha256";

std::string sha256_of(std::span<const std::byte> bytes) {
  std::array<unsigned char, 32> hash{};
  std::size_t size = hash.size();
  // What this computer cannot hash is sent without; TLS protects it.
  if (EVP_Q_digest(nullptr, "SHA256", nullptr, bytes.data(), bytes.size(), hash.data(), &size) != 1)
    return "UNSIGNED-PAYLOAD";
  std::string out;
  for (const unsigned char byte : hash) out += fmt::format("{:02x}", byte);
  return out;
}

}  // namespace

Status S3Upload::send(const std::filesystem::path& path) {
  const auto file = InputFile::open(path);
  if (!file.ok()) return file.error();
  const auto there = is_there(file->size());
  if (!there.ok()) return there.error();
  if (*there) return {};
  Status sent;
  if (file->size() <= kPart) {
    std::vector<std::byte> content(static_cast<std::size_t>(file->size()));
    if (Status read = file->read(0, content); !read.ok()) return read;
    if (sha256_of(content) != sha256_)
      return Error{ErrorCode::Io, path.string() + ": the file has changed since its SHA-256 was taken"};
    sent = send_whole(content);
  } else {
    sent = send_parts(*file, std::max(kPart, file->size() / (kMostParts - 1)));
  }
  // The answer may be lost of a request that was done.
  const auto arrived = is_there(file->size());
  if (arrived.ok() && *arrived) return {};
  if (!sent.ok()) return sent;
  if (!arrived.ok()) return arrived.error();
  return Error{ErrorCode::Io, name(address_) + ": the storage has another object than was sent"};
}

/// Returns whether the object is there, with the size and the SHA-256 of the file.
Result<bool> S3Upload::is_there(std::uint64_t size) {
  const auto listed = client_.ask({.method = "HEAD", .address = address_, .may_be_missing = true});
  if (!listed.ok()) return listed.error();
  return listed->header(kMetadata) == sha256_ && listed->header("content-length") == std::to_string(size);
}

Status S3Upload::send_whole(std::span<const std::byte> content) {
  const auto answer = client_.ask({.method = "PUT",
                                   .address = address_,
                                   .headers = {{"Content-Type", "application/octet-stream"},
                                               {"x-amz-content-sha256", sha256_},
                                               {kMetadata, sha256_}},
                                   .content = content});
  return answer.ok() ? Status() : answer.error();
}

Status S3Upload::send_parts(const InputFile& file, std::uint64_t part_bytes) {
  const auto begun = client_.ask({.method = "POST",
                                  .address = address_,
                                  .query = {{"uploads", ""}},
                                  .headers = {{"Content-Type", "application/octet-stream"}, {kMetadata, sha256_}},
                                  .content = std::span<const std::byte>()});
  if (!begun.ok()) return begun.error();
  std::size_t at = 0;
  const auto upload = xml_text(begun->text, "UploadId", at);
  if (!upload) return Error{ErrorCode::Io, name(address_) + ": the storage does not take uploads in parts"};
  const auto list = send_each_part(file, part_bytes, *upload);
  Status done = list.ok() ? Status() : list.error();
  if (list.ok()) {
    const auto answer = client_.ask({.method = "POST",
                                     .address = address_,
                                     .query = {{"uploadId", *upload}},
                                     .headers = {{"Content-Type", "application/xml"}},
                                     .content = std::as_bytes(std::span(*list))});
    // An answer with status 200 may still say that it failed.
    if (!answer.ok())
      done = answer.error();
    else if (answer->text.find("<Error>") != std::string::npos)
      done = Error{ErrorCode::Io, name(address_) + ": the storage could not join the parts: send it again"};
  }
  // What is left of an upload that failed would cost money.
  if (!done.ok()) (void)client_.ask({.method = "DELETE", .address = address_, .query = {{"uploadId", *upload}}});
  return done;
}

/// Returns the list of the parts, in XML.
Result<std::string> S3Upload::send_each_part(const InputFile& file, std::uint64_t part_bytes,
                                             const std::string& upload) {
  std::string list = "<CompleteMultipartUpload>";
  std::vector<std::byte> content;
  int number = 0;
  for (std::uint64_t at = 0; at < file.size(); at += part_bytes) {
    content.resize(static_cast<std::size_t>(std::min(part_bytes, file.size() - at)));
    if (Status read = file.read(at, content); !read.ok()) return read.error();
    const auto answer = client_.ask(
        {.method = "PUT",
         .address = address_,
         .query = {{"partNumber", std::to_string(++number)}, {"uploadId", upload}},
         .headers = {{"Content-Type", "application/octet-stream"}, {"x-amz-content-sha256", sha256_of(content)}},
         .content = content});
    if (!answer.ok()) return answer.error();
    list += fmt::format("<Part><PartNumber>{}</PartNumber><ETag>{}</ETag></Part>", number, answer->header("etag"));
  }
  return list + "</CompleteMultipartUpload>";
}

}  // namespace hueline::object_store
