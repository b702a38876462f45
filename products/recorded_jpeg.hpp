#pragma once

#include <cstdint>

#include "storage/byte_order.hpp"

namespace hueline::products {

/// Whether a packet may hold a JPEG: a first, quick look.
bool may_hold_jpeg(storage::ByteView packet);

/// Returns the JPEG file that a camera's packet holds, byte for byte as the camera compressed it: without what stands
/// before and behind it in the packet. If the camera left out the Huffman tables, as Motion JPEG allows, the usual ones
/// of ITU-T T.81, annex K.3, are put in, because a file needs them. Empty if there is no whole baseline JPEG of
/// `width` x `height` pixels with one or three components. Source: ITU-T T.81, annex B.
storage::Bytes recorded_jpeg(storage::ByteView packet, std::uint32_t width, std::uint32_t height);

}  // namespace hueline::products
