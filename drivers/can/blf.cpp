#include "drivers/can/blf.hpp"

#include <fmt/format.h>
#include <libdeflate.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <memory>
#include <span>
#include <string>

#include "drivers/can/can_errors.hpp"
#include "drivers/inflater.hpp"

namespace hueline::drivers {
namespace {

// File header: "LOGG", its own size (u32), and facts about the log that are not needed to read it.
constexpr std::string_view kFileSignature = "LOGG", kObjectSignature = "LOBJ";
constexpr std::uint32_t kFileHeaderLeast = 8, kFileHeaderMost = 65536;

// Header of an object: "LOBJ", size of the header (u16), its version (u16), size of the object with its header (u32),
// type (u32). Version 1 and 2 go on with flags (u32), 4 bytes, the time stamp (u64).
constexpr std::size_t kBaseHeader = 16, kHeader = 32;
constexpr std::size_t kPaddingMost = 8;  // bytes between two objects; loggers do not agree on the rule
constexpr std::uint32_t kStampTenMicroseconds = 1;

enum Type : std::uint32_t {
  kMessage = 1,
  kError = 2,
  kContainer = 10,
  kErrorExt = 73,
  kMessage2 = 86,
  kFdMessage = 100,
  kFdMessage64 = 101,
  kFdError64 = 104
};
constexpr bool is_frame(std::uint32_t type) {
  return type == kMessage || type == kError || type == kErrorExt || type == kMessage2 || type == kFdMessage ||
         type == kFdMessage64 || type == kFdError64;
}
/// The kind of an object without a frame of a CAN bus, in words.
const char* kind_of(std::uint32_t type) {
  switch (type) {
    case 71:
    case 120:
    case 121:
      return "Ethernet";
    case 11:
    case 57:
      return "LIN";
    case 29:
    case 41:
    case 50:
    case 66:
      return "FlexRay";
    case 46:
      return "GPS";
    default:
      return "other kinds";
  }
}
constexpr std::uint32_t kFrameMost = 65536;           // bytes of an object with a frame
constexpr std::uint32_t kContainerHeader = 16;        // method (u16), 6 bytes, size of the content (u32), 4 bytes
constexpr std::uint32_t kContainerMost = 64'000'000;  // bytes, packed or not; Vector's programs write 128 KiB
constexpr std::uint16_t kPlain = 0, kZlib = 2;

constexpr std::uint32_t kExtended = 0x80000000, kStandardMost = 0x7FF, kIdMask = 0x1FFFFFFF;

template <class T>
T little(std::span<const std::byte> bytes, std::size_t at) {
  T value = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i)
    value = static_cast<T>(value | static_cast<T>(std::to_integer<T>(bytes[at + i]) << (8 * i)));
  return value;
}

bool is_signature(std::span<const std::byte> bytes, std::size_t at) {
  return std::memcmp(bytes.data() + at, kObjectSignature.data(), kObjectSignature.size()) == 0;
}

/// Returns false if the object is too short for its frame.
bool take_frame(std::uint32_t type, std::span<const std::byte> body, CanFrame& frame) {
  const auto byte = [&](std::size_t at) { return std::to_integer<std::uint8_t>(body[at]); };
  if (body.size() < 2) return false;
  if (type == kError || type == kErrorExt || type == kFdError64) {
    frame = broken_frame(byte(0));
    return true;
  }
  // Types 1, 86: channel (u16), flags, length code, id (u32), data.
  // Type 100: the same, then bit times (u32), a count, flags of CAN FD, number of data bytes, 5 bytes, data.
  // Type 101: channel, length code, number of data bytes, a count, id, bit time, flags (each u32), bit rates and times
  // (16 bytes), a count (u16), direction, offset of further data, check sum (u32), data.
  const bool is_64 = type == kFdMessage64;
  const std::size_t data = is_64 ? 40 : type == kFdMessage ? 20 : 8;
  if (body.size() < data) return false;
  const auto id = little<std::uint32_t>(body, 4);
  frame.bus = byte(0);
  frame.id = id & kIdMask;
  frame.is_extended = (id & kExtended) != 0 || frame.id > kStandardMost;  // the flag is missing in some logs
  std::size_t length = 0;
  if (is_64) {
    const auto flags = little<std::uint32_t>(body, 12);
    frame.is_remote = (flags & 0x10) != 0;
    frame.is_fd = (flags & 0x1000) != 0;
    frame.is_local = byte(34) != 0;
    length = byte(2);
  } else {
    frame.is_local = (byte(2) & 1) != 0;
    frame.is_remote = (byte(2) & 0x80) != 0;
    frame.is_fd = type == kFdMessage && (byte(13) & 1) != 0;
    length = type == kFdMessage ? byte(14) : std::min<std::size_t>(8, byte(3));
  }
  if (frame.is_remote) return true;
  if (length > (frame.is_fd ? kCanDataMost : 8)) return false;
  // Loggers leave the zeros at the end of an object of type 101 out, and may put further data behind the frame's.
  std::size_t stored = body.size() - data;
  if (is_64 && byte(35) >= kHeader + data) stored = std::min<std::size_t>(stored, byte(35) - kHeader - data);
  if (stored < length && !is_64) return false;
  frame.length = static_cast<std::uint8_t>(length);
  for (std::size_t i = 0; i < std::min(length, stored); ++i) frame.data[i] = byte(data + i);
  return true;
}

}  // namespace

