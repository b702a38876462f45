#pragma once

#include <cstddef>

#include "core/buffer.hpp"
#include "core/result.hpp"

namespace hueline::drivers {

/// Where a source's large packets go: a pool of this process, or memory that it shares with another.
class PacketMemory {
 public:
  virtual ~PacketMemory() = default;
  /// Before the first acquire() of a stream whose packets have at most `packet_bytes`. May be called again.
  /// Unavailable, Io.
  virtual Status prepare(std::size_t packet_bytes) = 0;
  /// Empty when all is in use.
  virtual MutableBuffer acquire(std::size_t bytes) = 0;
  virtual std::size_t bytes_in_use() const = 0;
  virtual std::size_t limit_bytes() const = 0;
};

}  // namespace hueline::drivers
