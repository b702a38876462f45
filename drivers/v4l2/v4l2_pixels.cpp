#include "drivers/v4l2/v4l2_pixels.hpp"

#include <linux/videodev2.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace hueline::drivers {
namespace {

using enum V4l2Packing;

constexpr std::array kFormats{
    V4l2Format{V4L2_PIX_FMT_GREY, PixelFormat::Mono8, Bytes},
    V4l2Format{V4L2_PIX_FMT_Y10, PixelFormat::Mono8, Words, 10},
    V4l2Format{V4L2_PIX_FMT_Y12, PixelFormat::Mono8, Words, 12},
    V4l2Format{V4L2_PIX_FMT_Y14, PixelFormat::Mono8, Words, 14},
    V4l2Format{V4L2_PIX_FMT_Y16, PixelFormat::Mono8, Words, 16},
    V4l2Format{V4L2_PIX_FMT_Y10P, PixelFormat::Mono8, Mipi10},
    V4l2Format{V4L2_PIX_FMT_SRGGB8, PixelFormat::BayerRG8, Bytes},
    V4l2Format{V4L2_PIX_FMT_SGRBG8, PixelFormat::BayerGR8, Bytes},
    V4l2Format{V4L2_PIX_FMT_SGBRG8, PixelFormat::BayerGB8, Bytes},
    V4l2Format{V4L2_PIX_FMT_SBGGR8, PixelFormat::BayerBG8, Bytes},
    V4l2Format{V4L2_PIX_FMT_SRGGB10, PixelFormat::BayerRG8, Words, 10},
    V4l2Format{V4L2_PIX_FMT_SGRBG10, PixelFormat::BayerGR8, Words, 10},
    V4l2Format{V4L2_PIX_FMT_SGBRG10, PixelFormat::BayerGB8, Words, 10},
    V4l2Format{V4L2_PIX_FMT_SBGGR10, PixelFormat::BayerBG8, Words, 10},
    V4l2Format{V4L2_PIX_FMT_SRGGB10P, PixelFormat::BayerRG8, Mipi10},
    V4l2Format{V4L2_PIX_FMT_SGRBG10P, PixelFormat::BayerGR8, Mipi10},
    V4l2Format{V4L2_PIX_FMT_SGBRG10P, PixelFormat::BayerGB8, Mipi10},
    V4l2Format{V4L2_PIX_FMT_SBGGR10P, PixelFormat::BayerBG8, Mipi10},
    V4l2Format{V4L2_PIX_FMT_SRGGB12, PixelFormat::BayerRG8, Words, 12},
    V4l2Format{V4L2_PIX_FMT_SGRBG12, PixelFormat::BayerGR8, Words, 12},
    V4l2Format{V4L2_PIX_FMT_SGBRG12, PixelFormat::BayerGB8, Words, 12},
    V4l2Format{V4L2_PIX_FMT_SBGGR12, PixelFormat::BayerBG8, Words, 12},
    V4l2Format{V4L2_PIX_FMT_SRGGB12P, PixelFormat::BayerRG8, Mipi12},
    V4l2Format{V4L2_PIX_FMT_SGRBG12P, PixelFormat::BayerGR8, Mipi12},
    V4l2Format{V4L2_PIX_FMT_SGBRG12P, PixelFormat::BayerGB8, Mipi12},
    V4l2Format{V4L2_PIX_FMT_SBGGR12P, PixelFormat::BayerBG8, Mipi12},
    V4l2Format{V4L2_PIX_FMT_SRGGB14, PixelFormat::BayerRG8, Words, 14},
    V4l2Format{V4L2_PIX_FMT_SGRBG14, PixelFormat::BayerGR8, Words, 14},
    V4l2Format{V4L2_PIX_FMT_SGBRG14, PixelFormat::BayerGB8, Words, 14},
    V4l2Format{V4L2_PIX_FMT_SBGGR14, PixelFormat::BayerBG8, Words, 14},
    V4l2Format{V4L2_PIX_FMT_SRGGB14P, PixelFormat::BayerRG8, Mipi14},
    V4l2Format{V4L2_PIX_FMT_SGRBG14P, PixelFormat::BayerGR8, Mipi14},
    V4l2Format{V4L2_PIX_FMT_SGBRG14P, PixelFormat::BayerGB8, Mipi14},
    V4l2Format{V4L2_PIX_FMT_SBGGR14P, PixelFormat::BayerBG8, Mipi14},
    V4l2Format{V4L2_PIX_FMT_SRGGB16, PixelFormat::BayerRG8, Words, 16},
    V4l2Format{V4L2_PIX_FMT_SGRBG16, PixelFormat::BayerGR8, Words, 16},
    V4l2Format{V4L2_PIX_FMT_SGBRG16, PixelFormat::BayerGB8, Words, 16},
    V4l2Format{V4L2_PIX_FMT_SBGGR16, PixelFormat::BayerBG8, Words, 16},
    V4l2Format{V4L2_PIX_FMT_RGB24, PixelFormat::Rgb8, Bytes},
    V4l2Format{V4L2_PIX_FMT_BGR24, PixelFormat::Rgb8, Bgr},
    V4l2Format{V4L2_PIX_FMT_YUYV, PixelFormat::Rgb8, Yuyv},
    V4l2Format{V4L2_PIX_FMT_YVYU, PixelFormat::Rgb8, Yvyu},
    V4l2Format{V4L2_PIX_FMT_UYVY, PixelFormat::Rgb8, Uyvy},
    V4l2Format{V4L2_PIX_FMT_VYUY, PixelFormat::Rgb8, Vyuy},
    V4l2Format{V4L2_PIX_FMT_NV12, PixelFormat::Rgb8, Nv12},
    V4l2Format{V4L2_PIX_FMT_NV21, PixelFormat::Rgb8, Nv21},
    V4l2Format{V4L2_PIX_FMT_MJPEG, PixelFormat::Rgb8, Jpeg},
    V4l2Format{V4L2_PIX_FMT_JPEG, PixelFormat::Rgb8, Jpeg},
};

std::uint32_t groups(std::uint32_t width, std::uint32_t of) { return (width + of - 1) / of; }

using Bytes8 = const std::uint8_t*;

void take_words(Bytes8 in, std::uint32_t width, int shift, std::uint8_t* out) {
  for (std::uint32_t x = 0; x < width; ++x) {
    const unsigned high = (in[2 * x] | unsigned{in[2 * x + 1]} << 8) >> shift;
    out[x] = static_cast<std::uint8_t>(std::min(high, 255u));  // a driver may use bits that the format does not have
  }
}

/// Copies the high bytes, which stand together at the beginning of each group.
template <std::uint32_t kSamples, std::uint32_t kBytes>
void take_high_bytes(Bytes8 in, std::uint32_t width, std::uint8_t* out) {
  for (std::uint32_t x = 0; x < width; ++x) out[x] = in[x / kSamples * kBytes + x % kSamples];
}

void exchange_ends(Bytes8 in, std::uint32_t width, std::uint8_t* out) {
  for (std::uint32_t x = 0; x < width; ++x, in += 3, out += 3) {
    out[0] = in[2];
    out[1] = in[1];
    out[2] = in[0];
  }
}

/// Luminance and colour differences to red, green and blue, with factors of 1/65536.
class RgbOfYcbcr {
 public:
  explicit RgbOfYcbcr(const YcbcrCoding& coding) {
    const double luminance = coding.is_full_range ? 1.0 : 255.0 / 219.0;
    const double difference = coding.is_full_range ? 1.0 : 255.0 / 224.0;
    const double kr = coding.red_weight, kb = coding.blue_weight, kg = 1 - kr - kb;
    black_ = coding.is_full_range ? 0 : 16;
    luminance_ = fixed(luminance);
    red_of_red_ = fixed(difference * 2 * (1 - kr));
    blue_of_blue_ = fixed(difference * 2 * (1 - kb));
    green_of_red_ = fixed(difference * 2 * (1 - kr) * kr / kg);
    green_of_blue_ = fixed(difference * 2 * (1 - kb) * kb / kg);
  }

