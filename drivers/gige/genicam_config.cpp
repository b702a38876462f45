#include "drivers/gige/genicam_config.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>

namespace hueline::drivers {
namespace {

bool is_ipv4(const std::string& text) {
  in_addr address{};
  return ::inet_pton(AF_INET, text.c_str(), &address) == 1;
}

}  // namespace

std::string GenicamConfig::validate() const {
  constexpr std::uint32_t kLargestSide = 65536;
  if (address.empty() && id.empty() && serial.empty()) return "address, id, serial: one of them must name the camera";
  if (!interface.empty() && (address.empty() || !is_ipv4(address) || !is_ipv4(interface)))
    return fmt::format("interface: '{}' and address: '{}' must both be IPv4 addresses", interface, address);
  if ((width == 0) != (height == 0)) return "width, height: both or neither";
  if (width > kLargestSide || height > kLargestSide)
    return fmt::format("width, height: {} x {} is not within 0 to {} pixels", width, height, kLargestSide);
  if (width == 0 && (offset_x || offset_y)) return "offset_x, offset_y: only together with width and height";
  if (exposure && (*exposure < std::chrono::microseconds(1) || *exposure > std::chrono::seconds(10)))
    return fmt::format("exposure: {} ns is not within 1 us to 10 s", exposure->count());
  if (frame_rate_hz < 0 || frame_rate_hz > 10'000)
    return fmt::format("frame_rate_hz: {} is not within 0 to 10000 Hz", frame_rate_hz);
  if (frame_rate_hz > 0 && !trigger_source.empty()) return "frame_rate_hz, trigger_source: not both";
  if (packet_size != 0 && (packet_size < 576 || packet_size > 16'000))
    return fmt::format("packet_size: {} is not 0 or within 576 to 16000 bytes", packet_size);
  if (packet_delay < nanoseconds(0) || packet_delay > std::chrono::milliseconds(10))
    return fmt::format("packet_delay: {} ns is not within 0 to 10 ms", packet_delay.count());
  if (give_up_after < std::chrono::milliseconds(10) || give_up_after > std::chrono::seconds(10))
    return fmt::format("give_up_after: {} ms is not within 10 ms to 10 s", give_up_after.count());
  if (socket_buffer_bytes > 1u << 30)
    return fmt::format("socket_buffer_bytes: {} is not within 0 to {}", socket_buffer_bytes, 1u << 30);
  if (realtime_priority < 0 || realtime_priority > 99)
    return fmt::format("realtime_priority: {} is not within 0 to 99", realtime_priority);
  if (stream_buffers < 2 || stream_buffers > 1000)
    return fmt::format("stream_buffers: {} is not within 2 to 1000", stream_buffers);
  if (images_in_flight < 1 || images_in_flight > 10'000)
    return fmt::format("images_in_flight: {} is not within 1 to 10000", images_in_flight);
  return {};
}

}  // namespace hueline::drivers
