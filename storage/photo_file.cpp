#include "storage/photo_file.hpp"

#include <fmt/format.h>
#include <turbojpeg.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string_view>
#include <utility>
#include <vector>

#include "core/angle.hpp"
#include "storage/crc32.hpp"

namespace hueline::storage {
namespace {

/// The fields of an image file directory of TIFF, in the order of their tags.
class Directory {
 public:
  void text(std::uint16_t tag, std::string_view value) {
    Bytes bytes;
    append(bytes, as_bytes(value));
    append(bytes, std::uint8_t{0});
    const auto count = static_cast<std::uint32_t>(bytes.size());
    add(tag, 2, count, std::move(bytes));
  }
  void bytes(std::uint16_t tag, std::uint16_t type, std::string_view value) {
    Bytes bytes;
    append(bytes, as_bytes(value));
    add(tag, type, static_cast<std::uint32_t>(value.size()), std::move(bytes));
  }
  void number(std::uint16_t tag, std::uint16_t value) {
    Bytes bytes;
    append(bytes, value);
    add(tag, 3, 1, std::move(bytes));
  }
  void long_number(std::uint16_t tag, std::uint32_t value) {
    Bytes bytes;
    append(bytes, value);
    add(tag, 4, 1, std::move(bytes));
  }
  struct Ratio {
    double value;
    std::uint32_t parts;  // the denominator
  };
  void ratios(std::uint16_t tag, std::initializer_list<Ratio> values) {
    Bytes bytes;
    for (const Ratio& ratio : values) {
      append(bytes, static_cast<std::uint32_t>(std::llround(ratio.value * ratio.parts)));
      append(bytes, ratio.parts);
    }
    add(tag, 5, static_cast<std::uint32_t>(values.size()), std::move(bytes));
  }
  std::size_t size() const {
    std::size_t size = 2 + 12 * fields_.size() + 4;
    for (const Field& field : fields_)
      if (field.value.size() > 4) size += field.value.size() + field.value.size() % 2;
    return size;
  }
  /// Appends the directory, which begins at the end of `out`, and its values behind it.
  void write(Bytes& out) const {
    Bytes values;
    const std::size_t values_at = out.size() + 2 + 12 * fields_.size() + 4;
    append(out, static_cast<std::uint16_t>(fields_.size()));
    for (const Field& field : fields_) {
      append(out, field.tag);
      append(out, field.type);
      append(out, field.count);
      if (field.value.size() <= 4) {
        append(out, ByteView(field.value));
        for (std::size_t i = field.value.size(); i < 4; ++i) append(out, std::uint8_t{0});
      } else {
        append(out, static_cast<std::uint32_t>(values_at + values.size()));
        append(values, ByteView(field.value));
        if (values.size() % 2) append(values, std::uint8_t{0});
      }
    }
    append(out, std::uint32_t{0});  // no further directory
    append(out, ByteView(values));
  }

