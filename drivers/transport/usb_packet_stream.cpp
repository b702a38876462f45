#include "drivers/transport/usb_packet_stream.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <utility>

#include "drivers/transport/host_clock.hpp"
#include "drivers/transport/usb_memory.hpp"

namespace hueline::drivers {
namespace {

constexpr std::chrono::milliseconds kWait{100};
constexpr nanoseconds kShortestSilence = std::chrono::seconds(2);
constexpr double kPeriods = 5;

}  // namespace

UsbPacketStream::UsbPacketStream(UsbPacketReader& reader, double rate_hz, nanoseconds exposure)
    : reader_(reader),
      rate_hz_(rate_hz),
      longest_silence_(rate_hz > 0 ? std::max(kShortestSilence, from_seconds(kPeriods / rate_hz) + exposure)
                                   : kShortestSilence) {}

Result<std::unique_ptr<UsbPacketStream>> UsbPacketStream::start(UsbHandle& handle, UsbBulkStream::Config config,
                                                                UsbPacketReader& reader, double rate_hz,
                                                                nanoseconds exposure) {
  std::unique_ptr<UsbPacketStream> out(new UsbPacketStream(reader, rate_hz, exposure));
  auto stream = UsbBulkStream::start(handle, std::move(config), *out);
  if (!stream) return stream.error();
  out->stream_ = std::move(*stream);
  return out;
}

void UsbPacketStream::take(std::span<const std::byte> bytes, bool is_short, HostTime received) {
  has_halted_ = false;
  reader_.take(bytes, is_short, received);
}

void UsbPacketStream::interrupt(std::string_view why, HostTime at) {
  has_halted_ = true;
  reader_.interrupt(why, at);
}

std::optional<Error> UsbPacketStream::look_for_silence() const {
  const nanoseconds silence = host_now() - last_sign_.value_or(host_now());
  if (silence <= longest_silence_ || (rate_hz_ <= 0 && !has_halted_)) return {};
  return Error{ErrorCode::Disconnected,
               fmt::format("camera: nothing came for {:.1f} s {}: its stream on USB has failed and is opened again{}",
                           to_seconds(silence),
                           rate_hz_ > 0 ? fmt::format("though it is set to {} images a second", rate_hz_)
                                        : std::string("after it halted its endpoint"),
                           hint_at_usb_memory())};
}

Result<Packet> UsbPacketStream::next(const std::stop_token& stop) {
  if (stop.stop_requested()) return Error{ErrorCode::Stopped, "stopped"};
  if (auto packet = reader_.pop()) return std::move(*packet);
  if (ended_) return *ended_;
  if (!last_sign_) last_sign_ = host_now();
  const Status came = stream_->wait(kWait);
  if (came.ok())
    last_sign_ = host_now();
  else if (came.error().code != ErrorCode::TimedOut)
    ended_ = Error{ErrorCode::Disconnected, "camera: " + came.error().message};
  else
    ended_ = look_for_silence();
  if (auto packet = reader_.pop()) return std::move(*packet);
  if (ended_) return *ended_;
  return Error{ErrorCode::TimedOut, {}};
}

}  // namespace hueline::drivers
