#pragma once

#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/decoder.hpp"

/// Makes OEM7 messages byte by byte from the manual's tables, with a CRC that is computed bit by bit. It shares nothing
/// with what is tested.
namespace hueline::test {

using Bytes = std::vector<std::byte>;

inline std::uint32_t bitwise_crc(std::span<const std::byte> bytes) {
  std::uint32_t crc = 0;
  for (const std::byte byte : bytes) {
    crc ^= static_cast<std::uint32_t>(byte);
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1u) ? 0xEDB88320u : 0u);
  }
  return crc;
}

class Put {
 public:
  template <class T>
  Put& operator()(T value) {
    static_assert(std::is_trivially_copyable_v<T>);
    std::byte raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof(T));
    for (const std::byte b : raw) bytes.push_back(b);  // one by one: GCC 12 takes a range for an overflow
    return *this;
  }
  Put& u8(unsigned v) { return (*this)(static_cast<std::uint8_t>(v)); }
  Put& u16(unsigned v) { return (*this)(static_cast<std::uint16_t>(v)); }
  Put& u32(std::uint32_t v) { return (*this)(v); }
  Put& i32(std::int32_t v) { return (*this)(v); }
  Put& f32(double v) { return (*this)(static_cast<float>(v)); }
  Put& f64(double v) { return (*this)(v); }
  Put& text(std::string_view s) {
    for (const char c : s) u8(static_cast<unsigned char>(c));
    return *this;
  }
  Bytes bytes;
};

constexpr std::uint8_t kFineSteering = 180;

inline Bytes long_message(unsigned id, unsigned week, std::uint32_t milliseconds, const Bytes& body,
                          unsigned time_status = kFineSteering, unsigned type = 0) {
  Put p;
  p.u8(0xAA)
      .u8(0x44)
      .u8(0x12)
      .u8(28)
      .u16(id)
      .u8(type)
      .u8(0x20)
      .u16(static_cast<unsigned>(body.size()))
      .u16(0)
      .u8(90)
      .u8(time_status);
  p.u16(week).u32(milliseconds).u32(0x02000000).u16(0x5C46).u16(16809);
  p.bytes.insert(p.bytes.end(), body.begin(), body.end());
  p.u32(bitwise_crc(p.bytes));
  return p.bytes;
}

inline Bytes short_message(unsigned id, unsigned week, std::uint32_t milliseconds, const Bytes& body) {
  Put p;
  p.u8(0xAA).u8(0x44).u8(0x13).u8(static_cast<unsigned>(body.size())).u16(id).u16(week).u32(milliseconds);
  p.bytes.insert(p.bytes.end(), body.begin(), body.end());
  p.u32(bitwise_crc(p.bytes));
  return p.bytes;
}

/// In the units of the message: degrees, m, m/s.
struct Pva {
  unsigned week = 2300;
  double seconds = 100000.0;
  double latitude_deg = 0, longitude_deg = 0, height = 0;
  double north = 0, east = 0, up = 0;
  double roll_deg = 0, pitch_deg = 0, azimuth_deg = 0;
  std::uint32_t status = 3;
};

inline Bytes pva_body(const Pva& v) {
  Put p;
  p.u32(v.week).f64(v.seconds).f64(v.latitude_deg).f64(v.longitude_deg).f64(v.height);
  p.f64(v.north).f64(v.east).f64(v.up).f64(v.roll_deg).f64(v.pitch_deg).f64(v.azimuth_deg).u32(v.status);
  return p.bytes;
}
/// Returns 0 for what no header can say.
inline std::uint32_t milliseconds_of(double seconds) {
  return seconds >= 0 && seconds < 4e6 ? static_cast<std::uint32_t>(seconds * 1000.0) : 0;
}
inline Bytes inspvas(const Pva& v) { return short_message(508, v.week, milliseconds_of(v.seconds), pva_body(v)); }

inline Bytes mark_time(unsigned id, unsigned week, double seconds, double clock_offset = 0,
                       std::uint32_t clock_status = 0, unsigned time_status = kFineSteering) {
  Put p;
  p.u32(week).f64(seconds).f64(clock_offset).f64(1e-9).f64(-18.0).u32(clock_status);
  return long_message(id, week, milliseconds_of(seconds), p.bytes, time_status);
}

inline Bytes joined(std::initializer_list<Bytes> parts) {
  Bytes all;
  for (const Bytes& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}
inline Bytes text_bytes(std::string_view s) { return Put().text(s).bytes; }

inline Packet packet_of(std::span<const std::byte> bytes, HostTime received = host_time_ns(1'000'000)) {
  Packet packet;
  packet.sensor = 7;
  packet.received = received;
  packet.bytes = Buffer::copy_of(bytes);
  return packet;
}

inline Bytes read_all(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string text(std::istreambuf_iterator<char>(file), {});
  Bytes bytes(text.size());
  if (!text.empty()) std::memcpy(bytes.data(), text.data(), text.size());
  return bytes;
}

inline std::uint64_t total(const DecodeCounts& c) { return c.decoded_bytes + c.ignored_bytes + c.malformed_bytes; }

template <class T>
std::vector<T> all_of(const std::vector<Measurement>& measurements) {
  std::vector<T> found;
  for (const Measurement& m : measurements)
    if (const T* value = std::get_if<T>(&m)) found.push_back(*value);
  return found;
}

/// Returns as text everything in a measurement that must not depend on how the stream is cut.
std::string described(const Measurement& measurement);

}  // namespace hueline::test
