#include "sim/devices/ladybug_registers.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace hueline::sim {
namespace {

namespace reg = ladybug_register;

constexpr std::uint32_t kBase = 0xF0F00000, kAll = 0xFFFFFFFF, kThere = 0x80000000;
// The tables that other registers point to, by their distance from 0xF0000000 in quadlets.
constexpr std::uint32_t kRegion = 0xF0F00A00, kShutterTable = 0xF0F00910, kGainTable = 0xF0F00920,
                        kRateTable = 0xF0F00960, kStrobeTable = 0xF0F01300;
constexpr std::uint32_t kSize = kRegion + 0x00C, kTotalHigh = kRegion + 0x038, kTotal = kRegion + 0x03C,
                        kLimits = kRegion + 0x040, kPacket = kRegion + 0x044, kPackets = kRegion + 0x048,
                        kSetting = kRegion + 0x07C;
constexpr std::uint32_t kUnit = 8, kMostPacket = 9792, kRecommended = 9600;

constexpr std::uint32_t place(std::uint32_t address) { return (address - 0xF0000000) / 4; }
constexpr std::uint32_t bits(float value) { return std::bit_cast<std::uint32_t>(value); }

}  // namespace

LadybugRegisters::LadybugRegisters(std::uint32_t serial) {
  const auto set = [&](std::uint32_t address, std::uint32_t value, std::uint32_t writable = 0) {
    values_[address] = value;
    writable_[address] = writable;
  };
  // The beginning of the configuration ROM, in which libraries look for the maker, the serial number and the place of
  // the command registers.
  const std::uint32_t rom = 0xF0000400;
  set(rom, 0x04040000);
  set(rom + 0x04, 0x31333934);  // "1394"
  set(rom + 0x08, 0x20000000);
  set(rom + 0x0C, 0x00B09D01);
  set(rom + 0x10, serial);
  set(rom + 0x14, 0x00020000);
  set(rom + 0x18, 0x0300B09D);
  set(rom + 0x1C, 0xD1000001);  // the unit directory
  set(rom + 0x20, 0x00030000);
  set(rom + 0x24, 0x1200A02D);  // IIDC
  set(rom + 0x28, 0x13000102);  // version 1.31, with the next
  set(rom + 0x2C, 0xD4000001);  // the directory of what depends on the unit
  set(rom + 0x30, 0x00040000);
  set(rom + 0x34, 0x40000000 | place(kBase));
  set(rom + 0x38, 0x81000003);
  set(rom + 0x3C, 0x82000006);
  set(rom + 0x40, 0x38000030);
  set(rom + 0x44, 0x00040000);  // "Point Gr"
  for (const std::uint32_t at : {0x48U, 0x4CU}) set(rom + at, 0);
  set(rom + 0x50, 0x48756500);  // "Hue"
  set(rom + 0x54, 0x00040000);
  for (const std::uint32_t at : {0x58U, 0x5CU}) set(rom + at, 0);
  set(rom + 0x60, 0x48656164);  // "Head"
  set(rom + 0x64, 0);

  set(kBase + 0x000, 0, kThere);
  set(kBase + 0x100, 0x01000000);  // Format 7 alone
  set(kBase + 0x19C, 0x01000000);  // of which mode 7 alone
  set(kBase + 0x2FC, place(kRegion));
  set(kBase + 0x400, 0x80000000);  // basic functions; absolute values are with each feature
  set(kBase + 0x404, 0x00000000);
  set(kBase + 0x408, 0x00000000);
  set(kBase + 0x48C, place(kStrobeTable));
  set(kBase + 0x600, 0, 0xE0000000);
  set(kBase + 0x604, 0, 0xE0000000);
  set(kBase + 0x608, 0, 0xE0000000);
  set(kBase + 0x60C, 0, 0xFF000000);
  set(kBase + 0x610, 0, kThere);
  set(reg::kStream, 0, kThere);
  set(kBase + 0x71C, place(kShutterTable));
  set(kBase + 0x720, place(kGainTable));
  set(kBase + 0x73C, place(kRateTable));
  for (const std::uint32_t feature : {0x81CU, 0x820U, 0x830U, 0x83CU})
    set(kBase + feature, kThere | 0x03000000, ~kThere);
  set(kShutterTable, bits(1e-5F));
  set(kShutterTable + 4, bits(2.0F));
  set(reg::kShutter_s, bits(0.008F), kAll);
  set(kGainTable, bits(-2.5F));
  set(kGainTable + 4, bits(18.0F));
  set(reg::kGain_dB, bits(0.0F), kAll);
  set(kRateTable, bits(1.0F));
  set(kRateTable + 4, bits(30.0F));
  set(reg::kFrameRate_Hz, bits(10.0F), kAll);
  set(reg::kPinDirection, 0, 0xF0000000);
  for (std::uint32_t pin = 0; pin < 2; ++pin) set(reg::kStrobe0 + 4 * pin, kThere, ~kThere);
  set(reg::kJpeg, kThere | 0x02000055, ~kThere);
  set(kBase + 0x1F20, serial);

  set(kRegion, kLargestWidth << 16U | kLargestHeight);
  set(kRegion + 0x004, 0x00080008);
  set(kRegion + 0x008, 0, kAll);
  set(kSize, kLargestWidth << 16U | kLargestHeight, kAll);
  set(kRegion + 0x010, 0, 0xFF000000);
  set(kRegion + 0x014, 0x80000000);  // Mono8
  set(kRegion + 0x034, 0);
  set(kTotalHigh, 0);
  set(kTotal, 0);
  set(kLimits, kUnit << 16U | kMostPacket);
  set(kPacket, kRecommended, 0xFFFF0000);
  set(kPackets, 0);
  set(kRegion + 0x054, 0x08000000);  // bits of a sample
  set(kRegion + 0x058, 0);           // colour filter
  set(kSetting, kThere, 0x40000000);
  check_region();
}

