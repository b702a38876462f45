// Any datagram, bare and behind good headers: no crash, every byte counted once, and finite returns.
#include <cmath>
#include <cstdlib>

#include "drivers/livox/livox_decoder.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hueline;
  using namespace hueline::drivers;
  LivoxDecoder decoder({});
  std::vector<Measurement> out;
  std::uint64_t fed = 0;
  const auto feed = [&](std::span<const std::byte> datagram) {
    Packet packet;
    packet.received = HostTime(nanoseconds(static_cast<std::int64_t>(fed)));
    packet.bytes = Buffer::copy_of(datagram);
    decoder.decode(packet, out);
    fed += datagram.size();
  };
  const auto input = std::as_bytes(std::span(data, size));
  feed(input);
  const auto filled = [&](std::size_t bytes) {
    std::vector<std::byte> packet(bytes);
    for (std::size_t i = 0; i < bytes && !input.empty(); ++i) packet[i] = input[i % input.size()];
    return packet;
  };
  constexpr std::size_t kSizes[] = {1318, 918, 1362, 978, 1362, 786, 42, 1278, 678};
  for (std::size_t type = 0; type < std::size(kSizes); ++type) {
    auto packet = filled(kSizes[type]);
    packet[0] = std::byte{5};
    packet[9] = static_cast<std::byte>(type);
    feed(packet);
  }
  for (const auto& [type, bytes] : {std::pair<int, int>{0, 24}, {1, 14}, {2, 8}, {3, 10}, {0x11, 28}}) {
    auto packet = filled(static_cast<std::size_t>(36 + 40 * bytes));
    packet[0] = std::byte{0};
    packet[1] = static_cast<std::byte>(packet.size() & 0xFF);
    packet[2] = static_cast<std::byte>(packet.size() >> 8);
    packet[5] = std::byte{40};
    packet[6] = std::byte{0};
    packet[10] = static_cast<std::byte>(type);
    feed(packet);
  }
  decoder.flush(out);
  for (const Measurement& m : out)
    if (const auto* batch = std::get_if<LaserBatch>(&m))
      for (const LaserReturn& r : batch->returns)
        if (!std::isfinite(r.x) || !std::isfinite(r.y) || !std::isfinite(r.z) || r.azimuth < 0 ||
            r.time_offset_ns < 0 || r.return_number < 1 || r.return_number > r.return_count)
          std::abort();
  const DecodeCounts& c = decoder.counts();
  if (c.decoded_bytes + c.ignored_bytes + c.malformed_bytes != fed) std::abort();
  return 0;
}
