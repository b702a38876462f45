#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "drivers/device_files.hpp"
#include "drivers/stream/message_form.hpp"

namespace hueline::drivers {

/// Returns whether a whole message of `Form` is among the first bytes of a file. Other messages, text and broken bytes
/// may stand before it.
template <class Form>
bool has_message(std::string_view first_bytes) {
  Form form;
  const auto all = std::as_bytes(std::span(first_bytes));
  for (std::size_t at = 0; at < all.size(); ++at)
    if (form.judge(all.subspan(at), at, at == 0).verdict == Judgement::Verdict::Whole) return true;
  return false;
}

/// Recognises the senders of a capture whose datagrams begin with a whole message of `Form`.
template <class Form, class DeviceDecoder>
class StreamListener final : public CaptureListener {
 public:
  explicit StreamListener(const char* name) : name_(name) {}
  std::optional<HeardDevice> listen(const Packet& datagram, const std::string&) override {
    Form form;
    const auto bytes = datagram.bytes.bytes();
    if (bytes.empty() || form.judge(bytes, 0, true).verdict != Judgement::Verdict::Whole) return {};
    return HeardDevice{name_, std::make_unique<DeviceDecoder>(typename DeviceDecoder::Config{})};
  }
  bool is_decodable(const Packet&) const override { return true; }

 private:
  const char* name_;
};

/// Makes such a listener. Use it as DeviceFiles::Capture::listen.
template <class Form, class DeviceDecoder, const char* kName>
std::unique_ptr<CaptureListener> listen_to_stream(const std::string&) {
  return std::make_unique<StreamListener<Form, DeviceDecoder>>(kName);
}

}  // namespace hueline::drivers
