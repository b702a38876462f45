#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <span>
#include <vector>

#include "drivers/ladybug/ladybug_decoder.hpp"
#include "drivers/ladybug/pgr_source.hpp"
#include "tests/drivers/ladybug/pgr_writer.hpp"

// The input is damage to a stream file of two small images without planes. The source must end, never give more bytes
// than the file has, and the decoder must count every byte once.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hueline;
  const auto image = [](std::uint8_t sequence) {
    std::vector<std::byte> bytes(0x420);
    const auto set = [&](std::size_t at, std::initializer_list<int> values) {
      for (const int value : values) bytes[at++] = static_cast<std::byte>(value);
    };
    set(0x08, {0, 0, 4, 0x20});
    set(0x10, {0xCA, 0xFE, 0xBA, 0xBE, 0, 0, 0, 2});
    bytes[0x23] = static_cast<std::byte>(sequence);
    return bytes;
  };
  test::PgrStream stream;
  stream.images = {image(1), image(2)};
  stream.gps_summary = "GPSSUMMARY_00001";
  auto file = test::write_pgr(stream);
  for (std::size_t i = 0; i + 3 <= size; i += 3)
    file[(data[i] * 256u + data[i + 1]) % file.size()] = static_cast<std::byte>(data[i + 2]);
  if (size % 3 == 1) file.resize(file.size() * data[size - 1] / 256);
  static const auto path =
      std::filesystem::temp_directory_path() / ("hueline-pgr-fuzz-" + std::to_string(::getpid()) + ".pgr");
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(file.data()), static_cast<std::streamsize>(file.size()));
  drivers::PgrSource source({path.string()});
  drivers::LadybugDecoder::Config config{.width = 96, .height = 64, .stamp = drivers::LadybugDecoder::Stamp::Utc};
  config.planes.lens_columns = 3;
  drivers::LadybugDecoder decoder(config);
  if (source.open().ok()) {
    std::size_t bytes = 0, calls = 0;
    std::vector<Measurement> out;
    while (true) {
      if (++calls > 1000) std::abort();
      const auto packet = source.next({});
      if (!packet && packet.error().code == ErrorCode::Truncated) continue;
      if (!packet) break;
      if (packet->kind == PacketKind::Fault) continue;
      bytes += packet->bytes.size();
      decoder.decode(*packet, out);
    }
    const auto& counts = decoder.counts();
    if (counts.decoded_bytes + counts.ignored_bytes + counts.malformed_bytes != bytes) std::abort();
    if (bytes > 2 * file.size()) std::abort();  // the summary may be said to lie in the head
  }
  std::filesystem::remove(path);
  return 0;
}
