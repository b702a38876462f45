#pragma once

#include "core/measurements.hpp"
#include "storage/byte_order.hpp"
#include "storage/png.hpp"

/// Small pictures of camera images, for people.
namespace hueline::storage {

/// Returns the image in colour with its longer side at most `longest_px` pixels. A Bayer quad becomes one pixel, then
/// squares of pixels are averaged. Error: Invalid if the number of the image's bytes does not fit its size.
Result<RgbImage> reduced_view(const Image& image, int longest_px);

/// Returns how many pixels of `image` along each side become one pixel of reduced_view(). Columns and rows at the end
/// that give no whole square are left out.
std::uint32_t reduction(const Image& image, int longest_px);

/// Encodes a baseline JPEG with 4:2:0 chroma subsampling. The same picture gives the same bytes. `quality` is 1 to
/// 100.
Result<Bytes> encode_jpeg(const RgbImage& image, int quality);

}  // namespace hueline::storage
