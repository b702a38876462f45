#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/packet.hpp"
#include "drivers/transport/pcap_source.hpp"
#include "drivers/velodyne/velodyne_decoder.hpp"
#include "tests/support/pcap_writer.hpp"

/// Velodyne packets for tests, made by hand from the manual's tables or taken from a real capture.
namespace hueline::test {

struct VelodyneShot {
  unsigned distance = 0;  ///< 2 mm
  unsigned reflectivity = 0;
};

struct VelodyneBlock {
  unsigned azimuth = 0;  ///< 0.01 deg
  std::array<VelodyneShot, 32> shots{};
  unsigned flag = 0xEEFF;
};

using VelodyneBlocksOfPacket = std::array<VelodyneBlock, 12>;

inline Bytes velodyne_data(const VelodyneBlocksOfPacket& blocks, std::uint32_t stamp_us, unsigned mode,
                           unsigned product) {
  ByteWriter out(false);
  for (const VelodyneBlock& block : blocks) {
    out.u16(block.flag).u16(block.azimuth);
    for (const VelodyneShot& shot : block.shots) out.u16(shot.distance).u8(shot.reflectivity);
  }
  return out.u32(stamp_us).u8(mode).u8(product).bytes();
}

inline Bytes velodyne_position(std::uint32_t stamp_us, unsigned pps, const std::string& nmea) {
  ByteWriter out(false);
  out.zeros(198).u32(stamp_us).u8(pps).zeros(3).text(nmea);
  out.zeros(512 - out.size());
  return out.bytes();
}

/// Returns "$...*hh\r\n" with the body in it.
inline std::string nmea_sentence(const std::string& body) {
  unsigned sum = 0;
  for (const char c : body) sum ^= static_cast<unsigned char>(c);
  constexpr char hex[] = "0123456789ABCDEF";
  return "$" + body + "*" + hex[sum / 16] + hex[sum % 16] + "\r\n";
}

inline Packet packet_of(std::span<const std::byte> bytes, std::int64_t received_ns = 0) {
  Packet packet;
  packet.sensor = 5;
  packet.received = host_time_ns(received_ns);
  packet.bytes = Buffer::copy_of(bytes);
  return packet;
}

inline std::vector<Packet> capture_packets(const std::string& path) {
  drivers::PcapSource source({path, {}, {}});
  std::vector<Packet> packets;
  if (!source.open().ok()) return packets;
  for (Result<Packet> p = source.next({}); p.ok(); p = source.next({})) {
    p->sequence = packets.size();
    packets.push_back(std::move(p).value());
  }
  return packets;
}

template <class T>
std::vector<T> only(const std::vector<Measurement>& measurements) {
  std::vector<T> found;
  for (const Measurement& m : measurements)
    if (const T* value = std::get_if<T>(&m)) found.push_back(*value);
  return found;
}

/// Returns the scanner's counter in a stamp. Throws if the stamp has none.
inline nanoseconds counter(const LaserTime& stamp) { return std::get<LaserCounter>(stamp).value; }

/// Makes a packet with every return at 10 m and reflectivity 100, whose azimuth rises by `step` from block to block (or
/// pair to pair).
inline VelodyneBlocksOfPacket turning(unsigned first, unsigned step, bool is_dual = false) {
  VelodyneBlocksOfPacket blocks;
  for (unsigned b = 0; b < 12; ++b) {
    blocks[b].azimuth = (first + step * (is_dual ? b / 2 : b)) % 36000;
    blocks[b].shots.fill({5000, 100});
  }
  return blocks;
}

struct Decoded {
  std::vector<LaserBatch> batches;
  std::vector<Fault> faults;
};
inline Decoded decode(drivers::VelodyneDecoder& decoder, std::span<const std::byte> bytes,
                      std::int64_t received_ns = 0) {
  std::vector<Measurement> out;
  decoder.decode(packet_of(bytes, received_ns), out);
  return {only<LaserBatch>(out), only<Fault>(out)};
}

}  // namespace hueline::test
