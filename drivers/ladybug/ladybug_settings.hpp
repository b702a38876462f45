#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/keys.hpp"
#include "core/result.hpp"
#include "core/time.hpp"

namespace hueline::drivers {

/// The settings of a Ladybug on USB. Zero, empty and absent values leave the camera's own setting unchanged.
struct LadybugSettings {
  enum class Edge : std::uint8_t { Rising, Falling };

  std::uint32_t serial = 0;                           ///< of the camera's register; 0: the only Ladybug on USB
  nanoseconds exposure{0};                            ///< setting it turns automatic exposure off
  std::optional<double> gain_dB{};                    ///< setting it turns automatic gain off
  double frame_rate_hz = 0;                           ///< images a second without trigger
  std::uint32_t jpeg_quality = 0;                     ///< percent
  std::uint32_t video_mode = 7;                       ///< mode of Format 7
  std::uint32_t buffer_width = 0, buffer_height = 0;  ///< of the region of Format 7, pixels; 0: the largest
  std::uint32_t packet_bytes = 0;                     ///< BYTE_PER_PACKET of Format 7; 0: as the camera recommends
  std::optional<std::uint32_t> trigger_pin{};         ///< GPIO that starts each exposure; none: it runs freely
  Edge trigger_edge = Edge::Rising;
  std::optional<std::uint32_t> strobe_pin{};  ///< GPIO that tells of each exposure
  Edge strobe_edge = Edge::Rising;            ///< with which a strobe begins
  nanoseconds strobe_duration{0};             ///< 0: as long as the exposure
  std::string registers;  ///< further registers, written last: "0x1E80=0x82000050 0x12F8=0x80000001"

  std::uint32_t transfer_MB = 8;      ///< memory of the transfers that are under way
  std::size_t images_in_flight = 40;  ///< images that are read, and held by the recorder and the pipeline

  /// Declares the keys of a rig file, without the exposure.
  void visit(Keys& keys);
  KeyError validate() const;

  /// Returns all settings as text for the guest that runs the camera (drivers/guest/config_text.hpp).
  std::string to_text() const;
  /// Reads what to_text() wrote. Errors: Malformed, with the key that is wrong.
  static Result<LadybugSettings> from_text(std::string_view text);

 private:
  void visit_all(Keys& keys);
};

/// Returns the pairs of LadybugSettings::registers: offset from the camera's command registers, and value. Errors:
/// Malformed, with the text that is no such pair.
Result<std::vector<std::pair<std::uint32_t, std::uint32_t>>> parse_registers(const std::string& text);

}  // namespace hueline::drivers
