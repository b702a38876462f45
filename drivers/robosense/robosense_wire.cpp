#include "drivers/robosense/robosense_wire.hpp"

#include <algorithm>
#include <chrono>
#include <numbers>

#include "drivers/azimuth_directions.hpp"

namespace hueline::drivers {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180;
constexpr std::array<unsigned, 8> kPoints{0x55, 0xAA, 0x05, 0x0A, 0x5A, 0xA5, 0x50, 0xA0};
constexpr std::array<unsigned, 4> kHeliosPoints{0x55, 0xAA, 0x05, 0x5A};
constexpr std::array<unsigned, 8> kDescription{0xA5, 0xFF, 0x00, 0x5A, 0x11, 0x11, 0x55, 0x55};
constexpr unsigned kSlowestRpm = 60;
constexpr std::size_t kSecondBlockAt = 142;
constexpr std::size_t kTimeAt = 20, kModelAt = 30, kVersionAt = 32;
constexpr std::size_t kSpeedAt = 8, kWindowAt = 32, kReturnsAt = 300, kSyncAt = 301, kReversedAt = 337, kGpsAt = 357;
constexpr std::size_t kElevationsAt = 468, kAzimuthsAt = 564, kRs16ElevationsAt = 1165;

/// Firings of equal spacing.
constexpr std::array<float, kRobosenseChannels> spaced(float step_us) {
  std::array<float, kRobosenseChannels> out{};
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = step_us * static_cast<float>(i);
  return out;
}
/// 16 beams that fire twice in a block.
constexpr std::array<float, kRobosenseChannels> twice(float step_us, float period_us) {
  std::array<float, kRobosenseChannels> out{};
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = step_us * static_cast<float>(i % 16) + (i < 16 ? 0 : period_us);
  return out;
}

// The range unit of the models before Helios is that of today's firmware.
constexpr std::array<RobosenseTable, 6> kTables{{
    {RobosenseModel::Rs16, "RS-LiDAR-16", 16, 0.005, 0.03825, 0, 55.5, twice(2.8f, 55.5f)},
    {RobosenseModel::Rs32, "RS-LiDAR-32", 32, 0.005, 0.03997, 0, 55.52, {0.00f,  2.88f,  5.76f,  8.64f,  11.52f, 14.40f,
                                                                         17.28f, 20.16f, 23.04f, 25.92f, 28.80f, 31.68f,
                                                                         34.56f, 37.44f, 40.32f, 44.64f, 1.44f,  4.32f,
                                                                         7.20f,  10.08f, 12.96f, 15.84f, 18.72f, 21.60f,
                                                                         24.48f, 27.36f, 30.24f, 33.12f, 36.00f, 38.88f,
                                                                         41.76f, 46.08f}},
    {RobosenseModel::Bpearl, "RS-Bpearl", 32, 0.005, 0.01473, 0.09427, 55.52, {0.00f,  2.56f,  5.12f,  7.68f,  10.24f,
                                                                               12.80f, 15.36f, 17.92f, 25.68f, 28.24f,
                                                                               30.80f, 33.36f, 35.92f, 38.48f, 41.04f,
                                                                               43.60f, 1.28f,  3.84f,  6.40f,  8.96f,
                                                                               11.52f, 14.08f, 16.64f, 19.20f, 26.96f,
                                                                               29.52f, 32.08f, 34.64f, 37.20f, 39.76f,
                                                                               42.32f, 44.88f}},
    {RobosenseModel::Bpearl4, "RS-Bpearl 4", 32, 0.0025, 0.01619, 0.09571, 55.56, spaced(1.668f)},
    {RobosenseModel::Helios, "RS-Helios", 32, 0.0025, 0.03498, 0, 55.56, spaced(1.73f)},
    {RobosenseModel::Helios16, "RS-Helios-16P", 16, 0.0025, 0.03498, 0, 55.56, twice(1.73f, 55.56f)},
}};

template <std::size_t N>
bool begins(std::span<const std::byte> bytes, const std::array<unsigned, N>& signature) {
  if (bytes.size() != kRobosenseBytes) return false;
  for (std::size_t i = 0; i < N; ++i)
    if (robosense_u8(bytes, i) != signature[i]) return false;
  return true;
}

/// A calibrated angle, or nothing.
std::optional<double> angle(std::span<const std::byte> bytes, std::size_t at, double unit_deg) {
  if (robosense_u8(bytes, at) == 0xFF) return {};
  const double deg = unit_deg * robosense_u16(bytes, at + 1);
  if (deg > 180) return {};
  return (robosense_u8(bytes, at) == 0 ? deg : -deg) * kRadPerDeg;
}

bool has_two_clocks(RobosenseModel model) {
  return model == RobosenseModel::Helios || model == RobosenseModel::Helios16 || model == RobosenseModel::Bpearl4;
}

/// Reads the angles of `beams` beams. Beams without one, or all at one angle, are no calibration.
bool read_angles(std::span<const std::byte> bytes, std::size_t beams, double unit_deg, RobosenseDescription& out) {
  for (std::size_t beam = 0; beam < beams; ++beam) {
    const auto elevation = angle(bytes, kElevationsAt + 3 * beam, unit_deg);
    const auto azimuth = angle(bytes, kAzimuthsAt + 3 * beam, unit_deg);
    if (!elevation || !azimuth) return false;
    out.elevations.push_back(*elevation);
    out.azimuths.push_back(*azimuth);
  }
  return std::ranges::any_of(out.elevations, [&](double e) { return e != out.elevations[0]; });
}

bool read_rs16_angles(std::span<const std::byte> bytes, RobosenseDescription& out) {
  for (std::size_t beam = 0; beam < 16; ++beam) {
    const std::size_t at = kRs16ElevationsAt + 3 * beam;
    const double deg = 1e-4 * (robosense_u8(bytes, at) << 16 | robosense_u16(bytes, at + 1));
    if (deg > 90) return false;
    out.elevations.push_back((beam < 8 ? -deg : deg) * kRadPerDeg);
    out.azimuths.push_back(0);
  }
  return std::ranges::any_of(out.elevations, [&](double e) { return e != out.elevations[0]; });
}

}  // namespace

