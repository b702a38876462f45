#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <vector>

#include <unistd.h>

namespace hueline::test {

/// Writes the bytes of capture files and of the headers in them, for tests. It is written from the documents of the
/// formats and shares no code with the reader.
class ByteWriter {
 public:
  explicit ByteWriter(bool is_big_endian) : is_big_endian_(is_big_endian) {}
  ByteWriter& u8(unsigned v) {
    bytes_.push_back(static_cast<std::byte>(v));
    return *this;
  }
  ByteWriter& u16(unsigned v) { return integer(v, 2); }
  ByteWriter& u32(std::uint64_t v) { return integer(v, 4); }
  ByteWriter& u64(std::uint64_t v) { return integer(v, 8); }
  ByteWriter& raw(std::span<const std::byte> more) {
    bytes_.insert(bytes_.end(), more.begin(), more.end());
    return *this;
  }
  ByteWriter& text(const std::string& s) { return raw(std::as_bytes(std::span(s))); }
  ByteWriter& zeros(std::size_t n) {
    bytes_.resize(bytes_.size() + n);
    return *this;
  }
  std::size_t size() const { return bytes_.size(); }
  const std::vector<std::byte>& bytes() const { return bytes_; }

 private:
  ByteWriter& integer(std::uint64_t v, unsigned width) {
    for (unsigned i = 0; i < width; ++i)
      u8(static_cast<unsigned>(v >> (8 * (is_big_endian_ ? width - 1 - i : i)) & 0xFF));
    return *this;
  }
  bool is_big_endian_;
  std::vector<std::byte> bytes_;
};

using Bytes = std::vector<std::byte>;

/// Returns a UDP segment. The packets below go from 192.168.1.201 (IPv6: fd00::c9) to 192.168.1.70 (fd00::46).
inline Bytes udp_segment(const std::string& payload, unsigned port) {
  return ByteWriter(true)
      .u16(port)
      .u16(port)
      .u16(static_cast<unsigned>(payload.size()) + 8)
      .u16(0)
      .text(payload)
      .bytes();
}
/// Returns a TCP segment. `flags` is the byte of control bits: 0x02 SYN, 0x10 ACK.
inline Bytes tcp_segment(std::span<const std::byte> payload, std::uint32_t sequence, unsigned source_port,
                         unsigned destination_port, unsigned flags = 0x10) {
  return ByteWriter(true)
      .u16(source_port)
      .u16(destination_port)
      .u32(sequence)
      .u32(0)
      .u8(0x80)  // 32 bytes of header: 12 bytes of options
      .u8(flags)
      .u16(65535)
      .u32(0)
      .zeros(12)
      .raw(payload)
      .bytes();
}
/// Returns an IPv4 packet. `offset` is in bytes. The packet is a fragment if `offset` is not zero or `has_more` is set.
inline Bytes ipv4_packet(std::span<const std::byte> body, unsigned identification = 1, std::size_t offset = 0,
                         bool has_more = false, unsigned protocol = 17) {
  return ByteWriter(true)
      .u8(0x45)
      .u8(0)
      .u16(20 + static_cast<unsigned>(body.size()))
      .u16(identification)
      .u16((has_more ? 0x2000u : 0u) | static_cast<unsigned>(offset / 8))
      .u8(64)
      .u8(protocol)
      .u16(0)
      .u32(0xC0A801C9)
      .u32(0xC0A80146)
      .raw(body)
      .bytes();
}
/// Returns an IPv6 packet.
inline Bytes ipv6_packet(std::span<const std::byte> body, unsigned next_header = 17) {
  return ByteWriter(true)
      .u32(0x60000000)
      .u16(static_cast<unsigned>(body.size()))
      .u8(next_header)
      .u8(64)
      .u16(0xFD00)
      .zeros(13)
      .u8(0xC9)
      .u16(0xFD00)
      .zeros(13)
      .u8(0x46)
      .raw(body)
      .bytes();
}
/// Returns an Ethernet frame with 0 or more VLAN tags.
inline Bytes ethernet_frame(std::span<const std::byte> packet, unsigned type = 0x0800, int vlan_tags = 0) {
  ByteWriter frame(true);
  frame.zeros(12);
  for (int i = 0; i < vlan_tags; ++i) frame.u16(i + 1 < vlan_tags ? 0x88A8 : 0x8100).u16(42);
  return frame.u16(type).raw(packet).bytes();
}

/// A classic pcap file in memory.
class PcapWriter {
 public:
  explicit PcapWriter(std::uint32_t link_type = 1, bool is_big_endian = false, bool has_nanoseconds = false)
      : out_(is_big_endian), has_nanoseconds_(has_nanoseconds) {
    out_.u32(has_nanoseconds ? 0xA1B23C4D : 0xA1B2C3D4).u16(2).u16(4).u32(0).u32(0).u32(262144).u32(link_type);
  }
  /// Appends a frame. `cut_to` is the number of bytes that the capture kept.
  PcapWriter& frame(std::int64_t time_ns, std::span<const std::byte> bytes, std::size_t cut_to = SIZE_MAX) {
    const std::size_t kept = bytes.size() < cut_to ? bytes.size() : cut_to;
    const std::int64_t part = time_ns % 1'000'000'000;
    out_.u32(static_cast<std::uint64_t>(time_ns / 1'000'000'000))
        .u32(static_cast<std::uint64_t>(has_nanoseconds_ ? part : part / 1000))
        .u32(kept)
        .u32(bytes.size())
        .raw(bytes.first(kept));
    return *this;
  }
  const Bytes& bytes() const { return out_.bytes(); }

 private:
  ByteWriter out_;
  bool has_nanoseconds_;
};

/// A file that exists as long as this object.
class TemporaryFile {
 public:
  TemporaryFile(const std::string& name, std::span<const std::byte> bytes)
      : path_(std::filesystem::temp_directory_path() / ("hueline_test_" + std::to_string(::getpid()) + "_" + name)) {
    std::ofstream file(path_, std::ios::binary);
    file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }
  ~TemporaryFile() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  std::string path() const { return path_.string(); }

 private:
  std::filesystem::path path_;
};

}  // namespace hueline::test
