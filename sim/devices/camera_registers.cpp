#include "sim/devices/camera_registers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <functional>

#include "sim/devices/big_endian.hpp"
#include "sim/devices/camera_description.hpp"

namespace hueline::sim {
namespace {

namespace reg = camera_register;

// Bootstrap registers that clients only read.
constexpr std::uint32_t kSpecification = 0x000, kDeviceMode = 0x004, kMacHigh = 0x008, kMacLow = 0x00C,
                        kCurrentIp = 0x024;
constexpr std::uint32_t kDescriptionUrl = 0x200, kInterfaces = 0x600, kStreams = 0x904, kGvcpCapability = 0x934,
                        kTickFrequencyLow = 0x940;
constexpr std::uint32_t kVersion1_2 = 0x0001'0002, kBigEndianUtf8 = 0x8000'0001, kNanoseconds = 1'000'000'000;
constexpr std::uint32_t kCanWriteMemory = 1U << 1U, kCanResendPackets = 1U << 2U;
constexpr std::size_t kSerialBytes = 16;
constexpr std::uint32_t kRegisterBytes = 0x11000;  // the description stands after the registers
constexpr std::uint32_t kHeartbeatMs = 3000, kFirstPacketBytes = 1400;

void put_text(std::vector<std::byte>& memory, std::uint32_t at, std::string_view text) {
  std::memcpy(memory.data() + at, text.data(), text.size());
}

}  // namespace

std::optional<std::uint32_t> pixel_format_number(const std::string& name) {
  constexpr std::array<std::pair<const char*, std::uint32_t>, 5> kFormats{{{"BayerRG8", reg::kBayerRG8},
                                                                           {"BayerBG8", reg::kBayerBG8},
                                                                           {"BayerGR8", reg::kBayerGR8},
                                                                           {"BayerGB8", reg::kBayerGB8},
                                                                           {"Mono8", reg::kMono8}}};
  for (const auto& [format, number] : kFormats) {
    if (name == format) return number;
  }
  return {};
}

std::string CameraRegisters::Config::validate() const {
  if (serial.empty() || serial.size() >= kSerialBytes)
    return fmt::format("serial: '{}' must have 1 .. 15 characters", serial);
  if (width == 0 || height == 0 || width > 65535 || height > 65535) {
    return fmt::format("width, height: {} x {} is not within 1 .. 65535", width, height);
  }
  if (!pixel_format_number(pixel_format)) {
    return fmt::format("pixel_format: '{}' is none of BayerRG8, BayerBG8, BayerGR8, BayerGB8, Mono8", pixel_format);
  }
  if (max_packet_bytes < 576 || max_packet_bytes > 65000) {
    return fmt::format("max_packet_bytes: {} is not within 576 .. 65000", max_packet_bytes);
  }
  return {};
}

Result<std::unique_ptr<CameraRegisters>> CameraRegisters::create(const Config& config) {
  if (std::string problem = config.validate(); !problem.empty()) return Error{ErrorCode::Invalid, std::move(problem)};
  const std::string xml =
      camera_description(CameraTransport::GigeVision, config.reports_exposure, config.max_packet_bytes);
  std::vector<std::byte> memory(kRegisterBytes + xml.size());
  put_text(memory, kRegisterBytes, xml);
  put_text(memory, reg::kMaker, kCameraMaker);
  put_text(memory, reg::kModel, kCameraModel);
  put_text(memory, reg::kVersion, "1");
  put_text(memory, reg::kMakerInformation, "a simulated vehicle's camera");
  put_text(memory, reg::kSerial, config.serial);
  put_text(memory, kDescriptionUrl, fmt::format("Local:hueline-camera.xml;{:x};{:x}", kRegisterBytes, xml.size()));

  std::unique_ptr<CameraRegisters> registers(new CameraRegisters(std::move(memory)));
  registers->set(kSpecification, kVersion1_2);
  registers->set(kDeviceMode, kBigEndianUtf8);
  registers->set(kInterfaces, 1);
  registers->set(kStreams, 1);
  registers->set(kTickFrequencyLow, kNanoseconds);
  registers->set(reg::kHeartbeatTimeoutMs, kHeartbeatMs);
  registers->set(reg::kStreamPacketSize, kFirstPacketBytes);
  registers->set(reg::kSensorWidth, config.width);
  registers->set(reg::kSensorHeight, config.height);
  registers->set(reg::kWidth, config.width);
  registers->set(reg::kHeight, config.height);
  registers->set(reg::kPixelFormat, *pixel_format_number(config.pixel_format));
  registers->set(reg::kAcquisitionMode, 1);
  registers->set(reg::kFrameRateMilliHz, 10'000);
  registers->set(reg::kExposureUs, 10'000);
  registers->set(reg::kGainAuto, 1);
  registers->set(reg::kExposureAuto, 1);
  registers->set(reg::kExposureLimitUs, 100'000);
  registers->set(kGvcpCapability, kCanWriteMemory | kCanResendPackets);
  registers->set(kCurrentIp, config.ipv4);
  // A locally administered MAC address, by which discovery distinguishes cameras.
  registers->set(kMacHigh, 0x0000'0248);
  registers->set(kMacLow, static_cast<std::uint32_t>(std::hash<std::string>{}(config.serial)));
  return registers;
}

bool CameraRegisters::read(std::uint32_t address, std::span<std::byte> out) const {
  if (out.empty() || address >= memory_.size()) return false;
  // Clients read the description in whole words. Bytes beyond its end are zero.
  const std::size_t there = std::min(out.size(), memory_.size() - address);
  std::memcpy(out.data(), memory_.data() + address, there);
  std::fill(out.begin() + static_cast<std::ptrdiff_t>(there), out.end(), std::byte{0});
  return true;
}

bool CameraRegisters::write(std::uint32_t address, std::span<const std::byte> bytes) {
  if (bytes.empty() || address >= kRegisterBytes || bytes.size() > kRegisterBytes - address) return false;
  std::memcpy(memory_.data() + address, bytes.data(), bytes.size());
  return true;
}

std::uint32_t CameraRegisters::get(std::uint32_t address) const {
  std::array<std::byte, 4> word{};
  return read(address, word) ? get_be32(word, 0) : 0;
}

void CameraRegisters::set(std::uint32_t address, std::uint32_t value) {
  Bytes word;
  put_be32(word, value);
  (void)write(address, word);
}

}  // namespace hueline::sim
