#pragma once

#include "drivers/stream/message_form.hpp"

/// NCOM, the output of OxTS inertial systems: packets of 72 bytes, little endian; numbers of 24 bits are signed.
///
///   offset  size  field
///        0     1  0xE7
///        1     2  time within the minute, ms
///        3     9  accelerations x, y, z, 24 bits each
///       12     9  angular rates x, y, z, 24 bits each
///       21     1  state of the navigation
///       22     1  sum of the bytes 1 to 21
///       23    16  latitude, longitude, rad
///       39     4  altitude, m
///       43     9  velocity north, east, down, 24 bits, 0.1 mm/s
///       52     9  heading, pitch, roll, 24 bits, 1e-6 rad
///       61     1  sum of the bytes 1 to 60
///       62     1  channel: what the next 8 bytes are
///       63     8  content of the channel
///       71     1  sum of the bytes 1 to 70
namespace hueline::drivers {

class NcomForm final : public MessageForm {
 public:
  static constexpr std::size_t kBytes = 72;
  Judgement judge(std::span<const std::byte> rest, std::uint64_t, bool) override {
    using Verdict = Judgement::Verdict;
    if (rest[0] != std::byte{0xE7}) return {};
    if (rest.size() < kBytes) return {Verdict::NeedMore, 0};
    unsigned sum = 0;
    for (std::size_t i = 1; i < kBytes; ++i) {
      // One byte is a weak sign of a packet: what fails the first sum is noise, not a broken packet.
      if ((i == 22 || i == 61 || i == 71) && static_cast<unsigned>(rest[i]) != (sum & 0xFF))
        return {i == 22 ? Verdict::Noise : Verdict::Broken, 0};
      sum += static_cast<unsigned>(rest[i]);
    }
    return {Verdict::Whole, kBytes};
  }
};

}  // namespace hueline::drivers
