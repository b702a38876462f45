#pragma once

#include <cstdint>
#include <map>
#include <optional>

/// The registers of the emulated Ladybug.
namespace hueline::sim {

/// Addresses of registers (their lowest 32 bits) that tests ask for.
namespace ladybug_register {
constexpr std::uint32_t kStream = 0xF0F00614, kTrigger = 0xF0F00830, kPinDirection = 0xF0F011F8, kStrobe0 = 0xF0F01500,
                        kJpeg = 0xF0F01E80, kShutter_s = 0xF0F00918, kGain_dB = 0xF0F00928, kFrameRate_Hz = 0xF0F00968;
}  // namespace ladybug_register

/// Registers by the specification IIDC 1.31 and Point Grey's reference, as a Ladybug would hold them: one mode of
/// Format 7 (7) with a region of bytes, absolute values for shutter, gain and frame rate, JPEG quality, a trigger and
/// strobes. The shutter keeps multiples of 10 us. A register that does not exist, or may not be written, is refused.
/// Thread safety: none.
class LadybugRegisters {
 public:
  static constexpr std::uint32_t kLargestWidth = 2448, kLargestHeight = 4000;
  explicit LadybugRegisters(std::uint32_t serial);

  std::optional<std::uint32_t> read(std::uint32_t address);
  bool write(std::uint32_t address, std::uint32_t value);
  /// Returns the value of a register, or 0.
  std::uint32_t get(std::uint32_t address) const;
  float get_float(std::uint32_t address) const;
  bool is_streaming() const;
  /// Returns the bytes of the region, which the camera sends for each image.
  std::uint32_t image_bytes() const;

 private:
  void check_region();

  std::map<std::uint32_t, std::uint32_t> values_;
  std::map<std::uint32_t, std::uint32_t> writable_;  // the bits of each register that a host may change
  int looks_ = 0;                                    // of a host, until the region is checked
};

}  // namespace hueline::sim
