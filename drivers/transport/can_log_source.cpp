#include "drivers/transport/can_log_source.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <utility>

namespace hueline::drivers {

std::string CanLogSource::Config::validate() const {
  if (path.empty()) return "path must name a log of a CAN bus (.asc, or what candump -L writes)";
  if (channel < 0 || channel > 255) return "channel must be within 0 .. 255";
  return {};
}

Status CanLogSource::open() {
  close();
  if (const std::string wrong = config_.validate(); !wrong.empty()) return Error{ErrorCode::Invalid, wrong};
  file_.emplace(config_.path, std::ios::binary);
  if (!*file_) {
    const int why = errno;
    file_.reset();
    return io_error("open " + config_.path, why);
  }
  parser_ = {};
  line_ = malformed_ = 0;
  first_malformed_.clear();
  last_ = {};
  return {};
}

Result<Packet> CanLogSource::next(std::stop_token stop) {
  if (!file_) return Error{ErrorCode::Disconnected, config_.path + " is not open"};
  Packet packet;
  packet.sensor = sensor_;
  std::string line;
  while (std::getline(*file_, line)) {
    if (stop.stop_requested()) return Error{ErrorCode::Stopped, "stop was asked for"};
    ++line_;
    const Result<std::optional<CanLogEntry>> entry = parser_.take(line);
    if (!entry.ok()) {
      if (malformed_++ == 0) first_malformed_ = fmt::format("line {}: {}", line_, entry.error().message);
      continue;
    }
    if (!*entry || (config_.channel != 0 && (*entry)->frame.bus != config_.channel)) continue;
    packet.received = last_ = HostTime((*entry)->time);
    packet.bytes = Buffer::copy_of(encode_can_packet((*entry)->frame));
    return packet;
  }
  if (file_->bad()) return io_error("read " + config_.path, errno);
  if (const std::uint64_t count = std::exchange(malformed_, 0); count > 0) {
    packet.kind = PacketKind::Fault;
    packet.received = last_;
    packet.bytes = Buffer::copy_of(
        encode_fault({sensor_, FaultKind::Malformed, last_, count, config_.path + ": " + first_malformed_}));
    return packet;
  }
  return Error{ErrorCode::EndOfData, config_.path + ": end of log"};
}

}  // namespace hueline::drivers
