#include "drivers/stream/stream_decoder.hpp"

#include <fmt/format.h>

namespace hueline::drivers {

void StreamDecoder::decode(const Packet& packet, std::vector<Measurement>& out) {
  sensor_ = packet.sensor;
  out_ = &out;
  framer_.feed(packet.bytes.bytes(), packet.received, *this);
  if (auto lost = watch_.told(sensor_, newest_)) out.emplace_back(std::move(*lost));
  out_ = nullptr;
}

void StreamDecoder::flush(std::vector<Measurement>& out) {
  out_ = &out;
  framer_.flush(*this);
  finish();
  watch_.finish();
  if (auto lost = watch_.told(sensor_, newest_, true)) out.emplace_back(std::move(*lost));
  out_ = nullptr;
}

void StreamDecoder::reset() {
  std::vector<Measurement> unheard;
  out_ = &unheard;
  framer_.discard(*this);
  out_ = nullptr;
  watch_.forget();
  forget();
}

void StreamDecoder::on_message(std::size_t form, std::span<const std::byte> message, HostTime received) {
  newest_ = received;
  (take({form, message, received}) ? counts_.decoded_bytes : counts_.ignored_bytes) += message.size();
}

void StreamDecoder::on_skipped(std::uint64_t bytes, std::uint64_t messages, HostTime received) {
  counts_.malformed_bytes += bytes;
  counts_.malformed_messages += messages;
  watch_.skipped(bytes, messages);
  std::string detail = fmt::format("{} bytes skipped", bytes);
  if (messages > 0) detail += fmt::format(", {} broken message{} among them", messages, messages == 1 ? "" : "s");
  fault(FaultKind::Malformed, received, bytes, std::move(detail));
}

}  // namespace hueline::drivers
