#include "core/feed_protocol.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace hueline::feed {
namespace {

void put(std::string& out, std::uint64_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) out.push_back(static_cast<char>(value >> (8 * i) & 0xff));
}
std::uint64_t take(std::string_view in, std::size_t at, int bytes) {
  std::uint64_t value = 0;
  for (int i = 0; i < bytes; ++i)
    value |= std::uint64_t{static_cast<unsigned char>(in[at + static_cast<std::size_t>(i)])} << (8 * i);
  return value;
}

}  // namespace

std::string frame(Kind kind, std::string_view content) {
  std::string out;
  out.reserve(kHeaderBytes + content.size());
  put(out, content.size(), 4);
  out.push_back(static_cast<char>(kind));
  return out.append(content);
}

std::string message_frame(std::uint32_t channel, std::int64_t unix_ns, std::string_view bytes) {
  std::string out;
  out.reserve(kHeaderBytes + 12 + bytes.size());
  put(out, 12 + bytes.size(), 4);
  out.push_back(static_cast<char>(Kind::Message));
  put(out, channel, 4);
  put(out, static_cast<std::uint64_t>(unix_ns), 8);
  return out.append(bytes);
}

std::optional<Message> read_message(std::string_view content) {
  if (content.size() < 12) return {};
  return Message{static_cast<std::uint32_t>(take(content, 0, 4)), static_cast<std::int64_t>(take(content, 4, 8)),
                 content.substr(12)};
}

Result<std::optional<FrameReader::Frame>> FrameReader::next() {
  const std::string_view rest = std::string_view(bytes_).substr(begin_);
  if (rest.size() < kHeaderBytes) return std::optional<Frame>();
  const std::size_t size = take(rest, 0, 4);
  if (size > most_)
    return Error{ErrorCode::Malformed,
                 fmt::format("a frame of the feed claims {} bytes; allowed are at most {}", size, most_)};
  if (rest.size() < kHeaderBytes + size) {
    bytes_.erase(0, std::exchange(begin_, 0));
    return std::optional<Frame>();
  }
  Frame out{static_cast<Kind>(rest[4]), std::string(rest.substr(kHeaderBytes, size))};
  begin_ += kHeaderBytes + size;
  if (begin_ == bytes_.size()) bytes_.clear(), begin_ = 0;
  return std::optional<Frame>(std::move(out));
}

}  // namespace hueline::feed
