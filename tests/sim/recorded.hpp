#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <span>
#include <vector>

/// The tests' own small readers of recordings. They read enough to compare bytes and share nothing with the program.
namespace hueline::sim::test {

inline std::vector<std::byte> read_file(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  const std::vector<char> chars{std::istreambuf_iterator<char>(in), {}};
  std::vector<std::byte> bytes(chars.size());
  if (!chars.empty()) std::memcpy(bytes.data(), chars.data(), chars.size());
  return bytes;
}

template <class T>
T load(std::span<const std::byte> bytes, std::size_t at) {
  T value{};
  std::memcpy(&value, bytes.data() + at, sizeof(T));
  return value;
}

/// Returns the UDP payloads of a little-endian Ethernet pcap without VLANs or IP options.
inline std::vector<std::vector<std::byte>> udp_payloads(const std::filesystem::path& pcap) {
  constexpr std::size_t kHeaders = 14 + 20 + 8;
  const std::vector<std::byte> file = read_file(pcap);
  std::vector<std::vector<std::byte>> payloads;
  for (std::size_t at = 24; at + 16 <= file.size();) {
    const std::size_t size = load<std::uint32_t>(file, at + 8);
    if (at + 16 + size > file.size()) break;
    if (size > kHeaders) {
      payloads.emplace_back(file.begin() + static_cast<std::ptrdiff_t>(at + 16 + kHeaders),
                            file.begin() + static_cast<std::ptrdiff_t>(at + 16 + size));
    }
    at += 16 + size;
  }
  return payloads;
}

/// Returns the NovAtel messages of a recording without errors, with their CRCs.
inline std::vector<std::vector<std::byte>> novatel_messages(std::span<const std::byte> file) {
  std::vector<std::vector<std::byte>> messages;
  for (std::size_t at = 0; at + 12 <= file.size();) {
    if (file[at] != std::byte{0xAA} || file[at + 1] != std::byte{0x44}) {
      ++at;
      continue;
    }
    const bool is_short = file[at + 2] == std::byte{0x13};
    const std::size_t header = is_short ? 12 : std::to_integer<std::size_t>(file[at + 3]);
    const std::size_t body =
        is_short ? std::to_integer<std::size_t>(file[at + 3]) : std::size_t{load<std::uint16_t>(file, at + 8)};
    const std::size_t size = header + body + 4;
    if (at + size > file.size()) break;
    messages.emplace_back(file.begin() + static_cast<std::ptrdiff_t>(at),
                          file.begin() + static_cast<std::ptrdiff_t>(at + size));
    at += size;
  }
  return messages;
}

}  // namespace hueline::sim::test
