#pragma once

#include <memory>

#include "storage/byte_order.hpp"
#include "storage/png.hpp"

struct WebPAnimEncoder;

namespace hueline::storage {

/// Makes an animated WebP of pictures that follow each other. Only the compressed pictures are kept in memory. The same
/// pictures give the same bytes. Move-only.
/// Thread safety: none; one thread calls all functions.
class WebpAnimation {
 public:
  /// Creates an empty animation. `quality` of the lossy compression is 0 (small) to 100. Errors: Invalid if a side is
  /// not from 1 to 16383 px.
  static Result<WebpAnimation> create(int width, int height, double quality);

  /// Shows `image` for `duration_ms` (1 or more). Errors: Invalid (another size than the animation's, no duration);
  /// what the library says.
  Status add(const RgbImage& image, int duration_ms);
  /// Returns the whole file, which repeats without end. Nothing may be added afterwards. Errors: as add(); Invalid if
  /// there is no picture.
  Result<Bytes> finish();

 private:
  struct Delete {
    void operator()(WebPAnimEncoder* encoder) const;
  };
  WebpAnimation(WebPAnimEncoder* encoder, int width, int height, double quality)
      : encoder_(encoder), width_(width), height_(height), quality_(quality) {}

  std::unique_ptr<WebPAnimEncoder, Delete> encoder_;
  int width_, height_;
  double quality_;
  int time_ms_ = 0;
};

}  // namespace hueline::storage
