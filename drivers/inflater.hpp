#pragma once

#include <libdeflate.h>

#include <memory>

namespace hueline::drivers {

struct FreeInflater {
  void operator()(libdeflate_decompressor* one) const { libdeflate_free_decompressor(one); }
};
/// What libdeflate unpacks with. Thread safety: one thread uses one.
using Inflater = std::unique_ptr<libdeflate_decompressor, FreeInflater>;
/// Returns null if there is no memory.
inline Inflater make_inflater() { return Inflater(libdeflate_alloc_decompressor()); }

}  // namespace hueline::drivers
