#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "drivers/velodyne/velodyne_model.hpp"

namespace hueline::drivers {

/// Returns the factory byte of a data packet.
inline std::uint8_t velodyne_product(std::span<const std::byte> data) {
  return static_cast<std::uint8_t>(data[kVelodyneProductAt]);
}
/// Returns the name of the product with this factory byte, or "0x..." if it is not known. Sources: the makers' manuals.
std::string velodyne_product_name(std::uint8_t product);
/// Returns whether a data packet is one of an HDL-64E, which is not supported: half of its blocks belong to the
/// upper lasers (flag FF EE), half to the lower ones (FF DD). Instead of return mode and factory byte it sends one byte
/// of its status after the other, so any product may seem to stand there. Source: HDL-64E S3 User's Manual.
bool is_hdl64e(std::span<const std::byte> bytes);
/// Returns whether the timing of packets with this factory byte decides their model. It does not for a Puck Hi-Res,
/// which has the timing of a VLP-16 but other elevations.
bool is_told_by_timing(std::uint8_t product);

/// Recognises the model by the time between the stamps of data packets, which is the duration of their blocks: 1.327 ms
/// for a VLP-16 (and for a Puck Hi-Res, which it cannot tell from one), 0.553 ms for an HDL-32E, 0.664 ms for a
/// VLP-32C, 0.166 ms for a VLS-128, and less in dual-return mode. The factory byte alone is not enough, because VLP-16s
/// with old firmware send that of the HDL-32E. Thread safety: none; one thread calls all functions.
class VelodyneTiming {
 public:
  /// Takes a data packet, in the order of arrival.
  void add(std::span<const std::byte> bytes);
  /// Returns the model that at least `least` pairs of packets confirm, if at most a tenth as many confirm any other.
  /// Returns nothing if it is not known yet.
  std::optional<VelodyneModel> model(int least) const;

 private:
  std::optional<std::chrono::nanoseconds> last_;
  std::array<int, kVelodyneModels.size()> votes_{};  // by VelodyneModel
};

}  // namespace hueline::drivers
