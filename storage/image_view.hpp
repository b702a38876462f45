#pragma once

#include "core/measurements.hpp"
#include "storage/byte_order.hpp"
#include "storage/png.hpp"

/// Small pictures of camera images, for people.
namespace hueline::storage {

/// The image in colour (a Bayer quad becomes one pixel, then squares are averaged), its longer side at most
/// `longest_px`. Invalid if the image's bytes do not fit its size.
Result<RgbImage> reduced_view(const Image& image, int longest_px);

/// Baseline JPEG, 4:2:0. The same picture gives the same bytes. `quality` 1 ... 100.
Result<Bytes> encode_jpeg(const RgbImage& image, int quality);

}  // namespace hueline::storage
