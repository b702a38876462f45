#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/result.hpp"
#include "sim/devices/camera_image.hpp"

namespace hueline::sim {

constexpr const char* kCameraMaker = "hueline";
constexpr const char* kCameraModel = "Emulated";

/// Register addresses: the bootstrap registers of GigE Vision, and those of the features as the description states
/// them.
namespace camera_register {
constexpr std::uint32_t kMaker = 0x048, kModel = 0x068, kVersion = 0x088, kMakerInformation = 0x0A8, kSerial = 0x0D8;
constexpr std::uint32_t kWidth = 0x10000, kHeight = 0x10004, kOffsetX = 0x10008, kOffsetY = 0x1000C,
                        kSensorWidth = 0x10010, kSensorHeight = 0x10014;
constexpr std::uint32_t kPixelFormat = 0x10018, kAcquisition = 0x1001C, kAcquisitionMode = 0x10020,
                        kFrameRateMilliHz = 0x10024;
constexpr std::uint32_t kTriggerMode = 0x10028, kTriggerSource = 0x1002C, kTriggerActivation = 0x10030;
constexpr std::uint32_t kExposureUs = 0x10034, kGain = 0x10038, kGainAuto = 0x1003C;
// Automatic exposure and chunks. kChunkEnable has a word for each entry of the selector: exposure, gain.
constexpr std::uint32_t kExposureAuto = 0x10040, kExposureLimitUs = 0x10044, kChunkMode = 0x10048,
                        kChunkSelector = 0x1004C, kChunkEnable = 0x10050;
constexpr std::uint32_t kHeartbeatTimeoutMs = 0x938, kPrivilege = 0xA00;
constexpr std::uint32_t kStreamPort = 0xD00, kStreamPacketSize = 0xD04, kStreamPacketDelay = 0xD08,
                        kStreamAddress = 0xD18;
// Values of kPixelFormat: the numbers of the Pixel Format Naming Convention.
constexpr std::uint32_t kMono8 = 0x01080001, kBayerGR8 = 0x01080008, kBayerRG8 = 0x01080009, kBayerGB8 = 0x0108000A,
                        kBayerBG8 = 0x0108000B;
}  // namespace camera_register

/// Returns the chunks that the registers ask for; `get` returns the value of a register.
template <class Get>
CameraChunks chunks_of(Get&& get, bool is_big_endian) {
  return {.is_active = get(camera_register::kChunkMode) != 0,
          .has_exposure = get(camera_register::kChunkEnable) != 0,
          .has_gain = get(camera_register::kChunkEnable + 4) != 0,
          .is_big_endian = is_big_endian,
          .exposure_ns = std::int64_t{get(camera_register::kExposureUs)} * 1000};
}

/// Returns the number of a pixel format that the emulated cameras have: BayerRG8, BayerBG8, BayerGR8, BayerGB8 or
/// Mono8.
std::optional<std::uint32_t> pixel_format_number(const std::string& name);

/// The memory of a GigE Vision camera: its registers and its GenICam description (camera_description.hpp). Thread
/// safety: none.
class CameraRegisters {
 public:
  struct Config {
    std::string serial = "HL01";            ///< 1 .. 15 characters; the device is called "hueline-Emulated-<serial>"
    std::uint32_t width = 0, height = 0;    ///< size of the sensor and of the initial region, pixels
    std::string pixel_format = "BayerRG8";  ///< BayerRG8, BayerBG8, BayerGR8, BayerGB8 or Mono8
    std::uint32_t max_packet_bytes = 9000;  ///< including IP and UDP headers
    std::uint32_t ipv4 = 0;                 ///< the camera's own address, host byte order
    bool reports_exposure = false;          ///< whether it offers its exposure and gain as chunks
    std::string validate() const;
  };

  /// Creates the memory. Errors: Invalid (configuration).
  static Result<std::unique_ptr<CameraRegisters>> create(const Config& config);

  /// Reads or writes a range. Returns false and does nothing if the range is not in the camera's memory (first the
  /// registers, then the description, which is read-only).
  bool read(std::uint32_t address, std::span<std::byte> out) const;
  bool write(std::uint32_t address, std::span<const std::byte> bytes);
  /// Returns the value of a register, 0 if there is no such register.
  std::uint32_t get(std::uint32_t address) const;
  void set(std::uint32_t address, std::uint32_t value);

 private:
  explicit CameraRegisters(std::vector<std::byte> memory) : memory_(std::move(memory)) {}
  std::vector<std::byte> memory_;  // registers, then the description
};

}  // namespace hueline::sim
