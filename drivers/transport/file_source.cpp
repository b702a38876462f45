#include "drivers/transport/file_source.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
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
  file_.reset(std::fopen(config_.path.c_str(), "rb"));
  if (!file_) return Error{ErrorCode::Unavailable, fmt::format("{}: {}", config_.path, std::strerror(errno))};
  received_ = config_.first_received;
  return {};
}

Result<Packet> FileSource::next(std::stop_token stop) {
  if (stop.stop_requested()) return Error{ErrorCode::Stopped, "stopped"};
  if (!file_) return Error{ErrorCode::Disconnected, fmt::format("{}: not open", config_.path)};
  std::vector<std::byte> chunk(config_.chunk_bytes);
  const std::size_t size = std::fread(chunk.data(), 1, chunk.size(), file_.get());
  if (size == 0) {
    if (std::ferror(file_.get())) return io_error(fmt::format("reading {}", config_.path), errno);
    return Error{ErrorCode::EndOfData, fmt::format("{}: end of file", config_.path)};
  }
  Packet packet;
  packet.received = received_;
  packet.bytes = Buffer::copy_of(std::span(chunk).first(size));
  received_ += config_.interval;
  return packet;
}

}  // namespace hueline::drivers