  void write(std::uint8_t luminance, std::uint8_t blue, std::uint8_t red, std::uint8_t* out) const {
    const int y = (luminance - black_) * luminance_ + kHalf, b = blue - 128, r = red - 128;
    out[0] = clamped(y + r * red_of_red_);
    out[1] = clamped(y - r * green_of_red_ - b * green_of_blue_);
    out[2] = clamped(y + b * blue_of_blue_);
  }

 private:
  static constexpr int kShift = 16, kHalf = 1 << (kShift - 1);
  static int fixed(double factor) { return static_cast<int>(std::lround(factor * (1 << kShift))); }
  static std::uint8_t clamped(int value) { return static_cast<std::uint8_t>(std::clamp(value >> kShift, 0, 255)); }

  int black_, luminance_, red_of_red_, blue_of_blue_, green_of_red_, green_of_blue_;
};

/// Four bytes for two pixels. The template parameters are places in them.
template <int kLuminance, int kBlue, int kRed>
void take_pairs(Bytes8 in, std::uint32_t width, const RgbOfYcbcr& rgb, std::uint8_t* out) {
  for (std::uint32_t x = 0; x < width; ++x) {
    Bytes8 pair = in + std::size_t{x / 2} * 4;
    rgb.write(pair[kLuminance + 2 * (x % 2)], pair[kBlue], pair[kRed], out + std::size_t{x} * 3);
  }
}

template <int kBlue, int kRed>
void take_planes(Bytes8 luminance, Bytes8 differences, std::uint32_t width, const RgbOfYcbcr& rgb, std::uint8_t* out) {
  for (std::uint32_t x = 0; x < width; ++x) {
    Bytes8 pair = differences + std::size_t{x / 2} * 2;
    rgb.write(luminance[x], pair[kBlue], pair[kRed], out + std::size_t{x} * 3);
  }
}

}  // namespace

