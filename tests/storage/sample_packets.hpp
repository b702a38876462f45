#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/packet.hpp"
#include "storage/journal_header.hpp"

namespace hueline::test {

/// Returns a header with three sensors, two texts and some notes.
inline storage::JournalHeader sample_header() {
  return {{{"hueline", "system"}, {"laser_front", "velodyne_vlp16"}, {"head", "gige_camera"}, {"pos", "novatel_oem7"}},
          {{"rig.yaml", "application/yaml", "name: van\nsensors: []\n"},
           {"head.yaml", "application/yaml", std::string(1, '\0')}},
          {{"program_version", "0.1.0"}, {"git_revision", "0123abc"}}};
}

inline Buffer pattern_buffer(std::size_t size, std::uint32_t seed) {
  std::vector<std::byte> bytes(size);
  for (auto& b : bytes) b = static_cast<std::byte>((seed = seed * 1664525u + 1013904223u) >> 24);
  return Buffer::copy_of(bytes);
}

/// Returns `count` packets of every kind and size: empty, small, larger than what is copied, and an image now and then.
/// Their sequences have gaps, and the arrival stamps of different sensors overlap.
inline std::vector<Packet> sample_packets(int count, std::size_t image_bytes = 20000) {
  std::vector<Packet> packets;
  for (int i = 0; i < count; ++i) {
    Packet p;
    const auto n = static_cast<std::uint32_t>(i);
    p.sensor = static_cast<SensorId>(1 + i % 3);
    p.sequence = n + n / 7 + (i > 3 ? 0x100000000ull : 0);
    p.received = host_time_ns(1'000'000'000ll + i * 700'000ll - (i % 3) * 1'000'000ll);
    p.shed = i % 11 == 5;
    if (i % 13 == 0) {
      p.kind = PacketKind::Tick;
      p.sensor = kSystemSensor;
    } else if (i % 17 == 4) {
      p.kind = PacketKind::Fault;
      p.bytes = Buffer::copy_of(encode_fault({p.sensor, FaultKind::Overflow, p.received, 3, "pool full"}));
    } else {
      p.bytes = pattern_buffer(p.sensor == 2 ? image_bytes : p.sensor == 1 ? 1206 : n % 90, n);
    }
    packets.push_back(p);
  }
  return packets;
}

/// Returns the time for JournalWriter of a recorder whose clock runs with the packets.
inline nanoseconds time_of(const Packet& packet) { return packet.received.time_since_epoch(); }

inline bool same(const Packet& a, const Packet& b) {
  return a.sensor == b.sensor && a.kind == b.kind && a.shed == b.shed && a.sequence == b.sequence &&
         a.received == b.received && a.bytes.size() == b.bytes.size() &&
         std::equal(a.bytes.bytes().begin(), a.bytes.bytes().end(), b.bytes.bytes().begin());
}

}  // namespace hueline::test
