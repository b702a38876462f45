// Any datagram, and runs of them: no crash, every byte counted once, and every return inside what the configuration
// allows.
#include <cmath>
#include <cstdlib>
#include <cstring>

#include "tests/drivers/profile_scanner/profile_scanner_packets.hpp"

namespace {

using namespace hueline;

void require(bool holds) {
  if (!holds) std::abort();
}

void check(const LaserReturn& r) {
  require(std::isfinite(r.x) && std::isfinite(r.y) && r.z == 0);
  require(r.range_m >= 0.9999f && r.range_m <= 1000.001f);
  require(std::abs(std::hypot(r.x, r.y) - r.range_m) <= 1e-3f);
  require(r.azimuth >= 0 && r.azimuth < 6.2831855f);
  require(r.time_offset_ns >= 0 && r.time_offset_ns < 1'000'000'000);
  require(r.channel == 0 && r.return_number >= 1 && r.return_number <= r.return_count && r.return_count <= 15);
}

/// Puts a sound header before any bytes, so that mutations reach what follows the first checks.
std::vector<std::byte> behind_a_head(std::span<const std::byte> input, std::uint32_t counter, bool is_status) {
  test::ProfileDatagram head;
  head.kind = is_status ? 2 : 1;
  head.counter = counter;
  std::vector<std::byte> out = head.bytes();
  out.resize(24);
  out.insert(out.end(), input.begin(), input.end());
  const auto length = static_cast<std::uint16_t>(out.size());
  std::memcpy(out.data() + 12, &length, 2);
  if (is_status || out.size() < 44) return out;
  // As many returns as fill the rest, after a table whose pulses have as many.
  const std::size_t pulses = (out.size() - 44) / 7;
  const auto n = static_cast<std::uint16_t>(pulses);
  std::memcpy(out.data() + 40, &n, 2);
  std::memcpy(out.data() + 42, &n, 2);
  for (std::size_t i = 0; i < pulses; ++i) out[44 + i] = std::byte{1};
  return out;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span<const std::byte> input = std::as_bytes(std::span(data, size));
  test::ProfileDecoded decoded;
  std::int64_t received = 0;
  const auto feed = [&](std::span<const std::byte> datagram) { decoded.feed(datagram, received += 300'000'000); };
  feed(input);
  std::uint32_t counter = 0;
  for (const std::size_t most : {std::size_t{8}, std::size_t{300}, std::size_t{1448}, std::size_t{60000}}) {
    const auto piece = input.first(std::min(most, input.size()));
    feed(behind_a_head(piece, counter++, false));
    feed(behind_a_head(piece, counter += static_cast<std::uint32_t>(size % 3), true));
  }
  decoded.decoder.flush(decoded.out);
  require(decoded.is_every_byte_counted());
  for (const Measurement& m : decoded.out)
    if (const auto* batch = std::get_if<LaserBatch>(&m)) {
      if (const auto* stamp = std::get_if<LaserCounter>(&batch->time))
        require(stamp->value >= nanoseconds(0) && stamp->value < stamp->period);
      for (const LaserReturn& r : batch->returns) check(r);
    }
  return 0;
}
