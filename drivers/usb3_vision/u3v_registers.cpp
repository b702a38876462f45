#include "drivers/usb3_vision/u3v_registers.hpp"

#include <fmt/format.h>
#include <libdeflate.h>

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include "drivers/inflater.hpp"
#include "drivers/little_endian.hpp"

namespace hueline::drivers {
namespace {

// ABRM.
constexpr std::uint64_t kResponseMs = 0x1CC, kManifest = 0x1D0, kSbrm = 0x1D8;
// SBRM.
constexpr std::uint64_t kMostCommand = 0x14, kMostAnswer = 0x18, kStreams = 0x1C, kSirm = 0x20;
// SIRM.
constexpr std::uint64_t kInfo = 0x00, kControl = 0x04, kPayload = 0x08, kLeader = 0x10, kTrailer = 0x14,
                        kMostLeader = 0x18, kTransfer = 0x1C, kTransfers = 0x20, kFinal1 = 0x24, kFinal2 = 0x28,
                        kMostTrailer = 0x2C;

constexpr std::size_t kTransferBytes = 256u << 10;
constexpr std::size_t kMostMessageBytes = 64u << 10, kMostResponseMs = 30'000;
constexpr std::uint64_t kMostPayload = 1u << 30, kMostAroundPayload = 64u << 10;
constexpr std::uint64_t kMostDescription = 32u << 20, kMostFiles = 64, kFileEntry = 64;

Result<std::uint64_t> get(CameraMemory& camera, std::uint64_t address, std::size_t size) {
  std::array<std::byte, 8> bytes{};
  if (Status read = camera.read(address, std::span(bytes).first(size)); !read) return read.error();
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < size; ++i) value |= std::to_integer<std::uint64_t>(bytes[i]) << (8 * i);
  return value;
}

Status set(CameraMemory& camera, std::uint64_t address, std::size_t value) {
  std::array<std::byte, 4> bytes{};
  put_little(bytes, 0, static_cast<std::uint32_t>(value));
  return camera.write(address, bytes);
}

/// Reads several registers, until one cannot be read.
class Reading {
 public:
  explicit Reading(CameraMemory& camera) : camera_(camera) {}
  std::uint64_t get(std::uint64_t address, std::size_t size) {
    if (!status_) return 0;
    const auto value = drivers::get(camera_, address, size);
    if (value) return *value;
    status_ = value.error();
    return 0;
  }
  const Status& status() const { return status_; }

 private:
  CameraMemory& camera_;
  Status status_;
};

std::size_t round_up(std::size_t bytes, std::size_t unit) { return (bytes + unit - 1) / unit * unit; }

Error no_zip(const char* why) {
  return {ErrorCode::Malformed, fmt::format("the camera's description file cannot be unpacked: {}", why)};
}

}  // namespace

Result<U3vBootstrap> read_bootstrap(CameraMemory& camera) {
  Reading reading(camera);
  U3vBootstrap out;
  const std::uint64_t response_ms = reading.get(kResponseMs, 4);
  out.manifest = reading.get(kManifest, 8);
  const std::uint64_t sbrm = reading.get(kSbrm, 8);
  const std::uint64_t command = reading.get(sbrm + kMostCommand, 4), answer = reading.get(sbrm + kMostAnswer, 4);
  const std::uint64_t streams = reading.get(sbrm + kStreams, 4);
  out.stream = reading.get(sbrm + kSirm, 8);
  if (!reading.status()) return reading.status().error();
  if (streams == 0 || out.stream == 0)
    return Error{ErrorCode::Unsupported, "the camera has no image stream (USB3 Vision, SIRM)"};
  out.limits.command_bytes = std::min<std::size_t>(command, kMostMessageBytes);
  out.limits.answer_bytes = std::min<std::size_t>(answer, kMostMessageBytes);
  out.limits.answers_within = std::max(
      out.limits.answers_within, std::chrono::milliseconds(std::min<std::uint64_t>(response_ms, kMostResponseMs)));
  return out;
}

Result<std::string> read_description(CameraMemory& camera, std::uint64_t manifest) {
  const auto files = get(camera, manifest, 8);
  if (!files) return files.error();
  if (*files == 0 || *files > kMostFiles)
    return Error{ErrorCode::Malformed, fmt::format("the camera says that it has {} description files", *files)};
  std::optional<std::uint64_t> chosen;
  for (std::uint64_t i = 0; i < *files; ++i) {
    const std::uint64_t entry = manifest + 8 + i * kFileEntry;
    const auto schema = get(camera, entry + 4, 4);
    if (!schema) return schema.error();
    const bool is_of_device = (*schema & 7U) == 0;  // others describe the chunks of an image
    if (!chosen || is_of_device) chosen = entry;
    if (is_of_device) break;
  }
  const auto address = get(camera, *chosen + 8, 8), size = get(camera, *chosen + 16, 8);
  if (!address) return address.error();
  if (!size) return size.error();
  if (*size == 0 || *size > kMostDescription)
    return Error{ErrorCode::Malformed, fmt::format("the camera says that its description has {} bytes", *size)};
  std::string file(*size, '\0');
  if (Status read = camera.read(*address, std::as_writable_bytes(std::span(file))); !read) return read.error();
  if (file.starts_with("PK")) return unzip(file);
  // Some cameras fill the file up with zeros.
  file.erase(file.find_last_not_of('\0') + 1);
  return file;
}

