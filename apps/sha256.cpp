#include "apps/sha256.hpp"

#include <fmt/format.h>
#include <openssl/evp.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/input_file.hpp"

namespace hueline::apps {
namespace {

/// OpenSSL's, because it uses the processor's own instructions: recordings of terabytes are read to be named. A result
/// that OpenSSL refuses is an empty text, which is the SHA-256 of nothing.
class Sha256 {
 public:
  Sha256() : state_(EVP_MD_CTX_new(), EVP_MD_CTX_free) {
    is_good_ = state_ && EVP_DigestInit_ex(state_.get(), EVP_sha256(), nullptr) == 1;
  }
  void add(std::span<const std::byte> bytes) {
    is_good_ = is_good_ && EVP_DigestUpdate(state_.get(), bytes.data(), bytes.size()) == 1;
  }
  std::string digits() {
    std::array<unsigned char, 32> hash{};
    if (!is_good_ || EVP_DigestFinal_ex(state_.get(), hash.data(), nullptr) != 1) return {};
    std::string out;
    for (const unsigned char byte : hash) out += fmt::format("{:02x}", byte);
    return out;
  }

 private:
  std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> state_;
  bool is_good_ = false;
};

}  // namespace

Result<std::string> sha256_of(const std::filesystem::path& file, const std::stop_token& stop) {
  const auto in = InputFile::open(file);
  if (!in.ok()) return in.error();
  Sha256 hash;
  std::vector<std::byte> piece(std::size_t{1} << 20);
  for (std::uint64_t at = 0; at < in->size();) {
    if (stop.stop_requested()) return Error{ErrorCode::Stopped, file.string() + ": stopped before its end"};
    const auto size = static_cast<std::size_t>(std::min<std::uint64_t>(piece.size(), in->size() - at));
    if (const Status read = in->read(at, std::span(piece).first(size)); !read.ok()) return read.error();
    hash.add(std::span(piece).first(size));
    at += size;
  }
  std::string digits = hash.digits();
  if (digits.empty()) return Error{ErrorCode::Unsupported, file.string() + ": OpenSSL has no SHA-256 on this computer"};
  return digits;
}

std::string sha256_of_text(std::string_view text) {
  Sha256 hash;
  hash.add(std::as_bytes(std::span(text)));
  return hash.digits();
}

}  // namespace hueline::apps
