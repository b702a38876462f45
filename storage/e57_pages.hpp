#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <utility>

#include "core/input_file.hpp"
#include "core/result.hpp"
#include "storage/byte_order.hpp"

/// What reader and writer of E57 (ASTM E2807-11) share: the pages of which such a file consists, and the heads of what
/// lies in them. Numbers are little endian.
namespace hueline::storage {

/// A page is 1020 bytes of content and their check sum.
constexpr std::size_t kE57Page = 1024, kE57Payload = kE57Page - 4;
/// "ASTM-E57", u32 version and u32 minor version, u64 size of the file, u64 place of the description, u64 its length,
/// u64 size of a page.
constexpr std::size_t kE57FileHeader = 48;
constexpr std::string_view kE57Signature = "ASTM-E57";
/// Of a section of points: u8 kind, 7 bytes, u64 its length, u64 place of its first packet, u64 place of its index.
constexpr std::size_t kE57SectionHeader = 32;
constexpr std::uint8_t kE57VectorSection = 1;
/// Of a packet: u8 kind, u8 flags, u16 its length less one. A packet of data goes on with the u16 number of its
/// streams, their u16 lengths, and the streams.
constexpr std::uint8_t kE57IndexPacket = 0, kE57DataPacket = 1;
constexpr std::size_t kE57PacketHead = 6, kE57MostPacket = 65536;

/// Returns where a byte of the content lies in the file, between the check sums of the pages.
constexpr std::uint64_t e57_place_in_file(std::uint64_t in_content) {
  return in_content / kE57Payload * kE57Page + in_content % kE57Payload;
}
/// Returns which byte of the content lies at a place in the file.
constexpr std::uint64_t e57_place_in_content(std::uint64_t in_file) {
  return in_file / kE57Page * kE57Payload + in_file % kE57Page;
}
/// Returns the check sum of a page's content: CRC-32C (Castagnoli), which the page has behind it, big endian.
std::uint32_t e57_checksum(ByteView content);

/// Reads the content of a file, page by page, with their check sums. Move-only.
/// Thread safety: none.
class E57Pages {
 public:
  explicit E57Pages(InputFile file) : file_(std::move(file)) {}

  /// Fills `out` from this byte of the content on. Errors: Io; Truncated behind the end; Malformed if a page does not
  /// have its check sum, with the page.
  Status read(std::uint64_t in_content, std::span<std::byte> out);
  /// Returns the number of bytes of content.
  std::uint64_t size() const { return file_.size() / kE57Page * kE57Payload; }
  const InputFile& file() const { return file_; }

 private:
  Status load(std::uint64_t page);

  InputFile file_;
  Bytes pages_;  // those that were read last
  std::uint64_t first_page_ = 0;
};

}  // namespace hueline::storage
