#pragma once

#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "core/buffer.hpp"
#include "storage/mcap_format.hpp"

namespace hueline::storage {

/// Messages that wait to be written as one MCAP chunk. Message heads and small payloads are copied side by side. Larger
/// payloads stay where they are, held by reference, and are read only once, for the CRC.
class McapChunk {
 public:
  /// The head of a message.
  struct Message {
    std::uint16_t channel = 0;
    std::uint32_t sequence = 0;
    std::uint64_t log_time = 0, publish_time = 0;  ///< ns
  };
  /// For each channel, the log time and the offset in the chunk of each message.
  using Index = std::map<std::uint16_t, std::vector<std::pair<std::uint64_t, std::uint64_t>>>;

  /// Adds a message whose data is `head` followed by `payload`.
  void add(const Message& message, ByteView head, const Buffer& payload);
  /// Removes all messages and releases the payloads. The chunk's own memory is kept for the next messages.
  void clear();

  bool empty() const { return count_ == 0; }
  std::uint64_t count() const { return count_; }
  std::uint64_t size() const { return size_; }
  std::uint32_t crc() const { return crc_; }
  std::uint64_t first_log_time() const { return first_; }  ///< of the message that was added first
  std::uint64_t start_time() const { return start_; }      ///< earliest
  std::uint64_t end_time() const { return end_; }          ///< latest
  const std::vector<ByteView>& pieces() const { return pieces_; }
  const Index& index() const { return index_; }

 private:
  void copy_in(ByteView bytes);

  std::vector<std::unique_ptr<std::byte[]>> blocks_;
  std::size_t block_ = 0, used_ = 0;  // index of the block being filled, and bytes used in it
  std::vector<ByteView> pieces_;
  std::vector<Buffer> held_;
  Index index_;
  std::uint64_t count_ = 0, size_ = 0, first_ = 0, start_ = 0, end_ = 0;
  std::uint32_t crc_ = 0;
};

}  // namespace hueline::storage
