#include "apps/sha256.hpp"

#include <fmt/format.h>
#include <sodium.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/input_file.hpp"

namespace hueline::apps {
namespace {

using Hash = std::array<unsigned char, crypto_hash_sha256_BYTES>;

std::string digits_of(const Hash& hash) {
  std::string out;
  for (const unsigned char byte : hash) out += fmt::format("{:02x}", byte);
  return out;
}

}  // namespace

Result<std::string> sha256_of(const std::filesystem::path& file, const std::stop_token& stop) {
  const auto in = InputFile::open(file);
  if (!in.ok()) return in.error();
  crypto_hash_sha256_state state;
  crypto_hash_sha256_init(&state);
  std::vector<std::byte> piece(std::size_t{1} << 20);
  for (std::uint64_t at = 0; at < in->size();) {
    if (stop.stop_requested()) return Error{ErrorCode::Stopped, file.string() + ": stopped before its end"};
    const auto size = static_cast<std::size_t>(std::min<std::uint64_t>(piece.size(), in->size() - at));
    if (const Status read = in->read(at, std::span(piece).first(size)); !read.ok()) return read.error();
    crypto_hash_sha256_update(&state, reinterpret_cast<const unsigned char*>(piece.data()), size);
    at += size;
  }
  Hash hash{};
  crypto_hash_sha256_final(&state, hash.data());
  return digits_of(hash);
}

std::string sha256_of_text(std::string_view text) {
  Hash hash{};
  crypto_hash_sha256(hash.data(), reinterpret_cast<const unsigned char*>(text.data()), text.size());
  return digits_of(hash);
}

}  // namespace hueline::apps
