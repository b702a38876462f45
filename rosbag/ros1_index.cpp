#include "rosbag/ros1_index.hpp"

#include <optional>
#include <span>
#include <utility>

namespace hueline::rosbag {
namespace {

/// Reads bytes behind their length at `at`, and moves `at` behind them.
std::optional<std::string> read_sized(InputFile& file, std::uint64_t& at) {
  std::byte length[4];
  if (at > file.size() || file.size() - at < sizeof length || !file.read(at, length).ok()) return {};
  const auto size = storage::ByteReader(length).take<std::uint32_t>();
  at += sizeof length;
  if (size > kLargestRos1Header || size > file.size() - at) return {};
  std::string out(size, '\0');
  if (!file.read(at, std::as_writable_bytes(std::span(out))).ok()) return {};
  at += size;
  return out;
}

}  // namespace

Ros1Index read_ros1_index(InputFile& file, std::uint64_t at) {
  Ros1Index out;
  for (;;) {
    const auto header = read_sized(file, at);
    auto data = header ? read_sized(file, at) : std::nullopt;
    if (!data) return out;
    Ros1Header fields(storage::as_bytes(*header));
    const auto op = fields.op();
    if (!fields.is_sound() || !op) return out;
    if (*op == Ros1Op::Connection) {
      out.connections.emplace_back(std::move(fields), std::move(*data));
      continue;
    }
    const auto place = fields.number<std::uint64_t>("chunk_pos");
    if (*op != Ros1Op::ChunkInfo || !place) return out;
    std::uint64_t& messages = out.chunks[*place];
    storage::ByteReader counts(storage::as_bytes(*data));
    while (counts.remaining() >= 8) {
      counts.take<std::uint32_t>();  // the connection
      messages += counts.take<std::uint32_t>();
    }
  }
}

}  // namespace hueline::rosbag
