// Any datagram, bare and behind good headers: no crash, every byte counted once, and finite returns.
#include <cmath>
#include <cstdlib>

#include "drivers/robosense/robosense_decoder.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hueline;
  using namespace hueline::drivers;
  const auto input = std::as_bytes(std::span(data, size));
  std::vector<std::byte> filled(kRobosenseBytes);
  for (std::size_t i = 0; i < filled.size() && !input.empty(); ++i) filled[i] = input[i % input.size()];
  constexpr unsigned kPoints[] = {0x55, 0xAA, 0x05, 0x0A, 0x5A, 0xA5, 0x50, 0xA0};
  constexpr unsigned kDescription[] = {0xA5, 0xFF, 0x00, 0x5A, 0x11, 0x11, 0x55, 0x55};
  for (unsigned model = 0; model < 7; ++model) {
    RobosenseDecoder decoder({});
    std::vector<Measurement> out;
    std::uint64_t fed = 0;
    const auto feed = [&](std::span<const std::byte> datagram) {
      Packet packet;
      packet.received = HostTime(nanoseconds(static_cast<std::int64_t>(fed)));
      packet.bytes = Buffer::copy_of(datagram);
      decoder.decode(packet, out);
      fed += datagram.size();
    };
    feed(input);
    if (model > 4) {  // M1 and E1
      auto solid = filled;
      solid.resize(model == 5 ? 1210 : 1200);
      constexpr unsigned kSolid[] = {0x55, 0xAA, 0x5A, 0xA5};
      for (std::size_t i = 0; i < 4; ++i) solid[i] = static_cast<std::byte>(kSolid[i]);
      for (std::size_t i = 10; i < 20; ++i) solid[i] = std::byte{0};
      feed(solid);
    }
    auto points = filled, description = filled;
    for (std::size_t i = 0; i < 8; ++i) {
      points[i] = static_cast<std::byte>(kPoints[i]);
      description[i] = static_cast<std::byte>(kDescription[i]);
    }
    if (model == 4) points[3] = std::byte{0x5A};  // Helios
    points[31] = static_cast<std::byte>(model == 3 ? 3 : model + 1);
    points[32] = static_cast<std::byte>(model == 3 ? 4 : 0);
    for (std::size_t i = 20; i < 30; ++i) points[i] = std::byte{1};  // a time
    for (std::size_t block = 0; block < 12; ++block) {
      points[42 + 100 * block] = std::byte{0xFF};
      points[43 + 100 * block] = std::byte{0xEE};
      points[44 + 100 * block] &= std::byte{0x7F};
    }
    feed(points);
    feed(description);
    for (std::size_t beam = 0; beam < 64; ++beam) {  // angles that can be
      description[468 + 3 * beam] &= std::byte{1};
      description[469 + 3 * beam] &= std::byte{0x1F};
    }
    for (std::size_t beam = 0; beam < 16; ++beam) description[1165 + 3 * beam] &= std::byte{7};
    for (const unsigned returns : {0u, 1u}) {
      description[300] = static_cast<std::byte>(returns);
      feed(description);
      points[29] = static_cast<std::byte>(2 + returns);
      feed(points);
    }
    decoder.flush(out);
    for (const Measurement& m : out)
      if (const auto* batch = std::get_if<LaserBatch>(&m))
        for (const LaserReturn& r : batch->returns)
          if (!std::isfinite(r.x) || !std::isfinite(r.y) || !std::isfinite(r.z) || r.azimuth < 0 || r.channel > 31 ||
              r.time_offset_ns < 0 || r.return_number < 1 || r.return_number > r.return_count)
            std::abort();
    const DecodeCounts& c = decoder.counts();
    if (c.decoded_bytes + c.ignored_bytes + c.malformed_bytes != fed) std::abort();
  }
  return 0;
}
