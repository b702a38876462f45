#include "drivers/gige/bayer_jpeg.hpp"

// jpeglib.h needs size_t and FILE to be declared before it.
#include <cstdio>

#include <jerror.h>
#include <jpeglib.h>

#include <csetjmp>
#include <new>
#include <vector>

namespace hueline::drivers {
namespace {

constexpr int kLargestSampling = 4;
constexpr int kMostLines = kLargestSampling * DCTSIZE;  // lines that one call gives at most: one row of blocks

/// How libjpeg leaves on an error, by longjmp. A warning (an impossible code, an early end) counts as an error, because
/// libjpeg then goes on with a guess.
struct Handler {
  jpeg_error_mgr base;  // must be the first member: libjpeg gives its address back
  std::jmp_buf way_out;
  j_common_ptr failed;
  char why[JMSG_LENGTH_MAX];
};

[[noreturn]] void leave(j_common_ptr info) {
  auto* handler = reinterpret_cast<Handler*>(info->err);
  handler->failed = info;
  handler->base.format_message(info, handler->why);
  std::longjmp(handler->way_out, 1);
}
void take_message(j_common_ptr info, int level) {
  const int code = info->err->msg_code;
  const bool is_harmless =
      code == JWRN_JFIF_MAJOR || code == JWRN_ADOBE_XFORM;  // remarks about the JPEG's header, not about its samples
  if (level < 0 && !is_harmless) leave(info);
}
void print_nothing(j_common_ptr) {}

[[noreturn]] void refuse(jpeg_decompress_struct& info, const char* why) {
  auto* handler = reinterpret_cast<Handler*>(info.err);
  handler->failed = reinterpret_cast<j_common_ptr>(&info);
  std::snprintf(handler->why, sizeof handler->why, "%s", why);
  std::longjmp(handler->way_out, 1);
}

}  // namespace

struct BayerJpegDecoder::Pair {
  Handler handler{};
  jpeg_decompress_struct planes[2]{};  // left and right place of a row of cells
  std::vector<JSAMPLE> samples[2];     // samples of one row of blocks
  JSAMPROW lines[2][kMostLines]{};

  Pair() {
    for (auto& plane : planes) plane.err = jpeg_std_error(&handler.base);
    handler.base.error_exit = leave;
    handler.base.emit_message = take_message;
    handler.base.output_message = print_nothing;
    if (setjmp(handler.way_out) != 0) throw std::bad_alloc();
    for (auto& plane : planes) jpeg_create_decompress(&plane);
  }
  ~Pair() {
    for (auto& plane : planes) jpeg_destroy_decompress(&plane);
  }
  Pair(const Pair&) = delete;
  Pair& operator=(const Pair&) = delete;

  void begin(std::size_t side, std::span<const std::byte> jpeg, std::uint32_t width, std::uint32_t height);
  bool decode(std::span<const std::byte> left, std::span<const std::byte> right, const Mosaic& mosaic,
              std::uint32_t first_row);
  void run(std::span<const std::byte> left, std::span<const std::byte> right, const Mosaic& mosaic,
           std::uint32_t first_row);
};

void BayerJpegDecoder::Pair::begin(std::size_t side, std::span<const std::byte> jpeg, std::uint32_t width,
                                   std::uint32_t height) {
  jpeg_decompress_struct& plane = planes[side];
  if (jpeg.empty()) refuse(plane, "it has no bytes");
  jpeg_mem_src(&plane, reinterpret_cast<const unsigned char*>(jpeg.data()), jpeg.size());
  jpeg_read_header(&plane, TRUE);
  if (plane.num_components != 1) refuse(plane, "it is not grey");
  if (plane.image_width != width || plane.image_height != height)
    refuse(plane, "it has not half the size of the lens image");
  if (plane.progressive_mode || plane.arith_code || jpeg_has_multiple_scans(&plane))
    refuse(plane, "it is not a baseline JPEG");
  plane.out_color_space = JCS_GRAYSCALE;
  plane.dct_method = JDCT_ISLOW;
  plane.raw_data_out = TRUE;  // the DCT writes blocks straight into `lines`, which saves two copies
  jpeg_start_decompress(&plane);
  if (plane.max_v_samp_factor > kLargestSampling) refuse(plane, "its sampling factors are too large");
  const std::size_t row = std::size_t{plane.comp_info[0].width_in_blocks} * DCTSIZE;
  if (samples[side].size() < row * kMostLines) samples[side].resize(row * kMostLines);
  for (int i = 0; i < kMostLines; ++i) lines[side][i] = samples[side].data() + static_cast<std::size_t>(i) * row;
}

/// The part of decode() that may leave by longjmp. It is a function of its own, so that no object with a destructor is
/// skipped.
void BayerJpegDecoder::Pair::run(std::span<const std::byte> left, std::span<const std::byte> right,
                                 const Mosaic& mosaic, std::uint32_t first_row) {
  const std::uint32_t width = mosaic.width / 2, height = mosaic.height / 2;
  begin(0, left, width, height);
  begin(1, right, width, height);
  const int at_once = planes[0].max_v_samp_factor * DCTSIZE;
  if (planes[1].max_v_samp_factor * DCTSIZE != at_once)
    refuse(planes[1], "its sampling factors are not its neighbour's");
  for (std::uint32_t row = 0; row < height;) {
    for (std::size_t side = 0; side < 2; ++side) {
      JSAMPARRAY component[1] = {lines[side]};
      if (jpeg_read_raw_data(&planes[side], component, static_cast<JDIMENSION>(at_once)) == 0)
        refuse(planes[side], "it ends early");
    }
    for (int i = 0; i < at_once && row < height; ++i, ++row) {
      const JSAMPLE *a = lines[0][i], *b = lines[1][i];
      std::uint8_t* out = mosaic.upper_left + (2 * std::size_t{row} + first_row) * mosaic.stride;
      for (std::uint32_t x = 0; x < width; ++x) {
        out[2 * x] = a[x];
        out[2 * x + 1] = b[x];
      }
    }
  }
}

bool BayerJpegDecoder::Pair::decode(std::span<const std::byte> left, std::span<const std::byte> right,
                                    const Mosaic& mosaic, std::uint32_t first_row) {
  handler.failed = nullptr;
  if (setjmp(handler.way_out) == 0) run(left, right, mosaic, first_row);
  for (auto& plane : planes) jpeg_abort_decompress(&plane);
  return handler.failed == nullptr;
}

BayerJpegDecoder::BayerJpegDecoder() : pair_(std::make_unique<Pair>()) {}
BayerJpegDecoder::~BayerJpegDecoder() = default;

BayerJpegDecoder::Problem BayerJpegDecoder::decode(const Planes& planes, const Mosaic& mosaic) {
  for (std::uint32_t row = 0; row < 2; ++row) {
    if (pair_->decode(planes[2 * row], planes[2 * row + 1], mosaic, row)) continue;
    const bool is_right = pair_->handler.failed == reinterpret_cast<j_common_ptr>(&pair_->planes[1]);
    return {2 * row + (is_right ? 1u : 0u), pair_->handler.why};
  }
  return {};
}

}  // namespace hueline::drivers
