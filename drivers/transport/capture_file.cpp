#include "drivers/transport/capture_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <utility>

#include "core/packed_file.hpp"

namespace hueline::drivers {
namespace {

constexpr std::uint32_t kMicroseconds = 0xA1B2C3D4, kNanoseconds = 0xA1B23C4D;
constexpr std::uint32_t kSectionBlock = 0x0A0D0D0A, kByteOrder = 0x1A2B3C4D;
constexpr std::uint32_t kInterfaceBlock = 1, kOldPacketBlock = 2, kSimpleBlock = 3, kEnhancedBlock = 6;
constexpr std::uint16_t kOptionName = 2, kOptionResolution = 9, kOptionOffset = 14;

/// Largest frame that is read. libpcap's own limit is 256 KiB, so a larger number means that the length is broken.
constexpr std::uint32_t kMaxFrame = 1 << 20;
constexpr std::uint32_t kMaxBlock = 16 << 20;
constexpr std::size_t kMostInterfaces = 4096;  // in one section; a computer has a handful

std::uint32_t swapped(std::uint32_t v) { return __builtin_bswap32(v); }

__extension__ using Int128 = __int128;

/// Converts ticks to ns without overflow. A time that does not fit into 64-bit ns becomes the limit.
nanoseconds to_ns(std::uint64_t ticks, std::uint64_t per_second, std::int64_t offset_s) {
  const auto whole = static_cast<Int128>(ticks / per_second) + offset_s;
  const auto part = static_cast<Int128>(ticks % per_second) * 1'000'000'000 / per_second;
  const Int128 ns = whole * 1'000'000'000 + part;
  constexpr Int128 limit = INT64_MAX;
  return nanoseconds(static_cast<std::int64_t>(ns > limit ? limit : ns < -limit ? -limit : ns));
}

}  // namespace

bool is_capture(std::string_view first_bytes) {
  using namespace std::string_view_literals;
  constexpr std::array kMagics = {"\xa1\xb2\xc3\xd4"sv, "\xd4\xc3\xb2\xa1"sv, "\xa1\xb2\x3c\x4d"sv,
                                  "\x4d\x3c\xb2\xa1"sv, "\x0a\x0d\x0d\x0a"sv};
  return std::ranges::any_of(kMagics, [&](std::string_view magic) { return first_bytes.starts_with(magic); });
}

Result<CaptureFile> CaptureFile::open(const std::string& path) {
  auto input = InputFile::open(path);
  if (!input.ok()) return input.error();
  const auto stream = input->stream();
  if (!stream.ok()) return stream.error();
  auto file = from_stream(*stream, path);
  if (file.ok()) file->input_ = std::move(*input);
  return file;
}

Result<CaptureFile> CaptureFile::from_stream(std::FILE* stream, std::string name) {
  CaptureFile file(stream, std::move(name));
  if (Status header = file.read_header(); !header) return file.read_error_.value_or(header.error());
  return file;
}

std::uint32_t CaptureFile::u32(const std::byte* p) const {
  const std::uint32_t v = static_cast<std::uint32_t>(p[0]) | static_cast<std::uint32_t>(p[1]) << 8 |
                          static_cast<std::uint32_t>(p[2]) << 16 | static_cast<std::uint32_t>(p[3]) << 24;
  return is_swapped_ ? swapped(v) : v;
}

std::uint16_t CaptureFile::u16(const std::byte* p) const {
  const auto low = static_cast<unsigned>(p[is_swapped_ ? 1 : 0]), high = static_cast<unsigned>(p[is_swapped_ ? 0 : 1]);
  return static_cast<std::uint16_t>(low | high << 8);
}

Error CaptureFile::error(ErrorCode code, const std::string& what) const {
  return {code, fmt::format("{}: {} at byte {}", name_, what, record_)};
}

/// Appends `size` bytes of the file to the buffer.
CaptureFile::Fill CaptureFile::fill(std::size_t size) {
  const std::size_t had = buffer_.size();
  buffer_.resize(had + size);
  const std::size_t got = std::fread(buffer_.data() + had, 1, size, file_.get());
  if (got < size && std::ferror(file_.get()) != 0) read_error_ = io_error("read " + name_, errno);
  offset_ += got;
  buffer_.resize(had + got);
  return got == size ? Fill::Whole : got == 0 ? Fill::AtEnd : Fill::Cut;
}

Status CaptureFile::read_header() {
  const Fill filled = fill(4);
  if (filled == Fill::AtEnd) return error(ErrorCode::Truncated, "the file is empty");
  if (filled == Fill::Cut) return error(ErrorCode::Truncated, "no capture header");
  const std::uint32_t magic = u32(buffer_.data());
  if (magic == kSectionBlock) {
    is_blocks_ = true;
    if (std::optional<Error> bad = begin_section()) return *bad;
    return {};
  }
  is_swapped_ = magic == swapped(kMicroseconds) || magic == swapped(kNanoseconds);
  const std::uint32_t native = is_swapped_ ? swapped(magic) : magic;
  if (native != kMicroseconds && native != kNanoseconds) {
    fill(20);  // whatever there is
    const std::string packed = how_to_unpack({reinterpret_cast<const char*>(buffer_.data()), buffer_.size()});
    if (!packed.empty()) return Error{ErrorCode::Unsupported, name_ + " " + packed};
    return error(ErrorCode::Unsupported, fmt::format("neither pcap nor pcapng (magic {:08X})", magic));
  }
  classic_ticks_per_second_ = native == kNanoseconds ? 1'000'000'000 : 1'000'000;
  if (fill(20) != Fill::Whole) return error(ErrorCode::Truncated, "pcap header is cut off");
  // The bits above these say whether frames end with a check sequence, and how long it is.
  classic_link_type_ = u32(buffer_.data() + 20) & 0xFFFF;
  return {};
}

Result<CaptureFrame> CaptureFile::next() {
  if (ended_) return *ended_;
  Result<CaptureFrame> frame = is_blocks_ ? next_block() : next_classic();
  if (frame.ok()) return frame;
  // A disk or network that fails is no end of the file.
  ended_ = read_error_.value_or(frame.error());
  return *ended_;
}

Result<CaptureFrame> CaptureFile::next_classic() {
  record_ = offset_;
  buffer_.clear();
  switch (fill(16)) {
    case Fill::AtEnd:
      return Error{ErrorCode::EndOfData, name_ + ": end of capture"};
    case Fill::Cut:
      return error(ErrorCode::Truncated, "capture ends inside a record header");
    case Fill::Whole:
      break;
  }
  CaptureFrame frame;
  frame.time = to_ns(u32(buffer_.data() + 4), classic_ticks_per_second_, u32(buffer_.data()));
  frame.link_type = classic_link_type_;
  frame.length = u32(buffer_.data() + 12);
  frame.offset = record_;
  frame.is_big_endian = is_swapped_;
  const std::uint32_t captured = u32(buffer_.data() + 8);
  if (captured > kMaxFrame) return error(ErrorCode::Malformed, fmt::format("record claims {} bytes", captured));
  buffer_.clear();
  if (captured > 0 && fill(captured) != Fill::Whole)
    return error(ErrorCode::Truncated, fmt::format("capture ends inside a record of {} bytes", captured));
  frame.bytes = buffer_;
  return frame;
}

/// Reads the rest of a section header, whose block type is already in the buffer. Each section has its own byte order.
std::optional<Error> CaptureFile::begin_section() {
  if (fill(8) != Fill::Whole) return error(ErrorCode::Truncated, "capture ends inside a section header");
  is_swapped_ = false;
  const std::uint32_t order = u32(buffer_.data() + 8);
  if (order != kByteOrder && order != swapped(kByteOrder))
    return error(ErrorCode::Malformed, fmt::format("section header has byte-order magic {:08X}", order));
  is_swapped_ = order != kByteOrder;
  const std::uint32_t length = u32(buffer_.data() + 4);
  if (length < 28 || length % 4 != 0 || length > kMaxBlock)
    return error(ErrorCode::Malformed, fmt::format("section header claims {} bytes", length));
  if (fill(length - 12) != Fill::Whole) return error(ErrorCode::Truncated, "capture ends inside a section header");
  interfaces_.clear();
  return {};
}

Result<CaptureFrame> CaptureFile::next_block() {
  for (;;) {
    record_ = offset_;
    buffer_.clear();
    switch (fill(4)) {
      case Fill::AtEnd:
        return Error{ErrorCode::EndOfData, name_ + ": end of capture"};
      case Fill::Cut:
        return error(ErrorCode::Truncated, "capture ends inside a block header");
      case Fill::Whole:
        break;
    }
    const std::uint32_t type = u32(buffer_.data());
    if (type == kSectionBlock) {  // reads the same in either byte order
      if (std::optional<Error> bad = begin_section()) return *bad;
      continue;
    }
    if (fill(4) != Fill::Whole) return error(ErrorCode::Truncated, "capture ends inside a block header");
    const std::uint32_t length = u32(buffer_.data() + 4);
    if (length < 12 || length % 4 != 0 || length > kMaxBlock)
      return error(ErrorCode::Malformed, fmt::format("block claims {} bytes", length));
    if (fill(length - 8) != Fill::Whole)
      return error(ErrorCode::Truncated, fmt::format("capture ends inside a block of {} bytes", length));
    if (u32(buffer_.data() + length - 4) != length) return error(ErrorCode::Malformed, "block's two lengths differ");
    const std::span<const std::byte> body(buffer_.data() + 8, length - 12);
    if (type == kInterfaceBlock) {
      if (interfaces_.size() >= kMostInterfaces)
        return error(ErrorCode::Exhausted, fmt::format("section with more than {} interfaces", kMostInterfaces));
      if (!add_interface(body)) return error(ErrorCode::Malformed, "interface block is broken");
    } else if (type == kEnhancedBlock || type == kSimpleBlock || type == kOldPacketBlock) {
      std::optional<CaptureFrame> frame = packet_block(type, body);
      if (!frame) return error(ErrorCode::Malformed, "packet block is broken");
      return *frame;
    }
  }
}

bool CaptureFile::add_interface(std::span<const std::byte> body) {
  if (body.size() < 8) return false;
  Interface interface;
  interface.link_type = u16(body.data());
  interface.snap_length = u32(body.data() + 4);
  for (std::size_t at = 8; at + 4 <= body.size();) {
    const std::uint16_t code = u16(body.data() + at), length = u16(body.data() + at + 2);
    const std::byte* value = body.data() + at + 4;
    if (code == 0) break;
    if (length > body.size() - at - 4) return false;
    if (code == kOptionName) {
      interface.name.assign(reinterpret_cast<const char*>(value), length);
    } else if (code == kOptionResolution && length == 1) {
      const auto exponent = static_cast<unsigned>(value[0]) & 0x7Fu;
      const bool is_binary = (static_cast<unsigned>(value[0]) & 0x80u) != 0;
      if (exponent > (is_binary ? 63u : 19u)) return false;
      interface.ticks_per_second = 1;
      for (unsigned i = 0; i < exponent; ++i) interface.ticks_per_second *= is_binary ? 2 : 10;
    } else if (code == kOptionOffset && length == 8) {
      const std::uint64_t first = u32(value), second = u32(value + 4);
      interface.offset_s = static_cast<std::int64_t>(is_swapped_ ? first << 32 | second : second << 32 | first);
    }
    at += 4 + (length + 3u) / 4 * 4;
  }
  if (interface.name.empty()) interface.name = std::to_string(interfaces_.size());
  interfaces_.push_back(std::move(interface));
  return true;
}

std::optional<CaptureFrame> CaptureFile::packet_block(std::uint32_t type, std::span<const std::byte> body) {
  const std::size_t head = type == kSimpleBlock ? 4 : 20;
  if (body.size() < head) return {};
  std::uint32_t interface = 0;
  if (type == kEnhancedBlock) interface = u32(body.data());
  if (type == kOldPacketBlock) interface = u16(body.data());
  if (interface >= interfaces_.size()) return {};
  const Interface& from = interfaces_[interface];
  CaptureFrame frame;
  frame.link_type = from.link_type;
  frame.offset = record_;
  frame.is_big_endian = is_swapped_;
  frame.interface = from.name;
  std::uint32_t captured = 0;
  if (type == kSimpleBlock) {
    frame.length = u32(body.data());
    captured = from.snap_length ? std::min(frame.length, from.snap_length) : frame.length;
  } else {
    const std::uint64_t ticks = static_cast<std::uint64_t>(u32(body.data() + 4)) << 32 | u32(body.data() + 8);
    frame.time = to_ns(ticks, from.ticks_per_second, from.offset_s);
    captured = u32(body.data() + 12);
    frame.length = u32(body.data() + 16);
  }
  if (captured > body.size() - head) return {};
  frame.bytes = body.subspan(head, captured);
  return frame;
}

}  // namespace hueline::drivers
