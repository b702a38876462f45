#include "drivers/gige/genicam_config.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>

#include "drivers/guest/config_text.hpp"

namespace hueline::drivers {
namespace {

bool is_ipv4(const std::string& text) {
  in_addr address{};
  return ::inet_pton(AF_INET, text.c_str(), &address) == 1;
}

}  // namespace

void GenicamConfig::visit(Keys& keys) {
  keys.text(
      {"address", "",
       "The IPv4 address of a GigE camera. At least one of `address`, `id` and `serial` names the camera.", "none"},
      address);
  keys.text({"interface", "", "The computer's own address towards the camera; it needs `address`.", "by route"},
            interface, kIpv4Address);
  keys.text({"id", "", "The camera's name as `arv-tool-0.8` lists it.", "none"}, id);
  keys.text({"serial", "", "The camera's serial number. It is checked in any case.", "none"}, serial);
  keys.duration(
      required("exposure_us", "us",
               "The exposure; automatic exposure is turned off. Half of it is added to the strobe's time. With "
               "`auto_exposure` the longest exposure, if the camera can be told."),
      exposure, {1, 1e6});
  keys.flag(
      {"auto_exposure", "",
       "Whether the camera chooses its exposures. It then has to report each of them (`chunks`), because the middle "
       "of an exposure changes with its length."},
      auto_exposure);
  keys.number({"gain", "camera's unit", "The gain; automatic gain is turned off.", "camera's own"}, gain, {-100, 100});
  keys.number(
      {"frame_rate_hz", "Hz", "The rate of a camera that runs freely. Not with `trigger_source`.", "0: camera's own"},
      frame_rate_hz, {0, 1000});
  keys.text(
      {"trigger_source", "", "The camera's input that starts an exposure, such as Line0.", "the camera runs freely"},
      trigger_source);
  keys.choice({"trigger_activation", "", "The edge at that input that starts an exposure."}, trigger_activation,
              {{"rising", TriggerActivation::RisingEdge}, {"falling", TriggerActivation::FallingEdge}});
  keys.flag(
      {"chunks", "",
       "Whether the camera is asked to write exposure and gain behind each image (GenICam chunk data), if it can."},
      chunks);
  keys.text({"features", "", "Any GenICam features as `Name=Value Name=Value`. They are set last.", "none"}, features);
  keys.whole({"packet_size", "bytes", "The size of a packet with its IP and UDP headers: 0, or at least 576.",
              "0: the largest that gets through"},
             packet_size, {0, 16'000});
  keys.duration({"packet_delay_us", "us",
                 "The time between packets. A longer time helps if a switch or the computer loses bursts."},
                packet_delay, {0, 10'000});
  keys.flag({"packet_resend", "", "Whether missing packets are requested again."}, packet_resend);
  keys.flag({"packet_socket", "",
             "Whether the kernel's UDP stack is bypassed if that is permitted (CAP_NET_RAW). It is never bypassed on "
             "loopback."},
            packet_socket);
  keys.whole({"transfer_mb", "MB",
              "Of a USB camera: the memory of the transfers that are under way. The kernel's usbfs_memory_mb has to "
              "allow it."},
             transfer_MB, {1, 200});
  keys.whole({"realtime_priority", "",
              "The real-time priority of the receiving thread. It needs CAP_SYS_NICE; without it the thread has normal "
              "priority.",
              "0: normal"},
             realtime_priority, {0, 99});
  // The sum of the two largest values fits into the memory of a guest (guest::kMostSlots).
  keys.whole({"stream_buffers", "images", "How many images the transport may fill or hold ready."}, stream_buffers,
             {2, 1000});
  keys.whole(
      {"images_in_flight", "images", "How many further images the recorder and the pipeline may hold at a time."},
      images_in_flight, {1, 10'000});
}

bool visit_pixel_format(Keys& keys, const Key& key, PixelFormat& format) {
  return keys.choice(key, format,
                     {{name(PixelFormat::Mono8), PixelFormat::Mono8},
                      {name(PixelFormat::BayerRG8), PixelFormat::BayerRG8},
                      {name(PixelFormat::BayerBG8), PixelFormat::BayerBG8},
                      {name(PixelFormat::BayerGR8), PixelFormat::BayerGR8},
                      {name(PixelFormat::BayerGB8), PixelFormat::BayerGB8},
                      {name(PixelFormat::Rgb8), PixelFormat::Rgb8}});
}

void GenicamConfig::visit_all(Keys& keys) {
  visit(keys);
  constexpr Range side{0, 65535};
  keys.whole({"width", "px", "The width of the camera's region."}, width, side);
  keys.whole({"height", "px", "The height of the camera's region."}, height, side);
  keys.whole({"offset_x", "px", "The first column of the region."}, offset_x, side);
  keys.whole({"offset_y", "px", "The first row of the region."}, offset_y, side);
  visit_pixel_format(keys, {"pixel_format", "", "The pixel format that the camera sends."}, pixel_format);
  keys.whole({"socket_buffer_bytes", "bytes", "The size of the socket's buffer."}, socket_buffer_bytes, {0, 1 << 30});
  keys.duration({"give_up_after_ms", "ms", "How long an image waits for its missing packets."}, give_up_after,
                {10, 10'000});
}

std::string GenicamConfig::to_text() const {
  GenicamConfig copy = *this;
  return write_config({[&copy](Keys& keys) { copy.visit_all(keys); }, {}});
}

Result<GenicamConfig> GenicamConfig::from_text(std::string_view text) {
  GenicamConfig out;
  if (Status read = read_config(text, {[&out](Keys& keys) { out.visit_all(keys); }, {}}); !read.ok())
    return read.error();
  return out;
}

KeyError GenicamConfig::validate() const {
  GenicamConfig copy = *this;
  if (KeyError wrong = check_group({[&copy](Keys& keys) { copy.visit_all(keys); }, {}}); !wrong.empty()) return wrong;
  if (address.empty() && id.empty() && serial.empty())
    return {"serial", "is missing, and so are address and id; allowed: at least one of them, to name the camera"};
  if (!interface.empty() && !is_ipv4(address))
    return {"interface", fmt::format("needs an address; address is '{}'; allowed: an IPv4 address", address)};
  if ((width == 0) != (height == 0)) return {"width", "and height go together; allowed: both or neither"};
  if (width == 0 && (offset_x || offset_y)) return {"offset_x", "and offset_y need width and height"};
  if (auto_exposure && !chunks)
    return {
        "auto_exposure",
        "is true and chunks is false; allowed: true only with chunks: true, in which the camera reports its exposures"};
  if (frame_rate_hz > 0 && !trigger_source.empty())
    return {"trigger_source", "and frame_rate_hz exclude each other; allowed: one of them"};
  if (packet_size != 0 && packet_size < 576)
    return not_allowed("packet_size", std::to_string(packet_size), "0, or 576 to 16000 bytes");
  return {};
}

}  // namespace hueline::drivers
