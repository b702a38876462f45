#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

/// Writes stream files of a Ladybug for tests. It shares no code with the reader.
namespace hueline::test {

/// What a stream file holds.
struct PgrStream {
  std::vector<std::vector<std::byte>> images;
  std::string configuration = "[Ladybug Stream]\n";
  std::string gps_summary;        ///< with its beginning "GPSSUMMARY_00001"; empty: there is none
  std::size_t padding = 0;        ///< zeros behind each image
  std::uint32_t said_images = 0;  ///< number of images that the head states; 0: the right one
};

inline std::vector<std::byte> write_pgr(const PgrStream& stream) {
  constexpr std::size_t kHead = 16, kHeadSize = 3056, kStep = 50;
  const auto text = [](const std::string& chars) {
    const auto bytes = std::as_bytes(std::span(chars));
    return std::vector<std::byte>(bytes.begin(), bytes.end());
  };
  std::vector<std::byte> out = text("PGRLADYBUGSTREAM");
  out.resize(kHead + kHeadSize);
  const auto set = [&](std::size_t at, std::size_t value) {
    for (std::size_t i = 0; i < 4; ++i) out[kHead + at + i] = static_cast<std::byte>(value >> (8 * i));
  };
  const auto configuration = text(stream.configuration);
  out.insert(out.end(), configuration.begin(), configuration.end());
  set(0x74, stream.padding);
  set(0x84, configuration.size());
  set(0x88, stream.said_images ? stream.said_images : stream.images.size());
  set(0x8C, (stream.images.size() + kStep - 1) / kStep);
  set(0x90, kStep);
  set(0x94, out.size());
  for (std::size_t i = 0; i < stream.images.size(); ++i) {
    if (i % kStep == 0) set(0xBEC - 4 * (i / kStep), out.size());
    out.insert(out.end(), stream.images[i].begin(), stream.images[i].end());
    out.resize(out.size() + stream.padding);
  }
  if (!stream.gps_summary.empty()) {
    const auto summary = text(stream.gps_summary);
    set(0x98, out.size());
    set(0x9C, summary.size());
    out.insert(out.end(), summary.begin(), summary.end());
  }
  return out;
}

}  // namespace hueline::test
