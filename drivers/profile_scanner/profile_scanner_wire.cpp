#include "drivers/profile_scanner/profile_scanner_wire.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <string>
#include <utility>

namespace hueline::drivers {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers are read as they lie on the wire");

constexpr std::uint8_t kMostReturns = 15;
/// A datagram lasts less than a second, so the offsets of its returns fit easily into 32 bits of nanoseconds.
constexpr std::uint64_t kLongest_ps = 1'000'000'000'000;

template <class T>
T load(std::span<const std::byte> bytes, std::size_t at) {
  T out;
  std::memcpy(&out, bytes.data() + at, sizeof out);
  return out;
}

Error malformed_profile(std::string what) { return Error{ErrorCode::Malformed, std::move(what)}; }

}  // namespace

bool is_profile_datagram(std::span<const std::byte> d) {
  return d.size() >= kProfileHeaderBytes && load<std::uint32_t>(d, 0) == kProfileMagic;
}

Result<ProfileHeader> decode_profile_header(std::span<const std::byte> d) {
  if (!is_profile_datagram(d))
    return malformed_profile(fmt::format("datagram of {} bytes that does not begin with PRF1", d.size()));
  if (const auto version = load<std::uint8_t>(d, 4); version != kProfileVersion)
    return Error{ErrorCode::Unsupported,
                 fmt::format("version {} of the format; {} is known", version, kProfileVersion)};
  const auto kind = load<std::uint8_t>(d, 5);
  if (kind != 1 && kind != 2) return malformed_profile(fmt::format("kind {} is neither data (1) nor status (2)", kind));
  const auto length = load<std::uint16_t>(d, 12);
  if (length > d.size())
    return Error{ErrorCode::Truncated, fmt::format("cut short: says {} bytes, {} came", length, d.size())};
  if (length < d.size()) return malformed_profile(fmt::format("says {} bytes, {} came", length, d.size()));
  ProfileHeader out;
  out.kind = static_cast<ProfileKind>(kind);
  out.scanner = load<std::uint16_t>(d, 6);
  out.counter = load<std::uint32_t>(d, 8);
  const auto scale = load<std::uint8_t>(d, 14);
  if (scale > 2) return malformed_profile(fmt::format("time scale {} is not known", scale));
  out.scale = static_cast<ProfileTimeScale>(scale);
  out.second = load<std::uint32_t>(d, 16);
  out.nanosecond = load<std::uint32_t>(d, 20);
  if (out.nanosecond >= 1'000'000'000)
    return malformed_profile(fmt::format("{} ns is beyond the second", out.nanosecond));
  return out;
}

Result<ProfileData> decode_profile_data(std::span<const std::byte> d) {
  if (d.size() < kProfileDataBytes)
    return malformed_profile(fmt::format("data of {} bytes; its head alone has {}", d.size(), kProfileDataBytes));
  ProfileData out;
  out.line = load<std::uint32_t>(d, 24);
  out.angle = load<std::uint32_t>(d, 28);
  out.angle_step = load<std::int32_t>(d, 32);
  out.period_ps = load<std::uint32_t>(d, 36);
  const std::size_t pulses = load<std::uint16_t>(d, 40), returns = load<std::uint16_t>(d, 42);
  if (d.size() != kProfileDataBytes + pulses + kProfileReturnBytes * returns)
    return malformed_profile(fmt::format("{} pulses and {} returns do not fill {} bytes", pulses, returns, d.size()));
  if (pulses * std::uint64_t{out.period_ps} >= kLongest_ps)
    return malformed_profile(fmt::format("{} pulses {} ps apart last a second or more", pulses, out.period_ps));
  out.counts = d.subspan(kProfileDataBytes, pulses);
  out.returns = d.subspan(kProfileDataBytes + pulses);
  std::size_t counted = 0;
  std::uint8_t most = 0;
  for (const std::byte count : out.counts) {
    counted += static_cast<std::uint8_t>(count);
    most = std::max(most, static_cast<std::uint8_t>(count));
  }
  if (most > kMostReturns)
    return malformed_profile(fmt::format("a pulse of {} returns; {} is the most", most, kMostReturns));
  if (counted != returns)
    return malformed_profile(fmt::format("its pulses have {} returns, but {} follow", counted, returns));
  return out;
}

Result<ProfileStatus> decode_profile_status(std::span<const std::byte> d) {
  if (d.size() != kProfileStatusBytes)
    return malformed_profile(fmt::format("status of {} bytes; {} expected", d.size(), kProfileStatusBytes));
  ProfileStatus out;
  const auto flags = load<std::uint8_t>(d, 25);
  out.pps = pulse_status(load<std::uint8_t>(d, 24));
  out.has_label = (flags & 1U) != 0;
  out.is_label_valid = (flags & 2U) != 0;
  out.edge_second = load<std::uint32_t>(d, 28);
  return out;
}

}  // namespace hueline::drivers
