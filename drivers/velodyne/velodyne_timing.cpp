#include "drivers/velodyne/velodyne_timing.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

namespace hueline::drivers {
namespace {

/// A Puck Hi-Res has the timing of a VLP-16.
constexpr std::array kTimed{VelodyneModel::Vlp16, VelodyneModel::Hdl32e, VelodyneModel::Vlp32c, VelodyneModel::Vls128};
constexpr int kMostVotes = 1'000'000;

}  // namespace

std::string velodyne_product_name(std::uint8_t product) {
  switch (product) {
    case 0x21:
      return "HDL-32E";
    case 0x22:
      return "VLP-16";
    case 0x23:
      return "Puck LITE";
    case 0x24:
      return "Puck Hi-Res";
    case 0x28:
      return "VLP-32C";
    case 0x31:
      return "Velarray";
    case 0xA1:
      return "VLS-128";
    default:
      return fmt::format("0x{:02X}", product);
  }
}

bool is_hdl64e(std::span<const std::byte> bytes) {
  if (bytes.size() != kVelodyneDataBytes) return false;
  int upper = 0, lower = 0;
  for (std::size_t at = 0; at < kVelodyneStampAt; at += kVelodyneStampAt / kVelodyneBlocks) {
    if (bytes[at] != std::byte{0xFF}) return false;
    upper += bytes[at + 1] == std::byte{0xEE} ? 1 : 0;
    lower += bytes[at + 1] == std::byte{0xDD} ? 1 : 0;
  }
  return upper == kVelodyneBlocks / 2 && lower == kVelodyneBlocks / 2;
}

bool is_told_by_timing(std::uint8_t product) {
  constexpr std::uint8_t kPuckLite = 0x23;  // a lighter VLP-16
  return product == velodyne_table(VelodyneModel::Vlp16).product_id ||
         product == velodyne_table(VelodyneModel::Hdl32e).product_id || product == kPuckLite ||
         velodyne_product_name(product).starts_with("0x");
}

void VelodyneTiming::add(std::span<const std::byte> bytes) {
  if (bytes.size() != kVelodyneDataBytes) return;
  std::uint32_t stamp_us = 0;
  for (std::size_t i = 0; i < 4; ++i) stamp_us |= static_cast<std::uint32_t>(bytes[kVelodyneStampAt + i]) << (8 * i);
  const std::chrono::nanoseconds stamp = std::chrono::microseconds(stamp_us);
  if (last_) {
    const auto step = stamp - *last_;
    for (const VelodyneModel model : kTimed) {
      const auto duration = velodyne_table(model).packet_period(bytes[kVelodyneModeAt] == std::byte{kVelodyneDual});
      int& votes = votes_[static_cast<std::size_t>(model)];
      // Stamps are whole microseconds, so a step may be off by a little.
      if (std::chrono::abs(step - duration) <= duration / 100 && votes < kMostVotes) ++votes;
    }
  }
  last_ = stamp;
}

std::optional<VelodyneModel> VelodyneTiming::model(int least) const {
  const auto most = std::ranges::max_element(votes_);
  if (*most < least || std::reduce(votes_.begin(), votes_.end()) - *most > *most / 10) return {};
  return static_cast<VelodyneModel>(most - votes_.begin());
}

}  // namespace hueline::drivers
