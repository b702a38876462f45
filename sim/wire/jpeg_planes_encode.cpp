#include "sim/wire/jpeg_planes_encode.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>

#include "sim/jpeg_handle.hpp"

namespace hueline::sim {
namespace {

constexpr std::size_t kTable = 0x340, kHead = 0x400, kMostLenses = 6;

void set_be32(Bytes& out, std::size_t at, std::uint64_t value) {
  for (std::size_t i = 0; i < 4; ++i) out[at + i] = static_cast<std::byte>(value >> (24 - 8 * i) & 0xff);
}

}  // namespace

Result<Bytes> encode_jpeg_planes(const JpegPlanesImage& image) {
  const std::uint32_t lens_width = image.lens_columns ? image.width / image.lens_columns : 0;
  const std::uint32_t lens_height = image.lens_rows ? image.height / image.lens_rows : 0;
  if (lens_width < 2 || lens_height < 2 || lens_width % 2 || lens_height % 2 || image.lenses > kMostLenses ||
      image.lenses > std::size_t{image.lens_columns} * image.lens_rows ||
      image.mosaic.size() != std::size_t{image.width} * image.height)
    return Error{ErrorCode::Invalid, "JPEG planes need a mosaic of at most six lens images with even sides"};
  const JpegHandle encoder(tjInitCompress());
  if (!encoder) return Error{ErrorCode::Exhausted, "no memory for a JPEG encoder"};

  Bytes out(kHead, std::byte{0});
  set_be32(out, 0x10, 0xCAFEBABE);
  set_be32(out, 0x14, 2);
  set_be32(out, 0x18, static_cast<std::uint64_t>(image.unix_us / 1'000'000));
  set_be32(out, 0x1C, static_cast<std::uint64_t>(image.unix_us % 1'000'000));
  set_be32(out, 0x20, image.sequence);
  for (std::size_t lens = 0; lens < std::min(kMostLenses, image.reports.size()); ++lens) {
    const auto& [exposure_ns, gain] = image.reports[lens];
    set_be32(
        out, 0x28 + 4 * lens,
        gain > 0 ? static_cast<std::uint64_t>(std::llround(400 + 200 * std::log10(static_cast<double>(gain)))) : 0);
    set_be32(out, 0x58 + 4 * lens, static_cast<std::uint64_t>(exposure_ns / 1000));
  }

  const int width = static_cast<int>(lens_width / 2), height = static_cast<int>(lens_height / 2);
  std::vector<std::uint8_t> plane(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  std::vector<unsigned char> jpeg(tjBufSize(width, height, TJSAMP_GRAY));
  for (std::size_t lens = 0; lens < image.lenses; ++lens) {
    const std::size_t left = lens % image.lens_columns * lens_width, top = lens / image.lens_columns * lens_height;
    for (std::size_t place = 0; place < 4; ++place) {
      std::uint8_t* to = plane.data();
      for (std::size_t y = place / 2; y < lens_height; y += 2) {
        const std::uint8_t* row = image.mosaic.data() + (top + y) * image.width + left;
        for (std::size_t x = place % 2; x < lens_width; x += 2) *to++ = row[x];
      }
      unsigned char* at = jpeg.data();
      unsigned long size = jpeg.size();
      // The accurate DCT gives the same bytes whatever instructions the machine has.
      if (tjCompress2(encoder.get(), plane.data(), width, 0, height, TJPF_GRAY, &at, &size, TJSAMP_GRAY, image.quality,
                      TJFLAG_NOREALLOC | TJFLAG_ACCURATEDCT) != 0)
        return Error{ErrorCode::Invalid, std::string("JPEG: ") + tjGetErrorStr2(encoder.get())};
      const std::size_t entry = kTable + 8 * (4 * lens + place);
      set_be32(out, entry, out.size());
      set_be32(out, entry + 4, size);
      const auto* bytes = reinterpret_cast<const std::byte*>(at);
      out.insert(out.end(), bytes, bytes + size);
    }
  }
  set_be32(out, 0x08, out.size());
  return out;
}

}  // namespace hueline::sim
