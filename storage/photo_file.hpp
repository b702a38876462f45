#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "core/calendar.hpp"
#include "core/geodesy.hpp"
#include "core/result.hpp"
#include "storage/byte_order.hpp"
#include "storage/png.hpp"

/// Pictures with what photographs say about themselves: where and when they were taken (EXIF), and how a panorama is to
/// be shown (XMP with the GPano properties). JPEG files carry both in APP1 segments, PNG files in the chunks eXIf and
/// iTXt.
namespace hueline::storage {

/// How an equirectangular panorama that covers the whole sphere lies in the world. Angles in rad.
struct PanoramaPose {
  double heading = 0;  ///< of the middle of the picture, clockwise from north
  double pitch = 0;    ///< of the middle of the picture, above the horizon
  double roll = 0;     ///< positive if the horizon is turned anticlockwise in the picture
};

/// What a photograph says about itself.
struct PhotoTags {
  std::string description;  ///< ASCII
  std::string software;     ///< ASCII
  UtcTime taken;
  double exposure_s = 0;  ///< how long it was exposed; 0: not known
  /// WGS84. EXIF cannot say that the height is that above the ellipsoid: the description should.
  Geodetic position;
  double sigma_horizontal_m = 0;         ///< 0: not known
  double direction = 0;                  ///< heading of the camera, rad clockwise from true north
  std::optional<PanoramaPose> panorama;  ///< empty: no panorama that viewers could show
};

/// Returns the EXIF data, a TIFF structure without a prefix, for a picture of `width` x `height` pixels.
Bytes exif_of(const PhotoTags& tags, int width, int height);
/// Returns the XMP packet. Without a panorama it holds nothing but the software.
std::string xmp_of(const PhotoTags& tags, int width, int height);

/// Encodes a picture as JPEG with its tags. `quality` is 1 to 100. The same picture gives the same bytes. Errors:
/// Invalid (no pixels, more than 65500 px a side).
Result<Bytes> encode_jpeg(RgbPixels picture, int quality, const PhotoTags& tags);
/// Encodes a picture as PNG with its tags. Errors: Invalid (no pixels).
Result<Bytes> encode_png(RgbPixels picture, const PhotoTags& tags);

}  // namespace hueline::storage
