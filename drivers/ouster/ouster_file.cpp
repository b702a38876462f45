#include "drivers/ouster/ouster_file.hpp"

#include <span>
#include <utility>

#include "core/input_file.hpp"
#include "drivers/ouster/ouster_metadata.hpp"

namespace hueline::drivers {

Result<std::string> read_ouster_metadata_file(const std::string& path) {
  constexpr std::uint64_t kMostBytes = 4'000'000;
  return read_input(path, kMostBytes, "the metadata of an Ouster");
}

Status OusterFileSource::open() {
  auto text = read_ouster_metadata_file(path_);
  if (!text.ok()) return Error{ErrorCode::Invalid, text.error().message};
  if (const auto metadata = parse_ouster_metadata(*text); !metadata.ok())
    return Error{ErrorCode::Invalid, path_ + ": " + metadata.error().message};
  text_ = std::move(text).value();
  waiting_.reset();
  return datagrams_->open();
}

Result<Packet> OusterFileSource::next(std::stop_token stop) {
  if (waiting_) return *std::exchange(waiting_, std::nullopt);
  Result<Packet> packet = datagrams_->next(std::move(stop));
  if (!packet.ok() || text_.empty()) return packet;
  Packet metadata;
  metadata.received = packet->received;
  metadata.bytes = Buffer::copy_of(std::as_bytes(std::span(text_)));
  text_.clear();
  waiting_ = std::move(packet).value();
  return metadata;
}

}  // namespace hueline::drivers
