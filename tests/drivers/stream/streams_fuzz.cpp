// Any bytes, cut anywhere, for each decoder of a byte stream: no crash, every byte counted, and the same measurements
// wherever the cut is.
#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "drivers/applanix/applanix_decoder.hpp"
#include "drivers/nmea/nmea_decoder.hpp"
#include "drivers/oxts/oxts_decoder.hpp"
#include "drivers/septentrio/septentrio_decoder.hpp"
#include "drivers/sick/sick_decoder.hpp"
#include "drivers/ublox/ublox_decoder.hpp"
#include "drivers/xsens/xsens_decoder.hpp"

using namespace hueline;

namespace {

void require(bool holds, const char* decoder, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "streams_fuzz: %s: %s\n", decoder, what);
  std::abort();
}

template <class Device>
void try_decoder(const char* name, std::span<const std::byte> all, std::size_t at) {
  const auto decode = [&](std::size_t cut) {
    Device decoder({});
    std::vector<Measurement> out;
    for (const auto part : {all.first(cut), all.subspan(cut)}) {
      Packet packet;
      packet.bytes = Buffer::copy_of(part);
      decoder.decode(packet, out);
    }
    decoder.flush(out);
    const DecodeCounts& counts = decoder.counts();
    require(counts.decoded_bytes + counts.ignored_bytes + counts.malformed_bytes == all.size(), name,
            "bytes do not add up");
    return std::pair(counts, out.size());
  };
  const auto whole = decode(0), cut = decode(at);
  require(whole.second == cut.second && whole.first.messages == cut.first.messages &&
              whole.first.malformed_bytes == cut.first.malformed_bytes &&
              whole.first.decoded_bytes == cut.first.decoded_bytes,
          name, "the place of a cut changed what was found");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto all = std::as_bytes(std::span(data, size));
  const std::size_t cut = size < 2 ? 0 : data[0] * size / 256;
  try_decoder<drivers::SickDecoder>("sick", all, cut);
  try_decoder<drivers::UbloxDecoder>("ublox", all, cut);
  try_decoder<drivers::NmeaDecoder>("nmea", all, cut);
  try_decoder<drivers::ApplanixDecoder>("applanix", all, cut);
  try_decoder<drivers::OxtsDecoder>("oxts", all, cut);
  try_decoder<drivers::SeptentrioDecoder>("septentrio", all, cut);
  try_decoder<drivers::XsensDecoder>("xsens", all, cut);
  return 0;
}
