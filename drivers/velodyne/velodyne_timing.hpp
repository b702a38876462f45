#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include "drivers/velodyne/velodyne_model.hpp"

namespace hueline::drivers {

/// Name of the product that the last factory byte of a data packet stands for; "0x..." if it is not known. Sources: the
/// makers' manuals.
std::string velodyne_product_name(std::uint8_t product);
/// Whether a packet with this factory byte is of the model that its timing says. Not so of a Puck Hi-Res, which is
/// timed as a VLP-16 and looks elsewhere.
bool is_told_by_timing(std::uint8_t product);

/// Tells the model by how far apart the stamps of data packets are, which is how long twelve blocks take: 1.327 ms of a
/// VLP-16, 0.553 ms of an HDL-32E, half of it in dual-return mode. The factory byte alone cannot: VLP-16s of old
/// firmware bear that of the HDL-32E. Reentrant.
class VelodyneTiming {
 public:
  /// A data packet, in order of arrival.
  void add(std::span<const std::byte> bytes);
  /// The model that at least `least` pairs of packets speak for, and hardly any against it. Empty: not known.
  std::optional<VelodyneModel> model(int least) const;

 private:
  std::optional<std::chrono::nanoseconds> last_;
  std::array<int, 2> votes_{};  // by VelodyneModel
};

}  // namespace hueline::drivers
