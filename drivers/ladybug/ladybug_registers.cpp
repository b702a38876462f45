#include "drivers/ladybug/ladybug_registers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace hueline::drivers {
namespace {

// Addresses of IEEE 1394, and offsets from the command registers (IIDC 1.31, chapter 4).
constexpr std::uint64_t kInitialSpace = 0xFFFF'F000'0000, kCommands = 0xFFFF'F0F0'0000;
constexpr std::uint32_t kModesOfFormat7 = 0x19C, kFormat7Registers = 0x2E0, kStrobeRegisters = 0x48C, kMode = 0x604,
                        kFormat = 0x608, kPower = 0x610, kStream = 0x614;
// Features. The place of a feature's absolute values stands kToAbsolute before it.
constexpr std::uint32_t kShutter = 0x81C, kGain = 0x820, kTrigger = 0x830, kFrameRate = 0x83C, kToAbsolute = 0x100;
// Registers of Point Grey.
constexpr std::uint32_t kPinDirection = 0x11F8, kJpeg = 0x1E80, kSerial = 0x1F20;
// Registers of a mode of Format 7, from where kFormat7Registers says.
constexpr std::uint32_t kLargestSize = 0x000, kPosition = 0x008, kSize = 0x00C, kTotalBytesHigh = 0x038,
                        kTotalBytesLow = 0x03C, kPacketLimits = 0x040, kPacketBytes = 0x044, kPackets = 0x048,
                        kValueSetting = 0x07C;
constexpr std::uint32_t kStrobeControl = 0x200;

constexpr std::uint32_t kIsThere = 0x8000'0000, kAbsolute = 0x4000'0000, kBegin = 0x4000'0000, kOn = 0x0200'0000,
                        kIsHigh = 0x0100'0000, kSizeIsWrong = 0x0080'0000, kPacketIsWrong = 0x0040'0000;
constexpr std::uint32_t kFormat7 = 7;
constexpr double kStrobeTicks_Hz = 1.024e6;
constexpr double kNearEnough = 0.01, kNearEnough_dB = 0.1;
constexpr int kLooks = 50;
constexpr std::chrono::milliseconds kBetweenLooks{10};

/// The steps of set_up(). A step that fails is the last; status() is its error.
class Setup {
 public:
  explicit Setup(RegisterAccess& camera) : camera_(camera) {}

  const Status& status() const { return status_; }
  void refuse(std::string why) {
    if (status_.ok()) status_ = Error{ErrorCode::Invalid, "camera: " + std::move(why)};
  }

  /// Returns 0 after an error.
  std::uint32_t read(std::uint64_t address) {
    if (!status_.ok()) return 0;
    const auto value = camera_.read(address);
    if (value) return *value;
    fail(address, value.error());
    return 0;
  }
  void write(std::uint64_t address, std::uint32_t value) {
    if (!status_.ok()) return;
    if (const Status written = camera_.write(address, value); !written) fail(address, written.error());
  }
  /// Returns whether a register says that the camera has what it is for, and refuses `name` if not.
  bool is_there(std::uint64_t address, const char* name) {
    if (!status_.ok()) return false;
    if ((read(address) & kIsThere) != 0) return true;
    refuse(fmt::format("has no {}", name));
    return false;
  }

  void set_mode(std::uint32_t mode);
  std::size_t set_region(const LadybugSettings& settings);
  /// `value` is what the rig says, `unit` how many of its units are one of the camera's.
  void set_absolute(std::uint32_t feature, const char* key, double value, double unit, double tolerance);
  void set_trigger(const LadybugSettings& settings);
  void set_strobe(const LadybugSettings& settings);
  void set_jpeg(std::uint32_t quality);

 private:
  void fail(std::uint64_t address, const Error& error) {
    status_ = Error{error.code, fmt::format("camera: {} (register 0x{:X})", error.message, address - kCommands)};
  }
  /// Lets the camera check the values of a mode, if it wants to be asked.
  void apply(std::uint64_t mode);

