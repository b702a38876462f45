#include "drivers/transport/described_source.hpp"

namespace hueline::drivers {

Status DescribedSource::open() {
  auto description = describe_();
  if (!description.ok()) return Error{ErrorCode::Invalid, description.error().message};
  description_ = std::move(description).value();
  waiting_.reset();
  return described_->open();
}

Result<Packet> DescribedSource::next(std::stop_token stop) {
  if (waiting_) return *std::exchange(waiting_, std::nullopt);
  Result<Packet> packet = described_->next(std::move(stop));
  if (!packet.ok() || description_.empty()) return packet;
  Packet first;
  first.received = packet->received;
  first.bytes = Buffer::copy_of(std::exchange(description_, {}));
  waiting_ = std::move(packet).value();
  return first;
}

}  // namespace hueline::drivers