void LadybugRegisters::check_region() {
  const std::uint32_t size = values_[kSize], packet = values_[kPacket] >> 16U;
  const std::uint32_t width = size >> 16U, height = size & 0xFFFFU;
  const bool is_size = width > 0 && height > 0 && width <= kLargestWidth && height <= kLargestHeight;
  const bool is_packet = packet > 0 && packet <= kMostPacket && packet % kUnit == 0;
  values_[kSetting] = kThere | (is_size ? 0 : 0x00800000U) | (is_packet ? 0 : 0x00400000U);
  values_[kRegion + 0x034] = width * height;
  values_[kTotal] = width * height;
  values_[kPackets] = is_packet ? (width * height + packet - 1) / packet : 0;
}

std::optional<std::uint32_t> LadybugRegisters::read(std::uint32_t address) {
  if (address == kSetting && looks_ > 0 && --looks_ == 0) check_region();
  const auto found = values_.find(address);
  if (found == values_.end()) return std::nullopt;
  return found->second;
}

bool LadybugRegisters::write(std::uint32_t address, std::uint32_t value) {
  const auto found = values_.find(address);
  if (found == values_.end() || writable_[address] == 0) return false;
  found->second = (found->second & ~writable_[address]) | (value & writable_[address]);
  if (address == kSetting && (value & 0x40000000U) != 0) looks_ = 2;
  if (address == reg::kShutter_s) {
    const float us = std::bit_cast<float>(found->second) * 1e6F;
    found->second = bits(std::clamp(std::round(us / 10.0F) * 1e-5F, 1e-5F, 2.0F));
  }
  return true;
}

std::uint32_t LadybugRegisters::get(std::uint32_t address) const {
  const auto found = values_.find(address);
  return found == values_.end() ? 0 : found->second;
}

float LadybugRegisters::get_float(std::uint32_t address) const { return std::bit_cast<float>(get(address)); }

bool LadybugRegisters::is_streaming() const { return (get(reg::kStream) & kThere) != 0; }

std::uint32_t LadybugRegisters::image_bytes() const { return get(kTotal); }

}  // namespace hueline::sim