bool is_blf(std::string_view first_bytes) { return first_bytes.starts_with(kFileSignature); }

/// Makes the error of bytes that are broken, and lets the reader search for the next object behind them.
Error BlfReader::lost(std::string what) {
  is_searching_ = true;
  skip_ = 0;
  return {ErrorCode::Malformed, std::move(what)};
}

/// Reads bytes that the file had when it was opened. Error: Io, also if the file has become shorter.
Status BlfReader::read(std::uint64_t offset, std::span<std::byte> out) const {
  const Status status = file_.read(offset, out);
  if (!status.ok() && status.error().code == ErrorCode::Truncated) return Error{ErrorCode::Io, status.error().message};
  return status;
}

Status BlfReader::start() {
  std::array<std::byte, kFileHeaderLeast> head{};
  if (file_.size() < head.size()) return Error{ErrorCode::Unsupported, file_.path().string() + " is no BLF"};
  if (Status status = read(0, head); !status.ok()) return status;
  const auto size = little<std::uint32_t>(head, 4);
  if (!is_blf({reinterpret_cast<const char*>(head.data()), head.size()}) || size < kFileHeaderLeast ||
      size > kFileHeaderMost)
    return Error{ErrorCode::Unsupported, file_.path().string() + " is no BLF"};
  file_at_ = size;
  is_started_ = true;
  return {};
}

/// Appends the next object or container of the file to `objects_`. Returns false at the end of the file.
Result<bool> BlfReader::fill() {
  objects_.erase(objects_.begin(), objects_.begin() + static_cast<std::ptrdiff_t>(at_));
  at_ = 0;
  std::vector<std::byte> block;
  for (;;) {
    const std::uint64_t rest = file_.size() - std::min(file_at_, file_.size());
    block.resize(static_cast<std::size_t>(std::min<std::uint64_t>(rest, is_searching_ ? 65536 : 64)));
    if (Status status = read(file_at_, block); !status.ok()) return status.error();
    if (rest < kBaseHeader) {
      file_at_ = file_.size();
      if (rest < kObjectSignature.size() || !is_signature(block, 0)) return false;
      return Error{ErrorCode::Truncated, "the log ends inside the header of an object"};
    }
    std::size_t found = 0;
    while (found + kBaseHeader <= block.size() && !is_signature(block, found)) ++found;
    if (found + kBaseHeader > block.size()) {  // no object here
      const std::uint64_t from = file_at_;
      file_at_ += block.size() - kBaseHeader + 1;
      if (is_searching_ || rest <= kPaddingMost + kBaseHeader) continue;
      objects_.clear();
      return lost(fmt::format("no object at byte {}", from));
    }
    const std::span<const std::byte> head = std::span(block).subspan(found, kBaseHeader);
    const std::uint64_t begin = file_at_ + found;
    const auto header_size = little<std::uint16_t>(head, 4);
    const auto size = little<std::uint32_t>(head, 8), type = little<std::uint32_t>(head, 12);
    if (size < kBaseHeader || header_size < kBaseHeader || header_size > size) {
      file_at_ = begin + kObjectSignature.size();
      return lost(fmt::format("the object at byte {} says that it has {} bytes", begin, size));
    }
    if (size > file_.size() - begin) {
      file_at_ = file_.size();
      objects_.clear();
      return Error{ErrorCode::Truncated,
                   fmt::format("the log ends inside the object at byte {}, which has {} bytes", begin, size)};
    }
    file_at_ = begin + size;
    container_at_ = begin;
    if (type == kContainer) {
      if (Status taken = take_container(begin, size, header_size); !taken.ok()) {
        objects_.clear();  // the beginning of an object whose end is lost
        return taken.error();
      }
      return true;
    }
    if (!is_frame(type) || size > kFrameMost) {
      ++passed_over_[kind_of(type)];
      continue;
    }
    const std::size_t before = objects_.size();
    objects_.resize(before + size);
    if (Status status = read(begin, std::span(objects_).subspan(before)); !status.ok()) return status.error();
    return true;
  }
}

