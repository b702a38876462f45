#include "storage/e57_pages.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/crc.hpp>
#include <cstring>
#include <string>

namespace hueline::storage {
namespace {

constexpr std::uint64_t kPagesAtOnce = 256;

}  // namespace

std::uint32_t e57_checksum(ByteView content) {
  boost::crc_optimal<32, 0x1EDC6F41, 0xFFFFFFFF, 0xFFFFFFFF, true, true> crc;
  crc.process_bytes(content.data(), content.size());
  return crc.checksum();
}

Status E57Pages::load(std::uint64_t page) {
  const std::uint64_t count = std::min(kPagesAtOnce, file_.size() / kE57Page - page);
  pages_.resize(static_cast<std::size_t>(count * kE57Page));
  first_page_ = page;
  if (Status read = file_.read(page * kE57Page, pages_); !read.ok()) {
    pages_.clear();
    return read;
  }
  for (std::size_t i = 0; i < count; ++i) {
    const ByteView content = ByteView(pages_).subspan(i * kE57Page, kE57Payload);
    std::uint32_t stored = 0;
    for (std::size_t k = 0; k < 4; ++k)
      stored = stored << 8 | std::to_integer<std::uint32_t>(pages_[i * kE57Page + kE57Payload + k]);
    if (e57_checksum(content) == stored) continue;
    // What lies before the damage can be read.
    pages_.resize(i * kE57Page);
    if (i > 0) break;
    return Error{ErrorCode::Malformed,
                 fmt::format("{}: is damaged: the {} bytes at byte {} do not have their check sum",
                             file_.path().string(), kE57Page, page * kE57Page)};
  }
  return {};
}

Status E57Pages::read(std::uint64_t in_content, std::span<std::byte> out) {
  if (in_content > size() || out.size() > size() - in_content)
    return Error{ErrorCode::Truncated, fmt::format("{}: ends in the middle: byte {} is behind its last page",
                                                   file_.path().string(), e57_place_in_file(in_content + out.size()))};
  while (!out.empty()) {
    const std::uint64_t page = in_content / kE57Payload;
    if (page < first_page_ || page - first_page_ >= pages_.size() / kE57Page)
      if (Status loaded = load(page); !loaded.ok()) return loaded;
    const auto within = static_cast<std::size_t>(in_content % kE57Payload);
    const std::size_t part = std::min(out.size(), kE57Payload - within);
    std::memcpy(out.data(), pages_.data() + static_cast<std::size_t>(page - first_page_) * kE57Page + within, part);
    out = out.subspan(part);
    in_content += part;
  }
  return {};
}

}  // namespace hueline::storage
