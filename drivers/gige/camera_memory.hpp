#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/result.hpp"

namespace hueline::drivers {

/// Reads and writes the memory of a GenICam camera, in which its registers lie.
class CameraMemory {
 public:
  virtual ~CameraMemory() = default;
  /// Errors: Unsupported, Invalid, Unavailable (the camera refused it), TimedOut (it does not answer), Malformed (its
  /// answer is none), Disconnected, Io.
  virtual Status read(std::uint64_t address, std::span<std::byte> out) = 0;
  virtual Status write(std::uint64_t address, std::span<const std::byte> bytes) = 0;
};

}  // namespace hueline::drivers