Result<std::string> unzip(const std::string& archive) {
  // APPNOTE 6.3: the end of the central directory, its first entry, and the head of that file.
  constexpr std::size_t kEnd = 22, kEntry = 46, kHead = 30;
  const std::string_view bytes = archive;
  const auto raw = std::as_bytes(std::span(archive));
  const auto u16 = [&](std::size_t at) { return std::size_t{get_little<std::uint16_t>(raw, at)}; };
  const auto u32 = [&](std::size_t at) { return std::size_t{get_little<std::uint32_t>(raw, at)}; };
  const std::size_t end = bytes.rfind("PK\x05\x06");
  if (end == bytes.npos || end + kEnd > bytes.size()) return no_zip("its directory is missing");
  const std::size_t entry = u32(end + 16);
  if (entry + kEntry > bytes.size() || bytes.substr(entry, 4) != "PK\x01\x02")
    return no_zip("its directory is damaged");
  const std::size_t method = u16(entry + 10), packed = u32(entry + 20), size = u32(entry + 24), head = u32(entry + 42);
  if (head + kHead > bytes.size() || bytes.substr(head, 4) != "PK\x03\x04") return no_zip("its file is missing");
  const std::size_t data = head + kHead + u16(head + 26) + u16(head + 28);
  if (data > bytes.size() || packed > bytes.size() - data || size > kMostDescription)
    return no_zip("its sizes are wrong");
  if (method == 0) return std::string(bytes.substr(data, packed));
  if (method != 8) return no_zip("its method of compression is not Deflate");
  std::string out(size, '\0');
  const Inflater inflater = make_inflater();
  if (!inflater) return no_zip("there is no memory");
  std::size_t got = 0;
  if (libdeflate_deflate_decompress(inflater.get(), archive.data() + data, packed, out.data(), out.size(), &got) !=
          LIBDEFLATE_SUCCESS ||
      got != size)
    return no_zip("its data are damaged");
  return out;
}

Result<U3vStreamShape> set_up_stream(CameraMemory& camera, std::uint64_t stream, std::size_t packet_bytes) {
  Reading reading(camera);
  const std::uint64_t alignment_bits = reading.get(stream + kInfo, 4) >> 24U;
  const std::uint64_t payload = reading.get(stream + kPayload, 8);
  const std::uint64_t leader = reading.get(stream + kLeader, 4), trailer = reading.get(stream + kTrailer, 4);
  if (!reading.status()) return reading.status().error();
  if (payload == 0 || payload > kMostPayload || leader > kMostAroundPayload || trailer > kMostAroundPayload ||
      (std::size_t{1} << std::min<std::uint64_t>(alignment_bits, 32)) > kTransferBytes)
    return Error{ErrorCode::Malformed,
                 fmt::format("the camera says that an image has {} bytes, with {} before and {} behind it, aligned to "
                             "2^{}",
                             payload, leader, trailer, alignment_bits)};
  const std::size_t alignment = std::size_t{1} << alignment_bits;
  U3vStreamShape out;
  out.payload_bytes = payload;
  const std::size_t whole = payload / kTransferBytes, rest = payload % kTransferBytes;
  const std::size_t last = round_up(rest, alignment);
  out.padding_bytes = last - rest;
  const std::size_t leader_bytes = round_up(std::max<std::size_t>(leader, 1), packet_bytes);
  const std::size_t trailer_bytes = round_up(std::max<std::size_t>(trailer, 1), packet_bytes);
  out.transfer_bytes.push_back(leader_bytes);
  out.transfer_bytes.insert(out.transfer_bytes.end(), whole, kTransferBytes);
  if (last > 0) out.transfer_bytes.push_back(round_up(last, packet_bytes));
  out.transfer_bytes.push_back(trailer_bytes);

  const std::pair<std::uint64_t, std::size_t> sizes[] = {
      {kMostLeader, leader_bytes},  {kTransfer, kTransferBytes}, {kTransfers, whole}, {kFinal1, last}, {kFinal2, 0},
      {kMostTrailer, trailer_bytes}};
  for (const auto& [address, value] : sizes)
    if (Status written = set(camera, stream + address, value); !written) return written.error();
  return out;
}

Status set_streaming(CameraMemory& camera, std::uint64_t stream, bool is_on) {
  return set(camera, stream + kControl, is_on ? 1 : 0);
}

}  // namespace hueline::drivers
