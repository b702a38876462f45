#include "drivers/ladybug/ladybug_decoder.hpp"

#include <fmt/format.h>

#include <string>
#include <string_view>
#include <utility>

#include "core/calendar.hpp"
#include "drivers/gige/genicam_config.hpp"
#include "drivers/ladybug/ladybug_image.hpp"
#include "drivers/ladybug/pgr_source.hpp"

namespace hueline::drivers {
namespace {

Fault fault(const Packet& packet, FaultKind kind, std::uint64_t count, std::string detail) {
  return {packet.sensor, kind, packet.received, count, std::move(detail)};
}

}  // namespace

void LadybugDecoder::Config::visit(Keys& keys) {
  keys.whole(required("width", "px", "The width of the mosaic that the planes of all lenses make."), width, {1, 65535});
  keys.whole(required("height", "px", "The height of that mosaic."), height, {1, 65535});
  visit_pixel_format(keys,
                     required("pixel_format", "",
                              "The Bayer format of the mosaic: the order in which `plane_places` "
                              "puts the planes."),
                     pixel_format);
  planes.visit(keys);
  keys.choice(required("stamp", "",
                       "The stamp in the images that is the camera's time stamp. `utc`: seconds and microseconds of a "
                       "clock that is on UTC; `unix`: the same fields of a clock that nothing sets; `cycle`: the cycle "
                       "time of the bus (then `counter_wraps_s: 128`); `none`. Which of the first two holds depends on "
                       "the model and on what recorded, so there is no default."),
              stamp, {{"none", Stamp::None}, {"utc", Stamp::Utc}, {"unix", Stamp::Unix}, {"cycle", Stamp::Cycle}});
  keys.whole({"serial", "", "The serial number of the camera's head. An image of another head is not used.", "0: any"},
             serial, {0, 4294967295.0});
}

KeyError LadybugDecoder::Config::validate() const {
  if (KeyError wrong = check_keys(*this); !wrong.empty()) return wrong;
  if (pixel_format == PixelFormat::Mono8 || pixel_format == PixelFormat::Rgb8)
    return not_allowed("pixel_format", name(pixel_format), "BayerRG8, BayerBG8, BayerGR8 or BayerGB8");
  return planes.validate(width, height);
}

LadybugDecoder::LadybugDecoder(Config config) : config_(config), planes_(config.width, config.height, config.planes) {}

void LadybugDecoder::decode(const Packet& packet, std::vector<Measurement>& out) {
  const auto bytes = packet.bytes.bytes();
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const auto ignore = [&](const char* message) {
    ++counts_.of(message);
    counts_.ignored_bytes += bytes.size();
  };
  if (text.starts_with(kPgrMagic)) return ignore("StreamHead");
  if (text.starts_with(kPgrGpsSummary)) return ignore("GpsSummary");
  const auto head = read_ladybug_image(bytes);
  if (!head) {
    counts_.malformed_bytes += bytes.size();
    ++counts_.malformed_messages;
    out.push_back(fault(packet, FaultKind::Malformed, 1, head.error().message));
    return;
  }
  if (config_.serial != 0 && head->serial != config_.serial) {
    out.push_back(fault(
        packet, FaultKind::WrongDevice, 1,
        fmt::format("image {} is of the head {}; the rig names {}", head->sequence, head->serial, config_.serial)));
    return ignore("Image");
  }
  if (!follow(head->sequence, packet, out)) return ignore("Image");
  ++counts_.of("Image");

  Image image;
  image.sensor = packet.sensor;
  image.received = packet.received;
  image.packet_sequence = packet.sequence;
  image.frame_id = head->sequence;
  image.format = config_.pixel_format;
  image.is_complete = true;
  if (config_.stamp == Stamp::Cycle) image.time = DeviceTime<CameraCounter>(head->cycle_time);
  if (config_.stamp == Stamp::Utc || config_.stamp == Stamp::Unix)
    image.time = DeviceTime<CameraCounter>(head->unix_time);
  if (config_.stamp == Stamp::Utc)
    out.emplace_back(TimedArrival{packet.sensor, packet.received, from_unix(UnixTime(head->unix_time))});
  planes_.decode(bytes, packet, std::move(image), counts_, out);
}

bool LadybugDecoder::follow(std::uint32_t sequence, const Packet& packet, std::vector<Measurement>& out) {
  const auto last = std::exchange(last_sequence_, sequence);
  if (!last || sequence == *last + 1) return true;
  if (sequence == *last) {
    out.push_back(fault(packet, FaultKind::Spurious, 1, fmt::format("image {} came twice", sequence)));
    return false;
  }
  if (sequence > *last)
    out.push_back(fault(packet, FaultKind::Lost, sequence - *last - 1,
                        fmt::format("images lost between {} and {}", *last, sequence)));
  else
    out.push_back(fault(packet, FaultKind::Spurious, 1,
                        fmt::format("the sequence fell from {} to {}: the camera restarted", *last, sequence)));
  return true;
}

}  // namespace hueline::drivers
