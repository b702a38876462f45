#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/result.hpp"
#include "sim/devices/camera_image.hpp"
#include "sim/devices/camera_registers.hpp"
#include "sim/devices/u3v_encode.hpp"

namespace hueline::sim {

/// Register addresses of the emulated USB3 Vision camera: the technology agnostic bootstrap registers of GenCP (ABRM),
/// and the registers of USB3 Vision (SBRM) and of the stream (SIRM), which may lie anywhere. The features have the
/// addresses of camera_register.
namespace u3v_register {
constexpr std::uint32_t kMaker = 0x004, kModel = 0x044, kVersion = 0x0C4, kMakerInformation = 0x104, kSerial = 0x144;
constexpr std::uint32_t kStream = 0x2000;
constexpr std::uint32_t kStreamControl = kStream + 0x04, kPayloadBytes = kStream + 0x08;
}  // namespace u3v_register

/// The memory of a USB3 Vision camera: its registers and its GenICam description (camera_description.hpp). Little
/// endian. Thread safety: none.
class U3vRegisters {
 public:
  struct Config {
    std::string serial = "HL02";            ///< 1 .. 15 characters
    std::uint32_t width = 0, height = 0;    ///< size of the sensor and of the initial region, pixels
    std::string pixel_format = "BayerRG8";  ///< BayerRG8, BayerBG8, BayerGR8, BayerGB8 or Mono8
    std::uint32_t response_ms = 200;        ///< the longest time that the camera says it takes for an answer
    bool reports_exposure = false;          ///< whether it offers its exposure and gain as chunks
    std::string validate() const;
  };
  /// Size of the largest acknowledge and command.
  static constexpr std::uint32_t kMostMessageBytes = 1024;

  /// Creates the memory. Errors: Invalid (configuration).
  static Result<std::unique_ptr<U3vRegisters>> create(const Config& config);

  /// Reads or writes a range. A range that is not in the memory is InvalidAddress, one that a client may not write is
  /// WriteProtected; nothing is done then.
  GencpStatus read(std::uint64_t address, std::span<std::byte> out);
  GencpStatus write(std::uint64_t address, std::span<const std::byte> bytes);
  /// Returns the value of a register, 0 if there is no such register.
  std::uint32_t get(std::uint32_t address) const;
  void set(std::uint32_t address, std::uint32_t value);
  /// Returns the region, and the bytes of an image with its chunks, that the features ask for.
  CameraRegion region() const;
  std::uint64_t payload_bytes() const;
  /// Returns the chunks that the client has asked for.
  CameraChunks chunks() const;

 private:
  explicit U3vRegisters(std::vector<std::byte> memory) : memory_(std::move(memory)) {}
  void set_long(std::uint32_t address, std::uint64_t value);
  std::vector<std::byte> memory_;  // registers, then the description
};

}  // namespace hueline::sim
