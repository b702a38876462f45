#include "apps/import/image_message.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "core/exif_orientation.hpp"
#include "drivers/ros/image_packet.hpp"
#include "storage/image_file.hpp"

namespace hueline::apps {
namespace {

using drivers::PacketImage;
using drivers::RosHeader;
using drivers::RosReader;

constexpr std::uint32_t kMostSide = 65535;

using Bytes = std::span<const std::byte>;

/// What sensor_msgs/image_encodings calls a pixel format, and V4L2's four characters for what it becomes.
struct Encoding {
  std::string_view ros, fourcc;
  /// Of pixels that V4L2 has not: their samples, and the bytes of a sample. Of these the highest byte is taken, and of
  /// the samples the first three.
  std::uint32_t samples = 0, sample_bytes = 0;
  bool is_converted() const { return samples > 0; }
};
constexpr std::array<Encoding, 27> kEncodings{
    {{"mono8", "GREY"},        {"mono16", "Y16 "},       {"8UC1", "GREY"},         {"rgb8", "RGB3"},
     {"bgr8", "BGR3"},         {"8UC3", "BGR3"},         {"rgba8", "RGB3", 4, 1},  {"bgra8", "BGR3", 4, 1},
     {"8UC4", "BGR3", 4, 1},   {"rgb16", "RGB3", 3, 2},  {"bgr16", "BGR3", 3, 2},  {"rgba16", "RGB3", 4, 2},
     {"bgra16", "BGR3", 4, 2}, {"bayer_rggb8", "RGGB"},  {"bayer_bggr8", "BA81"},  {"bayer_gbrg8", "GBRG"},
     {"bayer_grbg8", "GRBG"},  {"bayer_rggb16", "RG16"}, {"bayer_bggr16", "BYR2"}, {"bayer_gbrg16", "GB16"},
     {"bayer_grbg16", "GR16"}, {"yuv422", "UYVY"},       {"uyvy", "UYVY"},         {"yuv422_yuy2", "YUYV"},
     {"yuyv", "YUYV"},         {"nv21", "NV21"},         {"nv12", "NV12"}}};
constexpr const char* kReadEncodings =
    "mono8, mono16, rgb8, bgr8, rgba8, bgra8, rgb16, bgr16, bayer_* of 8 and 16 bits, 8UC1, 8UC3, 8UC4, yuv422, yuyv "
    "and nv21 are read";

constexpr std::array<std::string_view, 3> kVideoTypes{"ffmpeg_image_transport_msgs/FFMPEGPacket",
                                                      "foxglove_msgs/CompressedVideo", "theora_image_transport/Packet"};
constexpr std::array<std::string_view, 6> kVideoFormats{"h264", "h265", "hevc", "av1", "vp9", "mpeg"};

ImageMessage packed(RosHeader header, std::string_view format, PacketImage image, Bytes pixels) {
  ImageMessage out;
  image.stamp = header.stamp;
  out.header = std::move(header);
  out.format = drivers::format_word(format);
  out.width = image.width;
  out.height = image.height;
  out.is_grey = format == "GREY" || format == "Y16 ";
  out.packet = drivers::image_packet(format, image, pixels);
  return out;
}

Error broken() { return {ErrorCode::Malformed, "an image whose size contradicts its bytes"}; }

/// Takes of each pixel the highest bytes of its first three samples.
std::vector<std::byte> three_bytes_each(const Encoding& encoding, const PacketImage& image, Bytes in,
                                        bool is_big_endian) {
  std::vector<std::byte> out(std::size_t{image.width} * image.height * 3);
  const std::size_t high = is_big_endian ? 0 : encoding.sample_bytes - 1;
  std::byte* to = out.data();
  for (std::uint32_t y = 0; y < image.height; ++y) {
    const std::byte* pixel = in.data() + std::size_t{y} * image.stride + high;
    for (std::uint32_t x = 0; x < image.width; ++x, pixel += encoding.samples * encoding.sample_bytes)
      for (std::size_t sample = 0; sample < 3; ++sample) *to++ = pixel[sample * encoding.sample_bytes];
  }
  return out;
}

std::uint16_t word_at(const std::byte* bytes, bool is_big_endian) {
  const auto low = std::to_integer<unsigned>(bytes[is_big_endian ? 1 : 0]);
  const auto high = std::to_integer<unsigned>(bytes[is_big_endian ? 0 : 1]);
  return static_cast<std::uint16_t>(low | high << 8U);
}

/// Returns the samples with the lower byte first, `raised` bits higher.
std::vector<std::byte> raised_words(Bytes in, bool is_big_endian, unsigned raised) {
  std::vector<std::byte> out(in.begin(), in.end());
  for (std::size_t i = 1; i < out.size(); i += 2) {
    const unsigned word = std::min<unsigned>(unsigned{word_at(&in[i - 1], is_big_endian)} << raised, 0xFFFF);
    out[i - 1] = static_cast<std::byte>(word & 0xFFU);
    out[i] = static_cast<std::byte>(word >> 8U);
  }
  return out;
}

/// What a sensor_msgs/Image or a foxglove_msgs/RawImage says behind its header.
struct PlainHead {
  std::uint32_t width = 0, height = 0, step = 0;
  std::string encoding;
  bool is_big_endian = false;
  Bytes bytes;
};
PlainHead take_plain_head(bool is_foxglove, RosReader& message) {
  PlainHead out;
  out.height = message.take<std::uint32_t>();
  out.width = message.take<std::uint32_t>();
  if (is_foxglove) std::swap(out.width, out.height);
  out.encoding = message.take_string();
  out.is_big_endian = !is_foxglove && message.take<std::uint8_t>() != 0;
  out.step = message.take<std::uint32_t>();
  out.bytes = message.take_byte_sequence();
  return out;
}

Result<ImageMessage> plain_image(RosHeader header, const PlainHead& head, PacketImage image, unsigned raised) {
  const std::string& name = head.encoding;
  const bool is_big_endian = head.is_big_endian;
  image.width = head.width, image.height = head.height, image.stride = head.step;
  Bytes bytes = head.bytes;
  const auto* found = std::ranges::find(kEncodings, name, &Encoding::ros);
  if (found == kEncodings.end())
    return Error{ErrorCode::Unsupported, fmt::format("pixels of the encoding \"{}\"; {}", name, kReadEncodings)};
  const drivers::PixelLayout layout = drivers::layout_of(found->fourcc, image);
  const std::uint64_t row =
      found->is_converted() ? std::uint64_t{image.width} * found->samples * found->sample_bytes : layout.row_bytes;
  const std::uint64_t needed = found->is_converted() ? std::uint64_t{image.stride} * image.height : layout.image_bytes;
  const bool is_sound = image.width > 0 && image.height > 0 && image.width <= kMostSide && image.height <= kMostSide &&
                        row <= image.stride && needed <= bytes.size();
  if (!is_sound) return broken();
  std::vector<std::byte> words;
  if ((layout.has_words && (is_big_endian || raised > 0)) || (found->sample_bytes == 2 && raised > 0)) {
    words = raised_words(bytes, is_big_endian, raised);
    bytes = words;
  }
  if (found->is_converted()) {
    const auto pixels = three_bytes_each(*found, image, bytes, is_big_endian && words.empty());
    image.stride = image.width * 3;
    return packed(std::move(header), found->fourcc, image, pixels);
  }
  return packed(std::move(header), found->fourcc, image, bytes);
}

bool has_one_channel(const storage::RgbImage& picture) {
  return std::ranges::all_of(picture.pixels, [](const storage::Rgb& p) { return p[0] == p[1] && p[1] == p[2]; });
}

/// Returns whether a picture has shades of grey alone. One of a single colour, as a camera gives before it sees, says
/// nothing about its others.
bool is_grey(const storage::RgbImage& picture) {
  const auto& pixels = picture.pixels;
  return has_one_channel(picture) &&
         std::ranges::any_of(pixels, [&](const storage::Rgb& p) { return p != pixels.front(); });
}

/// Returns the mosaic whose samples a picture has, or null. image_transport of ROS 1 compresses a mosaic as if its
/// samples were shades of grey, and says so by "bayer_rggb8; jpeg compressed "; behind the last word stands to what
/// others have converted it first: to colours (bgr8) or grey (mono8).
const Encoding* mosaic_of(std::string_view format) {
  constexpr std::string_view kMosaic = "bayer_", kWord = "compressed";
  constexpr std::size_t kNameEnd = kMosaic.size() + 4;  // bayer_rggb
  const auto word = format.rfind(kWord);
  if (!format.starts_with(kMosaic) || word == std::string_view::npos) return nullptr;
  std::string_view to = format.substr(word + kWord.size());
  to.remove_prefix(std::min(to.find_first_not_of(' '), to.size()));
  if (!to.empty() && !to.starts_with(kMosaic)) return nullptr;
  const std::string name = std::string(format.substr(0, kNameEnd)) + "8";
  const auto* found = std::ranges::find(kEncodings, name, &Encoding::ros);
  return found == kEncodings.end() ? nullptr : found;
}

/// Takes the samples of a mosaic from a picture with one channel.
ImageMessage mosaic(RosHeader header, const Encoding& encoding, PacketImage image, const storage::RgbImage& picture) {
  std::vector<std::byte> samples;
  samples.reserve(picture.pixels.size());
  for (const storage::Rgb& pixel : picture.pixels) samples.push_back(static_cast<std::byte>(pixel[0]));
  image.width = static_cast<std::uint32_t>(picture.width);
  image.height = static_cast<std::uint32_t>(picture.height);
  image.stride = image.width;
  return packed(std::move(header), encoding.fourcc, image, samples);
}

/// Decodes a picture. The values of a PNG of 16 bits are taken `raised` bits higher.
Result<storage::RgbImage> decoded(Bytes bytes, unsigned raised) {
  if (raised > 0) {
    const auto wide = storage::decode_wide_png(bytes);
    if (!wide.ok()) return wide.error();
    if (*wide) return storage::raised(**wide, raised);
  }
  return storage::decode_image(bytes);
}

/// Takes the pixels of a picture that a camera's decoder does not read: a PNG, or a JPEG with several scans.
Result<ImageMessage> decoded_picture(RosHeader header, PacketImage image, Bytes bytes, unsigned raised) {
  const auto picture = decoded(bytes, raised);
  if (!picture.ok()) return picture.error();
  image.width = static_cast<std::uint32_t>(picture->width);
  image.height = static_cast<std::uint32_t>(picture->height);
  image.stride = image.width * 3;
  const std::span pixels(picture->pixels.data()->data(), picture->pixels.size() * 3);
  ImageMessage out = packed(std::move(header), "RGB3", image, std::as_bytes(pixels));
  out.is_grey = is_grey(*picture);
  return out;
}

Result<ImageMessage> compressed_image(RosHeader header, const std::string& format, PacketImage image, Bytes bytes,
                                      unsigned raised) {
  const auto refuse = [&](const std::string& why) {
    return Error{ErrorCode::Unsupported, fmt::format("compressed as \"{}\": {}", format, why)};
  };
  const auto says = [&](std::string_view word) { return format.find(word) != std::string::npos; };
  if (std::ranges::any_of(kVideoFormats, says)) return refuse("video is not read; images, JPEG or PNG are");
  if (says("compressedDepth") || format.starts_with("16UC1") || format.starts_with("32FC1"))
    return refuse("depths, no colours");
  if (const Encoding* samples = mosaic_of(format)) {
    const auto picture = decoded(bytes, raised);
    if (picture.ok() && has_one_channel(*picture)) return mosaic(std::move(header), *samples, image, *picture);
  }
  if (const drivers::JpegHead head = drivers::jpeg_head(bytes); head.why.empty()) {
    image.width = head.width;
    image.height = head.height;
    ImageMessage out = packed(std::move(header), "MJPG", image, bytes);
    out.is_grey = head.is_grey;
    return out;
  }
  auto picture = decoded_picture(std::move(header), image, bytes, raised);
  return picture.ok() ? std::move(picture) : Result<ImageMessage>(refuse(picture.error().message));
}

bool is_foxglove(std::string_view type) { return type.starts_with("foxglove_msgs/"); }

/// What a CompressedImage says behind its header.
struct CompressedHead {
  std::string format;
  Bytes bytes;
};
CompressedHead take_compressed_head(bool is_foxglove, RosReader& message) {
  CompressedHead out;
  if (!is_foxglove) out.format = message.take_string();
  out.bytes = message.take_byte_sequence();
  if (is_foxglove) out.format = message.take_string();
  return out;
}

}  // namespace

bool carries_image(std::string_view type) {
  return type == "sensor_msgs/Image" || type == "sensor_msgs/CompressedImage" || type == "foxglove_msgs/RawImage" ||
         type == "foxglove_msgs/CompressedImage" || std::ranges::find(kVideoTypes, type) != kVideoTypes.end();
}

RosHeader take_image_header(std::string_view type, RosReader& message) {
  if (!is_foxglove(type)) return message.take_header();
  RosHeader out;  // as std_msgs/Header in ROS 2, also in ROS 1
  out.stamp = message.take_time();
  out.frame = message.take_string();
  return out;
}

Result<ImageMessage> take_image(std::string_view type, RosReader message, const ImageStamp& stamp) {
  if (std::ranges::find(kVideoTypes, type) != kVideoTypes.end())
    return Error{ErrorCode::Unsupported, "video is not read; record images, or decode it into sensor_msgs/Image"};
  RosHeader header = take_image_header(type, message);
  header.stamp = count_ns(header.stamp) == 0 ? stamp.unstamped : header.stamp + stamp.shift;
  PacketImage image;
  image.sequence = stamp.sequence;
  if (type.ends_with("/CompressedImage")) {
    const CompressedHead head = take_compressed_head(is_foxglove(type), message);
    if (!message.ok()) return broken();
    auto out = compressed_image(std::move(header), head.format, image, head.bytes, stamp.raised_bits);
    if (out.ok())
      out->orientation = exif_orientation({reinterpret_cast<const char*>(head.bytes.data()), head.bytes.size()});
    return out;
  }
  const PlainHead head = take_plain_head(is_foxglove(type), message);
  if (!message.ok()) return broken();
  return plain_image(std::move(header), head, image, stamp.raised_bits);
}

unsigned used_bits(std::string_view type, RosReader message) {
  if (std::ranges::find(kVideoTypes, type) != kVideoTypes.end()) return 0;
  take_image_header(type, message);
  if (type.ends_with("/CompressedImage")) {
    const CompressedHead compressed = take_compressed_head(is_foxglove(type), message);
    const auto wide = storage::decode_wide_png(compressed.bytes);
    return message.ok() && wide.ok() && *wide ? std::max(storage::used_bits(**wide), 1U) : 0;
  }
  const PlainHead head = take_plain_head(is_foxglove(type), message);
  const auto* found = std::ranges::find(kEncodings, head.encoding, &Encoding::ros);
  if (!message.ok() || found == kEncodings.end()) return 0;
  PacketImage image;
  image.width = head.width, image.height = head.height, image.stride = head.step;
  const bool is_converted = found->is_converted();
  const bool has_words = is_converted ? found->sample_bytes == 2 : drivers::layout_of(found->fourcc, image).has_words;
  const std::uint64_t row = std::uint64_t{head.width} * (is_converted ? found->samples : 1) * 2;
  if (!has_words || row > head.step || std::uint64_t{head.step} * head.height > head.bytes.size()) return 0;
  unsigned all = 0;
  for (std::uint64_t y = 0; y < head.height; ++y)
    for (std::uint64_t x = 0; x < row; x += 2) all |= word_at(&head.bytes[y * head.step + x], head.is_big_endian);
  return static_cast<unsigned>(std::bit_width(std::max(all, 1U)));
}

}  // namespace hueline::apps