const RobosenseTable& robosense_table(RobosenseModel model) {
  return *std::ranges::find(kTables, model, &RobosenseTable::model);
}

bool is_robosense_points(std::span<const std::byte> bytes) {
  return begins(bytes, kPoints) || begins(bytes, kHeliosPoints);
}

bool has_robosense_signature(std::span<const std::byte> bytes) {
  constexpr std::size_t kLeastPacket = 200;
  if (bytes.size() < kLeastPacket || robosense_u16(bytes, 0) != 0x55AA) return false;
  const unsigned rest = robosense_u16(bytes, 2);
  return rest == 0x050A || rest == 0x055A || rest == 0x5AA5;
}

bool is_robosense_description(std::span<const std::byte> bytes) { return begins(bytes, kDescription); }

std::optional<RobosenseModel> robosense_model(std::span<const std::byte> bytes) {
  // The Airy has the same signature and larger blocks.
  if (begins(bytes, kHeliosPoints))
    return robosense_u16(bytes, kSecondBlockAt) == 0xFFEE ? std::optional(RobosenseModel::Helios) : std::nullopt;
  if (!begins(bytes, kPoints)) return {};
  for (const std::size_t at : {kModelAt + 1, kModelAt}) {
    if (robosense_u8(bytes, at) == 1) return RobosenseModel::Rs16;
    if (robosense_u8(bytes, at) == 2) return RobosenseModel::Rs32;
    if (robosense_u8(bytes, at) == 3)
      return robosense_u8(bytes, kVersionAt) == 4 ? RobosenseModel::Bpearl4 : RobosenseModel::Bpearl;
  }
  return {};
}