 private:
  struct Field {
    std::uint16_t tag, type;
    std::uint32_t count;
    Bytes value;
  };
  void add(std::uint16_t tag, std::uint16_t type, std::uint32_t count, Bytes value) {
    fields_.push_back({tag, type, count, std::move(value)});
  }
  std::vector<Field> fields_;
};

/// Degrees, minutes and seconds of an angle that is not negative, rad. 1e-7 seconds are 3 micrometres.
void angle(Directory& to, std::uint16_t tag, double value) {
  constexpr std::uint32_t kParts = 10'000'000;
  const auto parts = std::llround(value * kDegPerRad * 3600 * kParts);
  const auto minutes = parts / (60ll * kParts);
  to.ratios(tag, {{static_cast<double>(minutes / 60), 1},
                  {static_cast<double>(minutes % 60), 1},
                  {static_cast<double>(parts % (60ll * kParts)) / kParts, kParts}});
}

/// An angle in degrees, from 0 up to but not including 360 after rounding to hundredths.
double round_heading_deg(double value) {
  const double turned = std::round(value * kDegPerRad * 100) / 100;
  return turned - 360 * std::floor(turned / 360);
}

void append_big_endian(Bytes& out, std::uint32_t value, int size) {
  for (int i = size - 1; i >= 0; --i) append(out, static_cast<std::uint8_t>(value >> (8 * i)));
}

void append_chunk(Bytes& out, std::string_view type, ByteView data) {
  append_big_endian(out, static_cast<std::uint32_t>(data.size()), 4);
  append(out, as_bytes(type));
  append(out, data);
  append_big_endian(out, crc32(crc32(0, as_bytes(type)), data), 4);
}

void append_app1(Bytes& out, std::string_view name, ByteView data) {
  append_big_endian(out, 0xFFE1, 2);
  append_big_endian(out, static_cast<std::uint32_t>(2 + name.size() + data.size()), 2);
  append(out, as_bytes(name));
  append(out, data);
}

}  // namespace

Bytes exif_of(const PhotoTags& tags, int width, int height) {
  const UtcTime& t = tags.taken;
  const int second = std::min(t.second, 59);  // EXIF has no leap second
  const std::string when =
      fmt::format("{:04}:{:02}:{:02} {:02}:{:02}:{:02}", t.year, t.month, t.day, t.hour, t.minute, second);

  Directory photo;
  // ExposureTime
  if (tags.exposure_s > 0) photo.ratios(0x829A, {{std::min(tags.exposure_s, 1e3), 1'000'000}});
  photo.bytes(0x9000, 7, "0232");                                   // ExifVersion
  photo.text(0x9003, when);                                         // DateTimeOriginal
  photo.text(0x9011, "+00:00");                                     // OffsetTimeOriginal
  photo.bytes(0x9101, 7, std::string_view("\x01\x02\x03\x00", 4));  // ComponentsConfiguration: Y Cb Cr
  photo.text(0x9291, fmt::format("{:06}", t.nanosecond / 1000));    // SubSecTimeOriginal
  photo.bytes(0xA000, 7, "0100");                                   // FlashpixVersion
  photo.number(0xA001, 1);                                          // ColorSpace: sRGB
  photo.long_number(0xA002, static_cast<std::uint32_t>(width));     // PixelXDimension
  photo.long_number(0xA003, static_cast<std::uint32_t>(height));    // PixelYDimension

  Directory gps;
  const Geodetic& place = tags.position;
  gps.bytes(0x00, 1, std::string_view("\x02\x03\x00\x00", 4));  // GPSVersionID
  gps.text(0x01, place.latitude < 0 ? "S" : "N");
  angle(gps, 0x02, std::abs(place.latitude));
  gps.text(0x03, place.longitude < 0 ? "W" : "E");
  angle(gps, 0x04, std::abs(place.longitude));
  // EXIF 3.0 has words for heights above the ellipsoid, but readers of today take them for depths below the sea.
  gps.bytes(0x05, 1, std::string_view(place.ellipsoidal_height < 0 ? "\x01" : "\x00", 1));
  gps.ratios(0x06, {{std::abs(place.ellipsoidal_height), 10'000}});
  gps.ratios(0x07, {{static_cast<double>(t.hour), 1},
                    {static_cast<double>(t.minute), 1},
                    {second + std::floor(t.nanosecond / 1000.0) * 1e-6, 1'000'000}});
  gps.text(0x10, "T");  // GPSImgDirectionRef: true north
  gps.ratios(0x11, {{round_heading_deg(tags.direction), 100}});
  gps.text(0x12, "WGS-84");
  gps.text(0x1D, fmt::format("{:04}:{:02}:{:02}", t.year, t.month, t.day));
  if (tags.sigma_horizontal_m > 0) gps.ratios(0x1F, {{std::min(tags.sigma_horizontal_m, 4e5), 10'000}});

  const auto make_main = [&](std::uint32_t photo_at, std::uint32_t gps_at) {
    Directory main;
    main.text(0x010E, tags.description);  // ImageDescription
    main.number(0x0112, 1);               // Orientation: as stored
    // EXIF requires a resolution, and has this one for pictures that have no size.
    main.ratios(0x011A, {{72, 1}});      // XResolution
    main.ratios(0x011B, {{72, 1}});      // YResolution
    main.number(0x0128, 2);              // ResolutionUnit: inch
    main.text(0x0131, tags.software);    // Software
    main.number(0x0213, 1);              // YCbCrPositioning: centred, as JFIF has it
    main.long_number(0x8769, photo_at);  // ExifIFDPointer
    main.long_number(0x8825, gps_at);    // GPSInfoIFDPointer
    return main;
  };
  constexpr std::size_t kHeader = 8;
  const std::size_t photo_at = kHeader + make_main(0, 0).size(), gps_at = photo_at + photo.size();
  Bytes out;
  append(out, as_bytes("II"));
  append(out, std::uint16_t{42});
  append(out, std::uint32_t{kHeader});
  make_main(static_cast<std::uint32_t>(photo_at), static_cast<std::uint32_t>(gps_at)).write(out);
  photo.write(out);
  gps.write(out);
  return out;
}

std::string xmp_of(const PhotoTags& tags, int width, int height) {
  std::string properties = fmt::format("   xmp:CreatorTool=\"{}\"", tags.software);
  const auto add = [&](std::string_view name, const std::string& value) {
    properties += fmt::format("\n   GPano:{}=\"{}\"", name, value);
  };
  if (tags.panorama) {
    const UtcTime& t = tags.taken;
    const auto degrees = [](double value) { return fmt::format("{:.3f}", value * kDegPerRad + 0.0); };
    const double heading = round_heading_deg(tags.panorama->heading);
    const std::string when = fmt::format("{:04}-{:02}-{:02}T{:02}:{:02}:{:02}Z", t.year, t.month, t.day, t.hour,
                                         t.minute, std::min(t.second, 59));
    add("UsePanoramaViewer", "True");
    add("ProjectionType", "equirectangular");
    add("StitchingSoftware", tags.software);
    add("PoseHeadingDegrees", fmt::format("{:.2f}", heading));
    add("PosePitchDegrees", degrees(tags.panorama->pitch));
    add("PoseRollDegrees", degrees(tags.panorama->roll));
    add("FirstPhotoDate", when);
    add("LastPhotoDate", when);
    add("FullPanoWidthPixels", std::to_string(width));
    add("FullPanoHeightPixels", std::to_string(height));
    add("CroppedAreaImageWidthPixels", std::to_string(width));
    add("CroppedAreaImageHeightPixels", std::to_string(height));
    add("CroppedAreaLeftPixels", "0");
    add("CroppedAreaTopPixels", "0");
  }
  return "<?xpacket begin=\"\xEF\xBB\xBF\" id=\"W5M0MpCehiHzreSzNTczkc9d\"?>\n"
         "<x:xmpmeta xmlns:x=\"adobe:ns:meta/\">\n"
         " <rdf:RDF xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\">\n"
         "  <rdf:Description rdf:about=\"\"\n"
         "   xmlns:xmp=\"http://ns.adobe.com/xap/1.0/\"\n"
         "   xmlns:GPano=\"http://ns.google.com/photos/1.0/panorama/\"\n" +
         properties +
         "/>\n"
         " </rdf:RDF>\n"
         "</x:xmpmeta>\n"
         "<?xpacket end=\"r\"?>";
}

Result<Bytes> encode_jpeg(RgbPixels picture, int quality, const PhotoTags& tags) {
  constexpr int kMostOfSide = 65500;  // of the format
  if (picture.width <= 0 || picture.height <= 0) return Error{ErrorCode::Invalid, "a picture without pixels"};
  if (picture.width > kMostOfSide || picture.height > kMostOfSide)
    return Error{ErrorCode::Invalid, fmt::format("a JPEG has at most {} pixels a side", kMostOfSide)};
  struct Destroy {
    void operator()(void* handle) const { tjDestroy(handle); }
    void operator()(unsigned char* bytes) const { tjFree(bytes); }
  };
  const std::unique_ptr<void, Destroy> handle(tjInitCompress());
  if (!handle) return Error{ErrorCode::Exhausted, "no memory for a JPEG encoder"};
  unsigned char* encoded = nullptr;
  unsigned long size = 0;
  const int status = tjCompress2(handle.get(), picture.data, picture.width, 0, picture.height, TJPF_RGB, &encoded,
                                 &size, TJSAMP_420, quality, TJFLAG_ACCURATEDCT);
  const std::unique_ptr<unsigned char, Destroy> owned(encoded);
  if (status != 0) return Error{ErrorCode::Invalid, tjGetErrorStr2(handle.get())};
  // The tags follow the JFIF segment, which follows the two bytes of the beginning.
  const ByteView all = std::as_bytes(std::span(encoded, size));
  std::size_t head = 2;
  if (size > 6 && encoded[2] == 0xFF && encoded[3] == 0xE0)
    head = std::min<std::size_t>(size, 4 + std::size_t{encoded[4]} * 256 + encoded[5]);
  Bytes out;
  append(out, all.first(head));
  append_app1(out, std::string_view("Exif\0\0", 6), exif_of(tags, picture.width, picture.height));
  append_app1(out, std::string_view("http://ns.adobe.com/xap/1.0/\0", 29),
              as_bytes(xmp_of(tags, picture.width, picture.height)));
  append(out, all.subspan(head));
  return out;
}

Result<Bytes> encode_png(RgbPixels picture, const PhotoTags& tags) {
  const Result<Bytes> encoded = encode_png(picture);
  if (!encoded.ok()) return encoded.error();
  // Behind the signature and the first chunk, IHDR.
  constexpr std::size_t kHead = 8 + 12 + 13;
  Bytes out;
  append(out, ByteView(*encoded).first(kHead));
  append_chunk(out, "eXIf", exif_of(tags, picture.width, picture.height));
  // Keyword, not compressed (two bytes), no language, no translated keyword, text.
  Bytes text;
  append(text, as_bytes(std::string_view("XML:com.adobe.xmp\0\0\0\0\0", 22)));
  append(text, as_bytes(xmp_of(tags, picture.width, picture.height)));
  append_chunk(out, "iTXt", text);
  append(out, ByteView(*encoded).subspan(kHead));
  return out;
}

}  // namespace hueline::storage
