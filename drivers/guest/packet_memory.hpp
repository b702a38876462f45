#pragma once

#include <cstddef>

#include "core/buffer.hpp"
#include "core/result.hpp"

namespace hueline::drivers {

/// Where a source stores large packets: a pool of this process, or memory that it shares with another process.
class PacketMemory {
 public:
  virtual ~PacketMemory() = default;
  /// Prepares memory for a stream whose packets have at most `packet_bytes`. Call it before the first acquire() of a
  /// stream; it may be called again. Errors: Unavailable, Io.
  virtual Status prepare(std::size_t packet_bytes) = 0;
  /// Returns memory for a packet, or an empty buffer if all is in use.
  virtual MutableBuffer acquire(std::size_t bytes) = 0;
  /// Returns the memory that packets occupy now.
  virtual std::size_t bytes_in_use() const = 0;
  /// Returns the memory that packets may occupy at most.
  virtual std::size_t limit_bytes() const = 0;
};

}  // namespace hueline::drivers
