#include "sim/devices/u3v_registers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "sim/devices/camera_description.hpp"

namespace hueline::sim {
namespace {

namespace camera = camera_register;
namespace u3v = u3v_register;

// ABRM (GenCP 1.3, table of bootstrap registers).
constexpr std::uint32_t kGencpVersion = 0x000, kCapability = 0x1C4, kResponseMs = 0x1CC, kManifestAddress = 0x1D0,
                        kSbrmAddress = 0x1D8, kConfiguration = 0x1E0, kNsPerTick = 0x1FC;
constexpr std::uint64_t kHasSbrm = 1U << 4U;
// SBRM (USB3 Vision 1.0).
constexpr std::uint32_t kSbrm = 0x1000;
constexpr std::uint32_t kU3vVersion = kSbrm, kMostCommand = kSbrm + 0x14, kMostAcknowledge = kSbrm + 0x18,
                        kStreams = kSbrm + 0x1C, kSirmAddress = kSbrm + 0x20, kSirmBytes = kSbrm + 0x28,
                        kSpeed = kSbrm + 0x40;
constexpr std::uint32_t kIsSuperSpeed = 1U << 3U;
// SIRM.
constexpr std::uint32_t kStreamLeaderBytes = u3v::kStream + 0x10, kStreamTrailerBytes = u3v::kStream + 0x14,
                        kStreamSizes = u3v::kStream + 0x18, kStreamEnd = u3v::kStream + 0x30;

constexpr std::uint32_t kManifest = 0x3000;
constexpr std::uint32_t kFeatures = 0x10000, kFeaturesEnd = 0x11000;
constexpr std::size_t kSerialBytes = 16;

struct Range {
  std::uint32_t begin, end;
};
constexpr Range kWritable[] = {{kConfiguration, kConfiguration + 8},
                               {u3v::kStreamControl, u3v::kStreamControl + 4},
                               {kStreamSizes, kStreamEnd},
                               {kFeatures, kFeaturesEnd}};

void put_text(std::vector<std::byte>& memory, std::uint32_t at, std::string_view text) {
  std::memcpy(memory.data() + at, text.data(), text.size());
}

}  // namespace

std::string U3vRegisters::Config::validate() const {
  if (serial.empty() || serial.size() >= kSerialBytes)
    return fmt::format("serial: '{}' must have 1 .. 15 characters", serial);
  if (width == 0 || height == 0 || width > 65535 || height > 65535)
    return fmt::format("width, height: {} x {} is not within 1 .. 65535", width, height);
  if (!pixel_format_number(pixel_format))
    return fmt::format("pixel_format: '{}' is none of BayerRG8, BayerBG8, BayerGR8, BayerGB8, Mono8", pixel_format);
  return {};
}

Result<std::unique_ptr<U3vRegisters>> U3vRegisters::create(const Config& config) {
  if (std::string problem = config.validate(); !problem.empty()) return Error{ErrorCode::Invalid, std::move(problem)};
  const std::string xml = camera_description(CameraTransport::Usb3Vision, config.reports_exposure);
  std::vector<std::byte> memory(kFeaturesEnd + xml.size());
  put_text(memory, kFeaturesEnd, xml);
  put_text(memory, u3v::kMaker, kCameraMaker);
  put_text(memory, u3v::kModel, kCameraModel);
  put_text(memory, u3v::kVersion, "1");
  put_text(memory, u3v::kMakerInformation, "a simulated vehicle's camera");
  put_text(memory, u3v::kSerial, config.serial);

  std::unique_ptr<U3vRegisters> registers(new U3vRegisters(std::move(memory)));
  registers->set(kGencpVersion, 0x0001'0003);
  registers->set_long(kCapability, kHasSbrm);
  registers->set(kResponseMs, config.response_ms);
  registers->set_long(kManifestAddress, kManifest);
  registers->set_long(kSbrmAddress, kSbrm);
  registers->set_long(kNsPerTick, 1);
  registers->set(kU3vVersion, 0x0001'0000);
  registers->set(kMostCommand, kMostMessageBytes);
  registers->set(kMostAcknowledge, kMostMessageBytes);
  registers->set(kStreams, 1);
  registers->set_long(kSirmAddress, u3v::kStream);
  registers->set(kSirmBytes, kStreamEnd - u3v::kStream);
  registers->set(kSpeed, kIsSuperSpeed);
  registers->set(kStreamLeaderBytes, kU3vLeaderBytes);
  registers->set(kStreamTrailerBytes, kU3vTrailerBytes);
  // The manifest: one description of GenApi schema 1.1, not compressed.
  registers->set_long(kManifest, 1);
  registers->set(kManifest + 8, 0x0100'0000);
  registers->set(kManifest + 12, 0x0101'0000);
  registers->set_long(kManifest + 16, kFeaturesEnd);
  registers->set_long(kManifest + 24, xml.size());

  registers->set(camera::kSensorWidth, config.width);
  registers->set(camera::kSensorHeight, config.height);
  registers->set(camera::kWidth, config.width);
  registers->set(camera::kHeight, config.height);
  registers->set(camera::kPixelFormat, *pixel_format_number(config.pixel_format));
  registers->set(camera::kAcquisitionMode, 1);
  registers->set(camera::kFrameRateMilliHz, 10'000);
  registers->set(camera::kExposureUs, 10'000);
  registers->set(camera::kGainAuto, 1);
  registers->set(camera::kExposureAuto, 1);
  registers->set(camera::kExposureLimitUs, 100'000);
  return registers;
}

GencpStatus U3vRegisters::read(std::uint64_t address, std::span<std::byte> out) {
  if (address >= memory_.size() || out.size() > memory_.size() - address) return GencpStatus::InvalidAddress;
  set_long(u3v::kPayloadBytes, payload_bytes());
  std::copy_n(memory_.begin() + static_cast<std::ptrdiff_t>(address), out.size(), out.begin());
  return GencpStatus::Success;
}

GencpStatus U3vRegisters::write(std::uint64_t address, std::span<const std::byte> bytes) {
  if (address >= memory_.size() || bytes.size() > memory_.size() - address) return GencpStatus::InvalidAddress;
  const auto holds = [&](const Range& range) {
    return address >= range.begin && address < range.end && bytes.size() <= range.end - address;
  };
  if (std::ranges::none_of(kWritable, holds)) return GencpStatus::WriteProtected;
  std::ranges::copy(bytes, memory_.begin() + static_cast<std::ptrdiff_t>(address));
  return GencpStatus::Success;
}

std::uint32_t U3vRegisters::get(std::uint32_t address) const {
  if (address + 4 > memory_.size()) return 0;
  std::uint32_t value = 0;
  for (std::uint32_t i = 0; i < 4; ++i) value |= std::to_integer<std::uint32_t>(memory_[address + i]) << 8U * i;
  return value;
}

void U3vRegisters::set(std::uint32_t address, std::uint32_t value) {
  for (std::uint32_t i = 0; i < 4; ++i) memory_[address + i] = static_cast<std::byte>(value >> 8U * i & 0xffU);
}

void U3vRegisters::set_long(std::uint32_t address, std::uint64_t value) {
  set(address, static_cast<std::uint32_t>(value));
  set(address + 4, static_cast<std::uint32_t>(value >> 32U));
}

CameraRegion U3vRegisters::region() const {
  return {.width = get(camera::kWidth),
          .height = get(camera::kHeight),
          .offset_x = get(camera::kOffsetX),
          .offset_y = get(camera::kOffsetY)};
}

std::uint64_t U3vRegisters::payload_bytes() const {
  const CameraRegion part = region();
  return std::uint64_t{part.width} * part.height + chunks().size();  // all formats have one byte a pixel
}

CameraChunks U3vRegisters::chunks() const {
  return chunks_of([this](std::uint32_t address) { return get(address); }, false);
}

}  // namespace hueline::sim