  RegisterAccess& camera_;
  Status status_;
  std::uint32_t mode_ = 0;
};

void Setup::set_mode(std::uint32_t mode) {
  mode_ = mode;
  const std::uint32_t modes = read(kCommands + kModesOfFormat7);
  if (!status_.ok()) return;
  if ((modes << mode & kIsThere) == 0) {
    std::string has;
    for (std::uint32_t i = 0; i < 8; ++i)
      if ((modes << i & kIsThere) != 0) has += fmt::format("{}{}", has.empty() ? "" : ", ", i);
    return refuse(fmt::format("video_mode is {}; this camera has {}", mode, has.empty() ? "none" : has));
  }
  write(kCommands + kFormat, kFormat7 << 29U);
  write(kCommands + kMode, mode << 29U);
  const std::uint32_t format = read(kCommands + kFormat) >> 29U, now = read(kCommands + kMode) >> 29U;
  if (format != kFormat7 || now != mode)
    refuse(fmt::format("stays in format {}, mode {}, though format 7, mode {} was set", format, now, mode));
}

void Setup::apply(std::uint64_t mode) {
  if ((read(mode + kValueSetting) & kIsThere) == 0) return;
  write(mode + kValueSetting, kBegin);
  for (int look = 0; look < kLooks && status_.ok(); ++look) {
    if ((read(mode + kValueSetting) & kBegin) == 0) return;
    std::this_thread::sleep_for(kBetweenLooks);
  }
  refuse("does not end to check the region of its mode");
}

std::size_t Setup::set_region(const LadybugSettings& settings) {
  const std::uint64_t mode = kInitialSpace + std::uint64_t{read(kCommands + kFormat7Registers + 4 * mode_)} * 4;
  const std::uint32_t largest = read(mode + kLargestSize);
  const std::uint32_t width = settings.buffer_width ? settings.buffer_width : largest >> 16U,
                      height = settings.buffer_height ? settings.buffer_height : largest & 0xFFFFU;
  if (width > largest >> 16U || height > (largest & 0xFFFFU))
    refuse(fmt::format("buffer_width and buffer_height are {} x {}; the largest of its mode {} are {} x {}", width,
                       height, mode_, largest >> 16U, largest & 0xFFFFU));
  write(mode + kPosition, 0);
  write(mode + kSize, width << 16U | height);
  apply(mode);
  if ((read(mode + kValueSetting) & kSizeIsWrong) != 0 || read(mode + kSize) != (width << 16U | height))
    refuse(fmt::format("did not take a region of {} x {}", width, height));

  const std::uint32_t limits = read(mode + kPacketLimits), recommended = read(mode + kPacketBytes) & 0xFFFFU;
  const std::uint32_t packet = settings.packet_bytes ? settings.packet_bytes
                               : recommended         ? recommended
                                                     : limits & 0xFFFFU;
  const std::uint32_t unit = limits >> 16U;
  if (packet == 0 || packet > (limits & 0xFFFFU) || (unit > 0 && packet % unit != 0))
    refuse(fmt::format("packet_bytes is {}; allowed: multiples of {} to {}", packet, unit, limits & 0xFFFFU));
  write(mode + kPacketBytes, packet << 16U);
  apply(mode);
  if ((read(mode + kValueSetting) & kPacketIsWrong) != 0 || read(mode + kPacketBytes) >> 16U != packet)
    refuse(fmt::format("did not take packets of {} bytes", packet));

  const std::uint64_t total = std::uint64_t{read(mode + kTotalBytesHigh)} << 32U | read(mode + kTotalBytesLow),
                      in_packets = std::uint64_t{read(mode + kPackets)} * packet;
  const std::uint64_t bytes = std::max(total, in_packets);
  constexpr std::uint64_t kMostBytes = 256u << 20;
  if (status_.ok() && (bytes == 0 || bytes > kMostBytes))
    refuse(fmt::format("announces {} bytes for an image; 1 to {} are read", bytes, kMostBytes));
  return static_cast<std::size_t>(bytes);
}

void Setup::set_absolute(std::uint32_t feature, const char* key, double value, double unit, double tolerance) {
  if (!is_there(kCommands + feature, fmt::format("register for {}", key).c_str())) return;
  const std::uint64_t place = kInitialSpace + std::uint64_t{read(kCommands + feature - kToAbsolute)} * 4;
  if (status_.ok() && place == kInitialSpace)
    return refuse(fmt::format("takes {} in numbers of its own only: leave it out and use `registers`", key));
  const auto number = [&](std::uint32_t at) { return double{std::bit_cast<float>(read(place + at))} * unit; };
  const double least = number(0), most = number(4);
  if (status_.ok() && !(value >= least - tolerance && value <= most + tolerance))
    return refuse(fmt::format("{} is {:g}; this camera allows {:g} to {:g}", key, value, least, most));
  write(kCommands + feature, kIsThere | kAbsolute | kOn);
  write(place + 8, std::bit_cast<std::uint32_t>(static_cast<float>(value / unit)));
  const double taken = number(8);
  if (status_.ok() && !(std::abs(taken - value) <= tolerance))
    refuse(fmt::format("made {:g} of {} {:g}: write that into the rig", taken, key, value));
}

void Setup::set_trigger(const LadybugSettings& settings) {
  if (!settings.trigger_pin) {
    // A camera without trigger runs freely anyway.
    if ((read(kCommands + kTrigger) & kIsThere) != 0) write(kCommands + kTrigger, kIsThere);
    return;
  }
  if (!is_there(kCommands + kTrigger, "trigger (trigger_pin)")) return;
  const std::uint32_t high = settings.trigger_edge == LadybugSettings::Edge::Rising ? kIsHigh : 0;
  const std::uint32_t wanted = kIsThere | kOn | high | *settings.trigger_pin << 21U;
  write(kCommands + kTrigger, wanted);
  // Pin and polarity; the value at the pin is in between.
  constexpr std::uint32_t kSet = kOn | kIsHigh | 7U << 21U;
  if ((read(kCommands + kTrigger) & kSet) != (wanted & kSet) && status_.ok())
    refuse(fmt::format("did not take trigger_pin {} with that edge", *settings.trigger_pin));
}

void Setup::set_strobe(const LadybugSettings& settings) {
  if (!settings.strobe_pin) return;
  const std::uint32_t pin = *settings.strobe_pin;
  const std::uint32_t place = read(kCommands + kStrobeRegisters);
  if (status_.ok() && place == 0) return refuse("has no strobe (strobe_pin)");
  const std::uint64_t control = kInitialSpace + std::uint64_t{place} * 4 + kStrobeControl + 4 * pin;
  if (!is_there(control, fmt::format("strobe at pin {} (strobe_pin)", pin).c_str())) return;
  const auto ticks = static_cast<std::uint32_t>(std::lround(to_seconds(settings.strobe_duration) * kStrobeTicks_Hz));
  const std::uint32_t high = settings.strobe_edge == LadybugSettings::Edge::Rising ? kIsHigh : 0;
  write(kCommands + kPinDirection, read(kCommands + kPinDirection) | kIsThere >> pin);
  write(control, kIsThere | kOn | high | ticks);
  if (read(control) != (kIsThere | kOn | high | ticks) && status_.ok())
    refuse(fmt::format("did not take the strobe at pin {}", pin));
}

void Setup::set_jpeg(std::uint32_t quality) {
  if (!is_there(kCommands + kJpeg, "JPEG (jpeg_quality)")) return;
  write(kCommands + kJpeg, kIsThere | kOn | quality);
  if ((read(kCommands + kJpeg) & 0xFFU) != quality && status_.ok())
    refuse(fmt::format("did not take jpeg_quality {}", quality));
}

}  // namespace

