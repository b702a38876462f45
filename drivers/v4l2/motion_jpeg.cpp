#include "drivers/v4l2/motion_jpeg.hpp"

// jpeglib.h needs size_t and FILE to be declared before it.
#include <cstdio>

#include <jerror.h>
#include <jpeglib.h>

#include <csetjmp>
#include <new>

namespace hueline::drivers {
namespace {

/// How libjpeg leaves on an error, by longjmp. A warning (an impossible code, an early end) counts as an error, because
/// libjpeg then goes on with a guess.
struct Handler {
  jpeg_error_mgr base;  // must be the first member: libjpeg gives its address back
  std::jmp_buf way_out;
  char why[JMSG_LENGTH_MAX];
};

[[noreturn]] void leave(j_common_ptr info) {
  auto* handler = reinterpret_cast<Handler*>(info->err);
  handler->base.format_message(info, handler->why);
  std::longjmp(handler->way_out, 1);
}
void take_message(j_common_ptr info, int level) {
  const int code = info->err->msg_code;
  // Remarks about the JPEG's header, and filling between its parts: the samples are whole.
  const bool is_harmless = code == JWRN_JFIF_MAJOR || code == JWRN_ADOBE_XFORM || code == JWRN_EXTRANEOUS_DATA;
  if (level < 0 && !is_harmless) leave(info);
}
void print_nothing(j_common_ptr) {}

[[noreturn]] void refuse(jpeg_decompress_struct& info, const char* why) {
  auto* handler = reinterpret_cast<Handler*>(info.err);
  std::snprintf(handler->why, sizeof handler->why, "%s", why);
  std::longjmp(handler->way_out, 1);
}

}  // namespace

struct MotionJpegDecoder::Reader {
  Handler handler{};
  jpeg_decompress_struct info{};

  Reader() {
    info.err = jpeg_std_error(&handler.base);
    handler.base.error_exit = leave;
    handler.base.emit_message = take_message;
    handler.base.output_message = print_nothing;
    if (setjmp(handler.way_out) != 0) throw std::bad_alloc();
    jpeg_create_decompress(&info);
  }
  ~Reader() { jpeg_destroy_decompress(&info); }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;

  void begin(std::span<const std::byte> jpeg) {
    if (jpeg.empty()) refuse(info, "it has no bytes");
    jpeg_mem_src(&info, reinterpret_cast<const unsigned char*>(jpeg.data()), jpeg.size());
    jpeg_read_header(&info, TRUE);
    if (info.num_components != 1 && info.num_components != 3) refuse(info, "it has neither one nor three components");
    if (info.progressive_mode || jpeg_has_multiple_scans(&info)) refuse(info, "it has several scans");
    info.out_color_space = info.num_components == 1 ? JCS_GRAYSCALE : JCS_RGB;
    info.dct_method = JDCT_ISLOW;
  }
  void run(std::span<const std::byte> jpeg, std::byte* out) {
    begin(jpeg);
    jpeg_start_decompress(&info);
    const std::size_t row = std::size_t{info.output_width} * static_cast<std::size_t>(info.output_components);
    while (info.output_scanline < info.output_height) {
      JSAMPROW line = reinterpret_cast<JSAMPROW>(out) + info.output_scanline * row;
      if (jpeg_read_scanlines(&info, &line, 1) == 0) refuse(info, "it ends early");
    }
  }
};

MotionJpegDecoder::MotionJpegDecoder() : reader_(std::make_unique<Reader>()) {}
MotionJpegDecoder::~MotionJpegDecoder() = default;

MotionJpegDecoder::Head MotionJpegDecoder::read_head(std::span<const std::byte> jpeg) {
  Reader& reader = *reader_;
  Head head;
  if (setjmp(reader.handler.way_out) == 0) {
    reader.begin(jpeg);
  } else {
    jpeg_abort_decompress(&reader.info);
    head.why = reader.handler.why;
    return head;
  }
  head.width = reader.info.image_width;
  head.height = reader.info.image_height;
  head.format = reader.info.num_components == 1 ? PixelFormat::Mono8 : PixelFormat::Rgb8;
  jpeg_abort_decompress(&reader.info);
  return head;
}

std::string MotionJpegDecoder::decode(std::span<const std::byte> jpeg, std::byte* out) {
  Reader& reader = *reader_;
  reader.handler.why[0] = '\0';
  if (setjmp(reader.handler.way_out) == 0) reader.run(jpeg, out);
  jpeg_abort_decompress(&reader.info);
  return reader.handler.why;
}

}  // namespace hueline::drivers
