#include "drivers/ladybug/ladybug_settings.hpp"

#include <fmt/format.h>

#include <charconv>
#include <sstream>

#include "drivers/guest/config_text.hpp"

namespace hueline::drivers {
namespace {

constexpr double kMostRegister = 4294967295.0;

/// Reads "0x1E80" or "0x82000050".
std::optional<std::uint32_t> hex_of(std::string_view text) {
  if (!text.starts_with("0x")) return std::nullopt;
  text.remove_prefix(2);
  std::uint32_t value = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), value, 16);
  if (text.empty() || read.ec != std::errc() || read.ptr != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace

Result<std::vector<std::pair<std::uint32_t, std::uint32_t>>> parse_registers(const std::string& text) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> out;
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    const std::size_t equals = word.find('=');
    const auto offset = hex_of(std::string_view(word).substr(0, equals));
    const auto value = equals == word.npos ? std::nullopt : hex_of(std::string_view(word).substr(equals + 1));
    if (!offset || !value || *offset % 4 != 0)
      return Error{ErrorCode::Malformed, fmt::format("'{}' is no register and value as 0x1E80=0x82000050", word)};
    out.emplace_back(*offset, *value);
  }
  return out;
}

void LadybugSettings::visit(Keys& keys) {
  const std::initializer_list<std::pair<const char*, Edge>> edges{{"rising", Edge::Rising}, {"falling", Edge::Falling}};
  keys.whole({"serial", "", "The serial number in the camera's register 0x1F20. Needed if there are several.",
              "0: the only one"},
             serial, {0, kMostRegister});
  keys.number({"gain_db", "dB", "The gain; automatic gain is turned off.", "camera's own"}, gain_dB, {-100, 100});
  keys.number(
      {"frame_rate_hz", "Hz", "The rate of a camera that runs freely. Not with `trigger_pin`.", "0: camera's own"},
      frame_rate_hz, {0, 1000});
  keys.whole({"jpeg_quality", "%", "The quality of the JPEGs.", "0: camera's own"}, jpeg_quality, {0, 100});
  keys.whole({"video_mode", "", "The mode of Format 7. It has to be one that sends JPEG planes of 8 bits."}, video_mode,
             {0, 7});
  keys.whole({"buffer_width", "px",
              "The width of the region of that mode. Together with `buffer_height` it sets the size of "
              "the buffer into which the JPEGs of an exposure have to fit.",
              "0: the largest"},
             buffer_width, {0, 65535});
  keys.whole({"buffer_height", "px", "The height of that region.", "0: the largest"}, buffer_height, {0, 65535});
  keys.whole(
      {"packet_bytes", "bytes", "BYTE_PER_PACKET of that mode, by which some models limit what they send in a second.",
       "0: as recommended"},
      packet_bytes, {0, 65535});
  keys.whole({"trigger_pin", "", "The GPIO pin that starts each exposure.", "the camera runs freely"}, trigger_pin,
             {0, 7});
  keys.choice({"trigger_edge", "", "The edge at that pin that starts an exposure."}, trigger_edge, edges);
  keys.whole({"strobe_pin", "", "The GPIO pin that tells the POS of each exposure.", "none"}, strobe_pin, {0, 3});
  keys.choice({"strobe_edge", "", "The edge at that pin with which an exposure begins."}, strobe_edge, edges);
  keys.duration({"strobe_duration_us", "us", "The length of the strobe.", "0: as long as the exposure"},
                strobe_duration, {0, 3999});
  keys.text({"registers", "",
             "Further registers as `0x1E80=0x82000050`, with spaces between; the offsets are those of "
             "the maker's register reference. They are written last.",
             "none"},
            registers);
  keys.whole({"transfer_mb", "MB",
              "The memory of the transfers that are under way. The kernel's usbfs_memory_mb has to "
              "allow it."},
             transfer_MB, {1, 200});
  keys.whole(
      {"images_in_flight", "images", "How many images the driver, the recorder and the pipeline may hold at a time."},
      images_in_flight, {2, 10'000});
}

void LadybugSettings::visit_all(Keys& keys) {
  visit(keys);
  keys.duration({"exposure_us", "us", "The exposure.", "0"}, exposure, {0, 1'000'000});
}

KeyError LadybugSettings::validate() const {
  LadybugSettings copy = *this;
  if (KeyError wrong = check_group({[&copy](Keys& keys) { copy.visit_all(keys); }, {}}); !wrong.empty()) return wrong;
  if (frame_rate_hz > 0 && trigger_pin)
    return {"trigger_pin", "and frame_rate_hz exclude each other; allowed: one of them"};
  if (strobe_pin && strobe_pin == trigger_pin)
    return {"strobe_pin", fmt::format("is {}, which is the trigger_pin; allowed: another pin", *strobe_pin)};
  if ((buffer_width == 0) != (buffer_height == 0))
    return {"buffer_width", "and buffer_height go together; allowed: both or neither"};
  if (const auto pairs = parse_registers(registers); !pairs) return {"registers", pairs.error().message};
  return {};
}

std::string LadybugSettings::to_text() const {
  LadybugSettings copy = *this;
  return write_config({[&copy](Keys& keys) { copy.visit_all(keys); }, {}});
}

Result<LadybugSettings> LadybugSettings::from_text(std::string_view text) {
  LadybugSettings out;
  if (Status read = read_config(text, {[&out](Keys& keys) { out.visit_all(keys); }, {}}); !read.ok())
    return read.error();
  return out;
}

}  // namespace hueline::drivers
