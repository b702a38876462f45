#include "drivers/transport/file_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

namespace hueline::drivers {

std::string FileSource::Config::validate() const {
  if (path.empty()) return "path must name a file";
  if (chunk_bytes < 1 || chunk_bytes > 1048576) return "chunk_bytes must be 1 .. 1048576";
  if (interval.count() < 0) return "interval must not be negative";
  return {};
}

Status FileSource::open() {
  if (const std::string wrong = config_.validate(); !wrong.empty()) return Error{ErrorCode::Invalid, wrong};
  auto file = InputFile::open(config_.path);
  if (!file.ok()) return Error{ErrorCode::Unavailable, file.error().message};
  file_ = std::move(*file);
  offset_ = 0;
  received_ = config_.first_received;
  return {};
}

Result<Packet> FileSource::next(std::stop_token stop) {
  if (stop.stop_requested()) return Error{ErrorCode::Stopped, "stopped"};
  if (!file_) return Error{ErrorCode::Disconnected, fmt::format("{}: not open", config_.path)};
  const std::uint64_t left = file_->size() - offset_;
  if (left == 0) return Error{ErrorCode::EndOfData, fmt::format("{}: end of file", config_.path)};
  std::vector<std::byte> chunk(static_cast<std::size_t>(std::min<std::uint64_t>(config_.chunk_bytes, left)));
  if (Status done = file_->read(offset_, chunk); !done.ok()) return done.error();
  offset_ += chunk.size();
  Packet packet;
  packet.received = received_;
  packet.bytes = Buffer::copy_of(chunk);
  received_ += config_.interval;
  return packet;
}

}  // namespace hueline::drivers