std::optional<RobosenseDescription> decode_robosense_description(std::span<const std::byte> bytes,
                                                                 RobosenseModel& model) {
  if (!is_robosense_description(bytes)) return {};
  RobosenseDescription out;
  // A scanner that starts or stands still sends 0. No model turns so slowly that a packet would last for seconds.
  if (const unsigned rpm = robosense_u16(bytes, kSpeedAt); rpm >= kSlowestRpm) out.revolutions_hz = rpm / 60.0;
  const unsigned first = robosense_u16(bytes, kWindowAt), last = robosense_u16(bytes, kWindowAt + 2);
  const unsigned seen = (last > first ? last : last + kAzimuthsOfCircle) - first;
  out.blind_rad = seen < kAzimuthsOfCircle ? (kAzimuthsOfCircle - seen) * 0.01 * kRadPerDeg : 0;
  out.is_dual = robosense_u8(bytes, kReturnsAt) == 0;
  const bool is_bpearl = model == RobosenseModel::Bpearl || model == RobosenseModel::Bpearl4;
  out.is_reversed = is_bpearl && robosense_u8(bytes, kReversedAt) != 0;
  using Clock = RobosenseDescription::Clock;
  if (has_two_clocks(model))
    out.clock = robosense_u8(bytes, kSyncAt + 1) == 1   ? Clock::Receiver
                : robosense_u8(bytes, kSyncAt + 1) == 2 ? Clock::Ptp
                                                        : Clock::Free;
  else
    out.clock = robosense_u8(bytes, kGpsAt) == 1 ? Clock::Receiver : Clock::Free;

  if (model == RobosenseModel::Rs16) return read_rs16_angles(bytes, out) ? std::optional(out) : std::nullopt;
  const double unit = model == RobosenseModel::Rs32 ? 0.001 : 0.01;
  RobosenseDescription all = out;
  const bool has_all = read_angles(bytes, 32, unit, all);
  if (model != RobosenseModel::Helios && model != RobosenseModel::Helios16)
    return has_all ? std::optional(all) : std::nullopt;
  // A Helios of 16 beams leaves the places of the others empty.
  const bool has_more = has_all && std::any_of(all.elevations.begin() + 16, all.elevations.end(),
                                               [&](double e) { return e != all.elevations[31]; });
  model = has_more ? RobosenseModel::Helios : RobosenseModel::Helios16;
  if (has_more) return all;
  return read_angles(bytes, 16, unit, out) ? std::optional(out) : std::nullopt;
}

std::optional<UnixTime> decode_robosense_time(std::span<const std::byte> bytes, RobosenseModel model) {
  using namespace std::chrono;
  if (has_two_clocks(model)) {
    std::uint64_t second = 0, microsecond = 0;
    for (std::size_t i = 0; i < 6; ++i) second = second << 8 | robosense_u8(bytes, kTimeAt + i);
    for (std::size_t i = 6; i < 10; ++i) microsecond = microsecond << 8 | robosense_u8(bytes, kTimeAt + i);
    if (second > 4'294'967'295u || microsecond > 999'999) return {};
    return UnixTime(seconds(static_cast<std::int64_t>(second)) + microseconds(static_cast<std::int64_t>(microsecond)));
  }
  const auto at = [&](std::size_t i) { return robosense_u8(bytes, kTimeAt + i); };
  const year_month_day date{year(2000 + static_cast<int>(at(0))), month(at(1)), day(at(2))};
  const unsigned millisecond = robosense_u16(bytes, kTimeAt + 6), microsecond = robosense_u16(bytes, kTimeAt + 8);
  if (!date.ok() || at(3) > 23 || at(4) > 59 || at(5) > 59 || millisecond > 999 || microsecond > 999) return {};
  return UnixTime(sys_days(date).time_since_epoch() + hours(at(3)) + minutes(at(4)) + seconds(at(5)) +
                  milliseconds(millisecond) + microseconds(microsecond));
}

}  // namespace hueline::drivers
