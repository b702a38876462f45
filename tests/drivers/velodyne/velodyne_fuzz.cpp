// Any datagram, and runs of them: no crash, every byte counted once, and every return inside what the configuration
// allows.
#include <cmath>
#include <cstdlib>

#include "tests/drivers/velodyne/velodyne_packets.hpp"

namespace {

using namespace hueline;
using namespace hueline::drivers;

void require(bool holds) {
  if (!holds) std::abort();
}

void check(const LaserReturn& r, const VelodyneTable& table) {
  require(std::isfinite(r.x) && std::isfinite(r.y) && std::isfinite(r.z));
  require(r.range_m >= 0.499f && r.range_m <= static_cast<float>(65535.5 * table.range_step_m));
  require(r.azimuth >= 0 && r.azimuth < 6.2831855f);
  require(r.time_offset_ns >= 0 && r.time_offset_ns < 1'400'000);
  require(r.channel < table.count() && r.return_number >= 1 && r.return_number <= r.return_count);
}

void run(VelodyneModel model, std::span<const std::byte> input) {
  VelodyneDecoder::Config config;
  config.model = model;
  VelodyneDecoder decoder(config);
  std::vector<Measurement> out;
  std::uint64_t fed = 0;
  std::int64_t received = 0;
  const auto feed = [&](std::span<const std::byte> datagram) {
    decoder.decode(test::packet_of(datagram, received), out);
    fed += datagram.size();
    received += 700'000;
  };
  feed(input);
  // The same bytes as many packets, so that the state between packets meets any two neighbours.
  for (const std::size_t size : {kVelodyneDataBytes, kVelodynePositionBytes})
    for (std::size_t at = 0; at + size <= input.size() && at < 8 * size; at += size) feed(input.subspan(at, size));
  decoder.flush(out);  // what is held until the timing has spoken is in the counts from here on
  for (const Measurement& m : out)
    if (const auto* batch = std::get_if<LaserBatch>(&m)) {
      require(std::get<LaserCounter>(batch->time).value < std::chrono::hours(1));
      for (const LaserReturn& r : batch->returns) check(r, velodyne_table(model));
    }
  const DecodeCounts& c = decoder.counts();
  require(c.decoded_bytes + c.ignored_bytes + c.malformed_bytes == fed);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span<const std::byte> input = std::as_bytes(std::span(data, size));
  for (const VelodyneModel model : kVelodyneModels) run(model, input);
  return 0;
}
