#pragma once

#include <cstddef>

#include "core/buffer.hpp"
#include "drivers/guest/packet_memory.hpp"

namespace hueline::test {

/// Packets of a source in a pool of this process.
class Memory final : public drivers::PacketMemory {
 public:
  explicit Memory(std::size_t bytes) : pool_(bytes) {}
  Status prepare(std::size_t) override { return {}; }
  MutableBuffer acquire(std::size_t bytes) override { return pool_.acquire(bytes); }
  std::size_t bytes_in_use() const override { return pool_.bytes_in_use(); }
  std::size_t limit_bytes() const override { return pool_.limit_bytes(); }

 private:
  BufferPool pool_;
};

}  // namespace hueline::test