Status BlfReader::take_container(std::uint64_t offset, std::uint32_t size, std::uint32_t header_size) {
  if (size > kContainerMost || size < header_size + kContainerHeader)
    return lost(fmt::format("the container at byte {} has {} bytes", offset, size));
  std::vector<std::byte> bytes(size - header_size);
  if (Status status = read(offset + header_size, bytes); !status.ok()) return status;
  const auto method = little<std::uint16_t>(bytes, 0);
  const auto content = little<std::uint32_t>(bytes, 8);
  const auto packed = std::span<const std::byte>(bytes).subspan(kContainerHeader);
  if (method == kPlain) {
    objects_.insert(objects_.end(), packed.begin(), packed.end());
    return {};
  }
  if (method != kZlib)
    return lost(
        fmt::format("the container at byte {} is packed by method {}; known: 0 (plain) and 2 (zlib)", offset, method));
  if (content > kContainerMost)
    return lost(fmt::format("the container at byte {} says that it holds {} bytes", offset, content));
  const Inflater inflater = make_inflater();
  if (!inflater) return Error{ErrorCode::Io, "no memory to unpack a container"};
  const std::size_t before = objects_.size();
  objects_.resize(before + content);
  std::size_t made = 0;
  if (libdeflate_zlib_decompress(inflater.get(), packed.data(), packed.size(), objects_.data() + before, content,
                                 &made) != LIBDEFLATE_SUCCESS)
    return lost(fmt::format("the container at byte {} cannot be unpacked", offset));
  objects_.resize(before + made);
  return {};
}

Result<std::optional<CanLogEntry>> BlfReader::next() {
  if (!is_started_)
    if (Status started = start(); !started.ok()) return started.error();
  for (;;) {
    const std::size_t passed = static_cast<std::size_t>(std::min<std::uint64_t>(skip_, left()));
    at_ += passed;
    skip_ -= passed;
    bool is_known = false;
    while (skip_ == 0 && left() >= kBaseHeader) {
      // Padding is passed over in silence, and so is what lies behind broken bytes, which were told.
      std::size_t gap = 0;
      const std::size_t most = is_searching_ ? left() : std::min(left(), kPaddingMost + kBaseHeader);
      while (gap + kBaseHeader <= most && !is_signature(objects_, at_ + gap)) ++gap;
      if (gap + kBaseHeader > most) {
        at_ += gap;
        if (is_searching_ || left() < kBaseHeader) break;
        return lost(fmt::format("no object inside the container at byte {}", container_at_));
      }
      at_ += gap;
      is_searching_ = false;
      is_known = true;
      break;
    }
    if (is_known) {
      const auto object = std::span<const std::byte>(objects_).subspan(at_);
      const auto header_size = little<std::uint16_t>(object, 4), version = little<std::uint16_t>(object, 6);
      const auto size = little<std::uint32_t>(object, 8), type = little<std::uint32_t>(object, 12);
      if (size < kBaseHeader || header_size < kBaseHeader || header_size > size) {
        at_ += kObjectSignature.size();
        return lost(
            fmt::format("an object in the container at byte {} says that it has {} bytes", container_at_, size));
      }
      if (!is_frame(type) || (version != 1 && version != 2) || size > kFrameMost) {
        ++passed_over_[kind_of(type)];
        skip_ = size;
        continue;
      }
      if (object.size() >= size) {
        at_ += size;
        CanLogEntry entry;
        const bool is_whole = header_size >= kHeader;
        const auto stamp = is_whole ? little<std::uint64_t>(object, 24) : 0;
        const std::uint64_t unit =
            is_whole && little<std::uint32_t>(object, 16) == kStampTenMicroseconds ? 10'000 : 1;  // ns
        if (!is_whole || stamp > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max()) / unit ||
            !take_frame(type, object.subspan(header_size, size - header_size), entry.frame))
          return Error{ErrorCode::Malformed,
                       fmt::format("a frame of type {} with {} bytes in the container at byte {} is cut or has a time "
                                   "that is none",
                                   type, size, container_at_)};
        entry.time = nanoseconds(static_cast<std::int64_t>(stamp * unit));
        return std::optional<CanLogEntry>(entry);
      }
    }
    const bool has_part = is_known || skip_ > 0;
    const Result<bool> filled = fill();
    if (!filled.ok()) return filled.error();
    if (*filled) continue;
    objects_.clear();
    at_ = 0;
    skip_ = 0;
    if (has_part) return Error{ErrorCode::Truncated, "the log ends inside an object"};
    return std::optional<CanLogEntry>();
  }
}

}  // namespace hueline::drivers
