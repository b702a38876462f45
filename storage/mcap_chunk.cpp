#include "storage/mcap_chunk.hpp"

#include <algorithm>

#include "storage/crc32.hpp"

namespace hueline::storage {
namespace {

constexpr std::size_t kPiece = 256 * 1024;
/// Smaller payloads are copied. A copy then costs less than a further piece in writev, and the source's pool gets its
/// buffer back at once.
constexpr std::size_t kCopyBelow = 4096;
constexpr std::size_t kMessageHead = kMcapRecordHead + 2 + 4 + 8 + 8;

}  // namespace

void McapChunk::add(const Message& message, ByteView head, const Buffer& payload) {
  std::byte record[kMessageHead];
  put(record, 0, static_cast<std::uint8_t>(McapOpcode::Message));
  put(record, 1, static_cast<std::uint64_t>(kMessageHead - kMcapRecordHead + head.size() + payload.size()));
  put(record, 9, message.channel);
  put(record, 11, message.sequence);
  put(record, 15, message.log_time);
  put(record, 23, message.publish_time);

  index_[message.channel].emplace_back(message.log_time, size_);
  if (count_ == 0) {
    first_ = start_ = end_ = message.log_time;
  } else {
    start_ = std::min(start_, message.log_time);
    end_ = std::max(end_, message.log_time);
  }
  ++count_;
  copy_in(record);
  copy_in(head);
  if (payload.size() < kCopyBelow) return copy_in(payload.bytes());
  pieces_.push_back(payload.bytes());
  held_.push_back(payload);
  size_ += payload.size();
  crc_ = crc32(crc_, payload.bytes());
}

void McapChunk::copy_in(ByteView bytes) {
  size_ += bytes.size();
  crc_ = crc32(crc_, bytes);
  while (!bytes.empty()) {
    if (used_ == kPiece) ++block_, used_ = 0;
    if (block_ == blocks_.size()) blocks_.push_back(std::make_unique<std::byte[]>(kPiece));
    const std::size_t step = std::min(bytes.size(), kPiece - used_);
    std::byte* const to = blocks_[block_].get() + used_;
    std::copy_n(bytes.data(), step, to);
    if (!pieces_.empty() && pieces_.back().data() + pieces_.back().size() == to)
      pieces_.back() = ByteView(pieces_.back().data(), pieces_.back().size() + step);
    else
      pieces_.emplace_back(to, step);
    used_ += step;
    bytes = bytes.subspan(step);
  }
}

void McapChunk::clear() {
  pieces_.clear();
  held_.clear();
  index_.clear();
  block_ = used_ = 0;
  count_ = size_ = first_ = start_ = end_ = 0;
  crc_ = 0;
}

}  // namespace hueline::storage
