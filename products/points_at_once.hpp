#pragma once

#include <cstddef>

namespace hueline::products {

/// How many points an export reads from a cloud at once.
constexpr std::size_t kPointsAtOnce = 65536;

}  // namespace hueline::products