Result<std::uint32_t> read_serial(RegisterAccess& camera) { return camera.read(kCommands + kSerial); }

Status set_streaming(RegisterAccess& camera, bool is_on) {
  return camera.write(kCommands + kStream, is_on ? kIsThere : 0);
}

Result<std::size_t> set_up(RegisterAccess& camera, const LadybugSettings& settings) {
  Setup setup(camera);
  setup.write(kCommands + kStream, 0);
  setup.write(kCommands + kPower, kIsThere);
  setup.set_mode(settings.video_mode);
  if (settings.jpeg_quality > 0) setup.set_jpeg(settings.jpeg_quality);
  const std::size_t bytes = setup.set_region(settings);
  setup.set_trigger(settings);
  if (settings.frame_rate_hz > 0)
    setup.set_absolute(kFrameRate, "frame_rate_hz", settings.frame_rate_hz, 1, kNearEnough * settings.frame_rate_hz);
  if (const double us = to_seconds(settings.exposure) * 1e6; us > 0)
    setup.set_absolute(kShutter, "exposure_us", us, 1e6, kNearEnough * us);
  if (settings.gain_dB) setup.set_absolute(kGain, "gain_db", *settings.gain_dB, 1, kNearEnough_dB);
  setup.set_strobe(settings);
  const auto further = parse_registers(settings.registers);
  if (!further) return further.error();
  for (const auto& [offset, value] : *further) setup.write(kCommands + offset, value);
  if (!setup.status().ok()) return setup.status().error();
  return bytes;
}

}  // namespace hueline::drivers
