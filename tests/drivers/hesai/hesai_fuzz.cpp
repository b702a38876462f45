// Any datagram, with each model: no crash, every byte counted once, and every return inside what the packet can say.
#include <cmath>
#include <cstdlib>

#include "drivers/hesai/hesai_decoder.hpp"

namespace {

using namespace hueline;
using namespace hueline::drivers;

void require(bool holds) {
  if (!holds) std::abort();
}

void run(const HesaiTable& table, std::span<const std::byte> input) {
  HesaiDecoder::Config config;
  config.model = table.model;
  HesaiDecoder decoder(config);
  std::vector<Measurement> out;
  std::uint64_t fed = 0;
  const auto feed = [&](std::span<const std::byte> datagram) {
    Packet packet;
    packet.received = host_time_ns(static_cast<std::int64_t>(fed));
    packet.bytes = Buffer::copy_of(datagram);
    decoder.decode(packet, out);
    fed += datagram.size();
  };
  feed(input);
  // The same bytes behind a good header, so that the fields behind it are met too.
  std::vector<std::byte> packet(table.least_bytes());
  for (std::size_t i = 0; i < packet.size() && !input.empty(); ++i) packet[i] = input[i % input.size()];
  if (table.head > 0) {
    packet[0] = std::byte{0xEE};
    packet[1] = std::byte{0xFF};
    if (table.head == 12) packet[4] = static_cast<std::byte>(table.least_status);
    const std::size_t at = table.head == 8 ? 2 : 6;
    packet[at] = static_cast<std::byte>(table.channels());
    packet[at + 1] = static_cast<std::byte>(table.blocks);
    packet[table.head == 8 ? 5 : 9] = std::byte{4};
  } else {
    for (std::size_t b = 0; b < static_cast<std::size_t>(table.blocks); ++b) {
      packet[b * table.block_bytes()] = std::byte{0xFF};
      packet[b * table.block_bytes() + 1] = std::byte{0xEE};
    }
  }
  feed(packet);
  for (const std::byte mode : {std::byte{0x37}, std::byte{0x39}, std::byte{0x3D}}) {
    packet[table.tail_at() + table.tail.mode] = mode;
    feed(packet);
  }
  decoder.flush(out);
  for (const Measurement& m : out)
    if (const auto* batch = std::get_if<LaserBatch>(&m))
      for (const LaserReturn& r : batch->returns) {
        require(std::isfinite(r.x) && std::isfinite(r.y) && std::isfinite(r.z));
        require(r.range_m >= 0 && r.azimuth >= 0 && r.azimuth < 6.2831855f && r.time_offset_ns >= 0);
        require(r.channel < table.channels() && r.return_number >= 1 && r.return_number <= r.return_count);
      }
  const DecodeCounts& c = decoder.counts();
  require(c.decoded_bytes + c.ignored_bytes + c.malformed_bytes == fed);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  for (const HesaiTable& table : hesai_tables()) run(table, std::as_bytes(std::span(data, size)));
  return 0;
}