std::uint64_t V4l2Format::row_bytes(std::uint32_t width) const {
  switch (packing) {
    case Bytes:
      return std::uint64_t{width} * converted_pixel_bytes(image);
    case Words:
      return std::uint64_t{width} * 2;
    case Mipi10:
      return std::uint64_t{groups(width, 4)} * 5;
    case Mipi12:
      return std::uint64_t{groups(width, 2)} * 3;
    case Mipi14:
      return std::uint64_t{groups(width, 4)} * 7;
    case Bgr:
      return std::uint64_t{width} * 3;
    case Yuyv:
    case Yvyu:
    case Uyvy:
    case Vyuy:
      return std::uint64_t{groups(width, 2)} * 4;
    case Nv12:
    case Nv21:
      return std::uint64_t{groups(width, 2)} * 2;
    case Jpeg:
      return 0;
  }
  return 0;
}

std::uint64_t V4l2Format::image_bytes(std::uint32_t width, std::uint32_t height, std::uint32_t stride) const {
  if (packing == Jpeg || height == 0) return 0;
  const bool is_planar = packing == Nv12 || packing == Nv21;
  const std::uint64_t rows = is_planar ? std::uint64_t{height} + groups(height, 2) : height;
  return (rows - 1) * stride + row_bytes(width);  // the last row may lack its filling
}

std::span<const V4l2Format> v4l2_formats() { return kFormats; }

const V4l2Format* find_v4l2_format(std::uint32_t fourcc) {
  const auto* found = std::ranges::find(kFormats, fourcc, &V4l2Format::fourcc);
  return found == kFormats.end() ? nullptr : found;
}

std::string fourcc_text(std::uint32_t fourcc) {
  std::string text;
  for (int i = 0; i < 4; ++i) {
    const char c = static_cast<char>(fourcc >> (8 * i) & 0x7F);
    text += c >= ' ' && c <= '~' ? c : '?';
  }
  text.erase(text.find_last_not_of(' ') + 1);
  return text;
}

YcbcrCoding ycbcr_coding(std::uint32_t colour_space, std::uint32_t encoding, std::uint32_t quantisation) {
  if (encoding == V4L2_YCBCR_ENC_DEFAULT) encoding = V4L2_MAP_YCBCR_ENC_DEFAULT(colour_space);
  if (quantisation == V4L2_QUANTIZATION_DEFAULT)
    quantisation = V4L2_MAP_QUANTIZATION_DEFAULT(false, colour_space, encoding);
  YcbcrCoding coding;
  if (encoding == V4L2_YCBCR_ENC_709 || encoding == V4L2_YCBCR_ENC_XV709) {
    coding.red_weight = 0.2126;
    coding.blue_weight = 0.0722;
  } else if (encoding == V4L2_YCBCR_ENC_BT2020) {
    coding.red_weight = 0.2627;
    coding.blue_weight = 0.0593;
  } else if (encoding == V4L2_YCBCR_ENC_SMPTE240M) {
    coding.red_weight = 0.212;
    coding.blue_weight = 0.087;
  }
  coding.is_full_range = quantisation == V4L2_QUANTIZATION_FULL_RANGE;
  return coding;
}

std::uint32_t converted_pixel_bytes(PixelFormat format) { return format == PixelFormat::Rgb8 ? 3 : 1; }

void convert_v4l2_pixels(const V4l2Format& format, const YcbcrCoding& coding, std::uint32_t width, std::uint32_t height,
                         std::uint32_t stride, std::span<const std::byte> in, std::byte* out) {
  const RgbOfYcbcr rgb(coding);
  const auto* first = reinterpret_cast<Bytes8>(in.data());
  auto* to = reinterpret_cast<std::uint8_t*>(out);
  const std::size_t out_stride = std::size_t{width} * converted_pixel_bytes(format.image);
  for (std::uint32_t y = 0; y < height; ++y, to += out_stride) {
    Bytes8 row = first + std::size_t{y} * stride;
    Bytes8 differences = first + (std::size_t{height} + y / 2) * stride;  // for Nv12 and Nv21 alone
    switch (format.packing) {
      case Bytes:
      case Jpeg:
        return;
      case Words:
        take_words(row, width, format.bits - 8, to);
        break;
      case Mipi10:
        take_high_bytes<4, 5>(row, width, to);
        break;
      case Mipi12:
        take_high_bytes<2, 3>(row, width, to);
        break;
      case Mipi14:
        take_high_bytes<4, 7>(row, width, to);
        break;
      case Bgr:
        exchange_ends(row, width, to);
        break;
      case Yuyv:
        take_pairs<0, 1, 3>(row, width, rgb, to);
        break;
      case Yvyu:
        take_pairs<0, 3, 1>(row, width, rgb, to);
        break;
      case Uyvy:
        take_pairs<1, 0, 2>(row, width, rgb, to);
        break;
      case Vyuy:
        take_pairs<1, 2, 0>(row, width, rgb, to);
        break;
      case Nv12:
        take_planes<0, 1>(row, differences, width, rgb, to);
        break;
      case Nv21:
        take_planes<1, 0>(row, differences, width, rgb, to);
        break;
    }
  }
}

}  // namespace hueline::drivers
