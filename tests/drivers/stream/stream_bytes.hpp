#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/decoder.hpp"

/// What the tests of decoders of byte streams share. The messages are put together here, byte by byte, and share no
/// code with the decoders.
namespace hueline::test {

using Bytes = std::vector<std::uint8_t>;

/// A message that grows by its fields, little endian.
struct Fields {
  Bytes bytes;
  template <class T>
  Fields& put(T value) {
    const auto* raw = reinterpret_cast<const std::uint8_t*>(&value);
    bytes.insert(bytes.end(), raw, raw + sizeof(T));
    return *this;
  }
  Fields& zeros(std::size_t count) {
    bytes.resize(bytes.size() + count);
    return *this;
  }
};

inline Bytes operator+(Bytes a, const Bytes& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}
inline Bytes bytes_of(const std::string& text) { return {text.begin(), text.end()}; }

/// Puts the check sum of a NMEA sentence behind its text: "GPZDA,..." becomes "$GPZDA,...*hh\r\n".
inline Bytes nmea(const std::string& text) {
  constexpr char kHex[] = "0123456789ABCDEF";
  std::uint8_t sum = 0;
  for (const char c : text) sum = static_cast<std::uint8_t>(sum ^ static_cast<std::uint8_t>(c));
  return bytes_of("$" + text + "*" + kHex[sum >> 4] + kHex[sum & 15] + "\r\n");
}

/// What came out of a decoder.
struct Heard {
  std::vector<Measurement> measurements;
  DecodeCounts counts;
  template <class T>
  std::vector<T> all() const {
    std::vector<T> out;
    for (const Measurement& m : measurements)
      if (const T* one = std::get_if<T>(&m)) out.push_back(*one);
    return out;
  }
  std::vector<FaultKind> faults() const {
    std::vector<FaultKind> out;
    for (const Fault& fault : all<Fault>()) out.push_back(fault.kind);
    return out;
  }
  std::uint64_t bytes() const { return counts.decoded_bytes + counts.ignored_bytes + counts.malformed_bytes; }
};

/// Decodes `bytes` in packets of `chunk` bytes, which come every millisecond.
inline Heard hear(Decoder& decoder, std::span<const std::uint8_t> bytes, std::size_t chunk = 4096) {
  Heard out;
  std::int64_t ms = 0;
  for (std::size_t at = 0; at < bytes.size(); at += chunk) {
    Packet packet;
    packet.sensor = 7;
    packet.received = host_time_ns(++ms * 1'000'000);
    packet.bytes = Buffer::copy_of(std::as_bytes(bytes.subspan(at, std::min(chunk, bytes.size() - at))));
    decoder.decode(packet, out.measurements);
  }
  decoder.flush(out.measurements);
  out.counts = decoder.counts();
  return out;
}

}  // namespace hueline::test
