#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "core/result.hpp"

namespace hueline::sim {

/// Register addresses that the emulator acts upon: GigE Vision bootstrap registers and those of Aravis's fake camera.
namespace camera_register {
constexpr std::uint32_t kWidth = 0x100, kHeight = 0x104, kAcquisition = 0x124, kPixelFormat = 0x128;
constexpr std::uint32_t kOffsetX = 0x130, kOffsetY = 0x134;
constexpr std::uint32_t kHeartbeatTimeoutMs = 0x938, kPrivilege = 0xA00;
constexpr std::uint32_t kStreamPort = 0xD00, kStreamPacketSize = 0xD04, kStreamPacketDelay = 0xD08, kStreamAddress = 0xD18;
}  // namespace camera_register

/// The registers and the GenICam description of a GigE Vision camera: Aravis's fake camera class (ArvFakeCamera) with the size of
/// our images, and with the standard features by which a client finds the largest packet. Thread-bound.
class CameraRegisters {
 public:
  struct Config {
    std::string serial = "HL01";             ///< 1 .. 15 characters; the device is "Aravis-Fake-<serial>"
    std::uint32_t width = 0, height = 0;     ///< of the sensor and of the initial region, pixels
    std::string pixel_format = "BayerRG8";   ///< BayerRG8, BayerBG8, BayerGR8, BayerGB8 or Mono8
    std::uint32_t max_packet_bytes = 9000;   ///< with IP and UDP headers
    std::uint32_t ipv4 = 0;                  ///< own address, host byte order
    std::string validate() const;
  };

  /// Invalid: config. Io: the description could not be handed to Aravis (it reads a file).
  static Result<std::unique_ptr<CameraRegisters>> create(const Config& config);
  CameraRegisters();
  ~CameraRegisters();

  /// False, and nothing done, if the range is not in the camera's memory (registers, then the description, read only).
  bool read(std::uint32_t address, std::span<std::byte> out);
  bool write(std::uint32_t address, std::span<const std::byte> bytes);
  /// 0 if there is no such register.
  std::uint32_t get(std::uint32_t address);
  void set(std::uint32_t address, std::uint32_t value);

 private:
  struct Camera;
  std::unique_ptr<Camera> camera_;
};

}  // namespace hueline::sim
