// Any datagram and any metadata: no crash, every byte counted once, and every return inside what the packet can say.
#include <cmath>
#include <cstdlib>

#include "drivers/ouster/ouster_decoder.hpp"
#include "tests/drivers/ouster/ouster_packets.hpp"

namespace {

using namespace hueline;
using namespace hueline::drivers;

void require(bool holds) {
  if (!holds) std::abort();
}

class Feed {
 public:
  explicit Feed(OusterDecoder::Scale scale) : decoder_(config(scale)) {}
  void operator()(std::span<const std::byte> datagram) {
    Packet packet;
    packet.received = host_time_ns(static_cast<std::int64_t>(fed_));
    packet.bytes = Buffer::copy_of(datagram);
    decoder_.decode(packet, out_);
    fed_ += datagram.size();
  }
  void check() {
    decoder_.flush(out_);
    for (const Measurement& m : out_)
      if (const auto* batch = std::get_if<LaserBatch>(&m))
        for (const LaserReturn& r : batch->returns) {
          require(std::isfinite(r.x) && std::isfinite(r.y) && std::isfinite(r.z));
          require(r.range_m >= 0.05f && r.azimuth >= 0 && r.azimuth < 6.2831855f);
          require(r.time_offset_ns >= 0 && r.time_offset_ns <= 1'000'000'000);
          require(r.channel < 128 && r.return_number >= 1 && r.return_number <= r.return_count && r.return_count <= 2);
        }
    const DecodeCounts& c = decoder_.counts();
    require(c.decoded_bytes + c.ignored_bytes + c.malformed_bytes == fed_);
  }

 private:
  static OusterDecoder::Config config(OusterDecoder::Scale scale) {
    OusterDecoder::Config out;
    out.scale = scale;
    return out;
  }
  OusterDecoder decoder_;
  std::vector<Measurement> out_;
  std::uint64_t fed_ = 0;
};

/// Returns the text with some of its bytes replaced by those of the input.
std::string broken(std::string text, std::span<const std::byte> input) {
  for (std::size_t i = 0; i + 2 < input.size() && i < 24; i += 3) {
    const auto at = (static_cast<std::size_t>(input[i]) | static_cast<std::size_t>(input[i + 1]) << 8U) % text.size();
    text[at] = static_cast<char>(input[i + 2]);
  }
  return text;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto input = std::as_bytes(std::span(data, size));
  const struct {
    const char* profile;
    bool is_legacy, is_fusa;
    std::size_t pixel;
  } kinds[] = {{"LEGACY", true, false, 12},
               {"RNG15_RFL8_NIR8", false, false, 4},
               {"RNG19_RFL8_SIG16_NIR16_DUAL", false, false, 16},
               {"FUSA_RNG15_RFL8_NIR8_DUAL", false, true, 8}};
  for (const auto& kind : kinds)
    for (const auto scale : {OusterDecoder::Scale::Told, OusterDecoder::Scale::Tai}) {
      Feed feed(scale);
      feed(input);
      test::OusterText text;
      text.profile = kind.profile;
      text.header = kind.is_fusa ? "FUSA" : "STANDARD";
      const std::string metadata = test::ouster_metadata(text);
      feed(std::as_bytes(std::span(metadata)));
      feed(input);
      test::OusterPacket good;
      good.is_legacy = kind.is_legacy;
      good.is_fusa = kind.is_fusa;
      good.pixel.resize(kind.pixel);
      auto packet = test::ouster_bytes(good);
      feed(packet);
      // The input behind the first column's number, so that the fields behind are met too.
      const std::size_t head = kind.is_legacy ? 0 : 32;
      for (std::size_t i = head + 12; i < packet.size() && !input.empty(); ++i)
        if (i % 7 != 0) packet[i] = input[i % input.size()];
      feed(packet);
      // Numbers of columns and the rest of the header stay as they are.
      auto pixels = test::ouster_bytes(good);
      const std::size_t column = (pixels.size() - 2 * head) / 16, ahead = kind.is_legacy ? 16 : 12;
      for (std::size_t i = head; i < pixels.size() - head && !input.empty(); ++i)
        if (const std::size_t at = (i - head) % column; at >= ahead || at < 8) pixels[i] = input[i % input.size()];
      feed(pixels);
      const std::string other = broken(metadata, input);
      feed(std::as_bytes(std::span(other)));
      feed(pixels);
      feed.check();
    }
  return 0;
}
