#pragma once

#include <turbojpeg.h>

#include <memory>

namespace hueline::sim {

struct DestroyJpegHandle {
  void operator()(void* handle) const { tjDestroy(handle); }
};
/// Owns what tjInitCompress() or tjInitDecompress() returned; null if there was no memory for it.
using JpegHandle = std::unique_ptr<void, DestroyJpegHandle>;

}  // namespace hueline::sim
