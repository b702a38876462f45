#include "storage/webp.hpp"

#include <webp/encode.h>
#include <webp/mux.h>

#include <string>

namespace hueline::storage {
namespace {

Error library_error(const char* attempted, WebPAnimEncoder* encoder) {
  return {ErrorCode::Invalid, std::string("WebP: ") + attempted + ": " + WebPAnimEncoderGetError(encoder)};
}

}  // namespace

void WebpAnimation::Delete::operator()(WebPAnimEncoder* encoder) const { WebPAnimEncoderDelete(encoder); }

Result<WebpAnimation> WebpAnimation::create(int width, int height, double quality) {
  if (width < 1 || height < 1 || width > WEBP_MAX_DIMENSION || height > WEBP_MAX_DIMENSION)
    return Error{ErrorCode::Invalid, "a WebP of " + std::to_string(width) + " x " + std::to_string(height) +
                                         " px: each side must be from 1 to " + std::to_string(WEBP_MAX_DIMENSION)};
  if (!(quality >= 0 && quality <= 100)) return Error{ErrorCode::Invalid, "the quality must be from 0 to 100"};
  WebPAnimEncoderOptions options;
  if (!WebPAnimEncoderOptionsInit(&options))
    return Error{ErrorCode::Unsupported, "WebP: another version of libwebpmux"};
  // Each picture is stored whole. The camera moves, so hardly a pixel stays the same, and no old pixel may show
  // through.
  options.kmin = 0;
  options.kmax = 1;
  WebPAnimEncoder* encoder = WebPAnimEncoderNew(width, height, &options);
  if (!encoder) return Error{ErrorCode::Invalid, "WebP: no memory for the encoder"};
  return WebpAnimation(encoder, width, height, quality);
}

Status WebpAnimation::add(const RgbImage& image, int duration_ms) {
  if (image.width != width_ || image.height != height_)
    return Error{ErrorCode::Invalid, "WebP: a picture of another size than the animation"};
  if (duration_ms < 1) return Error{ErrorCode::Invalid, "WebP: a picture has to be shown for at least 1 ms"};
  WebPConfig config;
  WebPPicture picture;
  if (!WebPConfigInit(&config) || !WebPPictureInit(&picture))
    return Error{ErrorCode::Unsupported, "WebP: another version of libwebp"};
  config.quality = static_cast<float>(quality_);
  config.method = 6;
  picture.use_argb = 1;
  picture.width = width_;
  picture.height = height_;
  const bool added =
      WebPPictureImportRGB(&picture, reinterpret_cast<const std::uint8_t*>(image.pixels.data()), 3 * width_) &&
      WebPAnimEncoderAdd(encoder_.get(), &picture, time_ms_, &config);
  WebPPictureFree(&picture);
  if (!added) return library_error("a picture cannot be compressed", encoder_.get());
  time_ms_ += duration_ms;
  return {};
}

Result<Bytes> WebpAnimation::finish() {
  if (time_ms_ == 0) return Error{ErrorCode::Invalid, "WebP: an animation without pictures"};
  WebPData data;
  WebPDataInit(&data);
  // The encoder needs a time for the end. It decides how long the last picture is shown.
  if (!WebPAnimEncoderAdd(encoder_.get(), nullptr, time_ms_, nullptr) ||
      !WebPAnimEncoderAssemble(encoder_.get(), &data))
    return library_error("the animation cannot be put together", encoder_.get());
  const auto* first = reinterpret_cast<const std::byte*>(data.bytes);
  Bytes file(first, first + data.size);
  WebPDataClear(&data);
  return file;
}

}  // namespace hueline::storage
