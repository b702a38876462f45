#pragma once

#include <cstdint>
#include <cstring>
#include <map>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.hpp"

/// Reads what is in a capture file a second time, by other means than the drivers do, for comparison.
namespace hueline::test {

template <class T>
T little(const std::string& bytes, std::size_t at) {
  T value{};
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

struct Datagram {
  double time_s = 0;  ///< since the first frame of the capture
  std::string payload;
};

/// Reads classic little-endian pcap files of Ethernet frames with IPv4 without fragments, which captures of a Velodyne
/// are. Stops at the first record that is not whole.
inline std::vector<Datagram> datagrams_of(const std::filesystem::path& path) {
  const std::string file = contents(path);
  std::vector<Datagram> out;
  if (file.size() < 24) return out;
  const double tick = little<std::uint32_t>(file, 0) == 0xA1B23C4D ? 1e-9 : 1e-6;
  double first = -1;
  for (std::size_t at = 24; at + 16 <= file.size();) {
    const double time = little<std::uint32_t>(file, at) + tick * little<std::uint32_t>(file, at + 4);
    const std::size_t size = little<std::uint32_t>(file, at + 8), frame = at + 16;
    at = frame + size;
    if (at > file.size()) break;
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(file[frame + i]); };
    if (byte(12) != 8 || byte(13) != 0 || byte(23) != 17) continue;
    const std::size_t udp = 14 + 4u * (byte(14) & 15u),
                      length = static_cast<std::size_t>(byte(udp + 4)) << 8 | byte(udp + 5);
    if (first < 0) first = time;
    out.push_back({time - first, file.substr(frame + udp + 8, length - 8)});
  }
  return out;
}

struct Oem7Message {
  /// Since the first message, by the GPS times of the headers; steps that no stream has (INSCONFIG names the time of
  /// its setting) are left out.
  double time_s = 0;
  unsigned id = 0;  ///< 0: bytes between two messages
  std::string bytes;
};

/// Follows the lengths in the headers from sync to sync. It does not check CRCs.
inline std::vector<Oem7Message> oem7_messages_of(const std::string& file) {
  std::vector<Oem7Message> out;
  double now = 0, last = 0;
  for (std::size_t at = 0; at < file.size();) {
    const bool is_long = file.compare(at, 3, "\xAA\x44\x12") == 0, is_short = file.compare(at, 3, "\xAA\x44\x13") == 0;
    const std::size_t header = is_long ? 28 : 12;
    if ((is_long || is_short) && at + header <= file.size()) {
      const std::size_t length = is_long ? little<std::uint16_t>(file, at + 8) : little<std::uint8_t>(file, at + 3);
      const double time = little<std::uint32_t>(file, at + (is_long ? 16 : 8)) * 1e-3;
      if (time > last && time < last + 2) now += time - last;
      last = time;
      out.push_back({now, little<std::uint16_t>(file, at + 4), file.substr(at, header + length + 4)});
      at += header + length + 4;
      continue;
    }
    if (out.empty() || out.back().id != 0) out.push_back({now, 0, {}});
    out.back().bytes += file[at++];
  }
  return out;
}

/// Counts the messages of the recordings by the names that the manual gives their numbers (OEM7 Commands and Logs
/// Reference, SPAN logs).
inline std::map<std::string, std::uint64_t> counted_by_name(const std::vector<Oem7Message>& messages) {
  const std::map<unsigned, std::string> names{
      {42, "BESTPOS"},      {93, "RXSTATUS"},     {99, "BESTVEL"},    {101, "TIME"},       {507, "INSPVA"},
      {508, "INSPVAS"},     {726, "BESTUTM"},     {1163, "PSRDOP2"},  {1335, "HEADING2"},  {1362, "IMURATECORRIMUS"},
      {1465, "INSPVAX"},    {1945, "INSCONFIG"},  {2051, "INSSTDEV"}, {2052, "INSSTDEVS"}, {2264, "CORRIMUS"},
      {812, "CORRIMUDATA"}, {813, "CORRIMUDATAS"}};
  std::map<std::string, std::uint64_t> out;
  for (const auto& message : messages) {
    if (message.id == 0) continue;
    const auto known = names.find(message.id);
    ++out[known == names.end() ? std::to_string(message.id) : known->second];
  }
  return out;
}

}  // namespace hueline::test
