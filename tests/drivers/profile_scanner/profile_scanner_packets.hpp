#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/packet.hpp"
#include "drivers/profile_scanner/profile_scanner_decoder.hpp"
#include "tests/support/pcap_writer.hpp"

/// Datagrams of a profile scanner for tests, written by hand from docs/formats.md.
namespace hueline::test {

struct ProfileShot {
  std::uint32_t range = 0;      ///< 0.1 mm
  unsigned reflectance = 5000;  ///< 0.01 %
};

struct ProfileDatagram {
  std::uint32_t magic = 0x31465250;
  unsigned version = 1, kind = 1, scanner = 7;
  std::uint32_t counter = 0;
  std::optional<unsigned> length;  ///< what the header says; empty: the truth
  unsigned scale = 0;
  std::uint32_t second = 1'440'000'000, nanosecond = 0;
  std::uint32_t line = 3, angle = 0;
  std::int32_t step = 0;
  std::uint32_t period_ps = 1'000'000;
  std::optional<unsigned> returns;  ///< what the header says; empty: the truth
  std::vector<std::vector<ProfileShot>> pulses;

  unsigned pps = 2, flags = 3;
  std::uint32_t edge_second = 1'440'000'000;

  Bytes bytes() const {
    ByteWriter body(false);
    if (kind == 2) {
      body.u8(pps).u8(flags).u16(0).u32(edge_second);
    } else {
      unsigned count = 0;
      for (const auto& pulse : pulses) count += static_cast<unsigned>(pulse.size());
      body.u32(line).u32(angle).u32(static_cast<std::uint32_t>(step)).u32(period_ps);
      body.u16(static_cast<unsigned>(pulses.size())).u16(returns.value_or(count));
      for (const auto& pulse : pulses) body.u8(static_cast<unsigned>(pulse.size()));
      for (const auto& pulse : pulses)
        for (const ProfileShot& shot : pulse) body.u32(shot.range).u16(shot.reflectance);
    }
    ByteWriter out(false);
    out.u32(magic).u8(version).u8(kind).u16(scanner).u32(counter);
    out.u16(length.value_or(static_cast<unsigned>(24 + body.size()))).u8(scale).u8(0).u32(second).u32(nanosecond);
    return out.raw(body.bytes()).bytes();
  }
};

inline ProfileDatagram profile_status(std::uint32_t counter) {
  ProfileDatagram out;
  out.kind = 2;
  out.counter = counter;
  out.nanosecond = 200'000'000;
  return out;
}

inline Packet profile_packet(std::span<const std::byte> bytes, std::int64_t received_ns = 0) {
  Packet packet;
  packet.sensor = 5;
  packet.received = host_time_ns(received_ns);
  packet.bytes = Buffer::copy_of(bytes);
  return packet;
}

/// What a decoder has made of the datagrams so far.
struct ProfileDecoded {
  explicit ProfileDecoded(const drivers::ProfileScannerDecoder::Config& config = {}) : decoder(config) {}
  void feed(std::span<const std::byte> bytes, std::int64_t received_ns = 0) {
    decoder.decode(profile_packet(bytes, received_ns), out);
    fed += bytes.size();
  }
  void feed(const ProfileDatagram& datagram, std::int64_t received_ns = 0) { feed(datagram.bytes(), received_ns); }
  template <class T>
  std::vector<T> all() const {
    std::vector<T> found;
    for (const Measurement& m : out)
      if (const T* value = std::get_if<T>(&m)) found.push_back(*value);
    return found;
  }
  /// Returns each fault as "Kind count: detail".
  std::vector<std::string> faults() const {
    std::vector<std::string> found;
    for (const Fault& f : all<Fault>())
      found.push_back(std::string(name(f.kind)) + " " + std::to_string(f.count) + ": " + f.detail);
    return found;
  }
  bool is_every_byte_counted() const {
    const DecodeCounts& c = decoder.counts();
    return c.decoded_bytes + c.ignored_bytes + c.malformed_bytes == fed;
  }

  drivers::ProfileScannerDecoder decoder;
  std::vector<Measurement> out;
  std::uint64_t fed = 0;
};

}  // namespace hueline::test
