#include "drivers/novatel/messages.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/angle.hpp"
#include "core/calendar.hpp"
#include "core/geodesy.hpp"

namespace hueline::drivers {
namespace {

constexpr double kMaxClockOffsetS = 1e-6;

/// Reads six doubles from `offset`: north, east, up velocity (m/s), then roll, pitch, azimuth (degrees).
bool read_motion(std::span<const std::byte> body, std::size_t offset, InsSolution& out) {
  out.velocity_enu = {field<double>(body, offset + 8), field<double>(body, offset), field<double>(body, offset + 16)};
  out.attitude.roll = field<double>(body, offset + 24) * kRadPerDeg;
  out.attitude.pitch = field<double>(body, offset + 32) * kRadPerDeg;
  out.attitude.heading = field<double>(body, offset + 40) * kRadPerDeg;
  return out.velocity_enu.allFinite() && std::abs(out.attitude.roll) <= 7 && std::abs(out.attitude.pitch) <= 7 &&
         std::abs(out.attitude.heading) <= 7;
}

/// Reads nine floats from `offset`: the sigmas of latitude, longitude, height, north, east, up, roll, pitch, azimuth.
std::optional<std::array<double, 9>> read_sigma(std::span<const std::byte> body, std::size_t offset) {
  constexpr std::array<std::size_t, 9> kWireIndex{1, 0, 2, 4, 3, 5, 6, 7, 8};  // our order has east before north
  std::array<double, 9> sigma{};
  for (std::size_t i = 0; i < 9; ++i) {
    const double value = static_cast<double>(field<float>(body, offset + 4 * kWireIndex[i]));
    if (!(value >= 0) || !std::isfinite(value)) return {};
    sigma[i] = i < 6 ? value : value * kRadPerDeg;
  }
  return sigma;
}

Geodetic read_place(std::span<const std::byte> body, std::size_t offset, double undulation) {
  return {field<double>(body, offset) * kRadPerDeg, field<double>(body, offset + 8) * kRadPerDeg,
          field<double>(body, offset + 16) + undulation};
}

/// Returns whether a solution may be given: its numbers are possible, or its status says that they mean nothing yet.
bool may_give(bool has_motion, InsSolution& out) {
  if (has_ins_attitude(out.status)) return has_motion && is_on_earth(out.position);
  if (!has_motion) {
    out.velocity_enu.setZero();
    out.attitude = {};
  }
  return true;
}

bool header_is_fine(const NovatelHeader& header) { return header.time_status && is_fine(*header.time_status); }

}  // namespace

std::optional<GpsTime> novatel_time(std::uint32_t week, double seconds) {
  if (week == 0 || week >= 10000 || !(seconds >= 0) || !(seconds < static_cast<double>(kSecondsPerWeek))) return {};
  return from_gps_week(static_cast<int>(week), from_seconds(seconds));
}

std::optional<GpsTime> header_time(const NovatelHeader& header) {
  if (header.week == 0 || header.week >= 10000 || header.milliseconds >= kSecondsPerWeek * 1000) return {};
  return from_gps_week(header.week, std::chrono::milliseconds(header.milliseconds));
}

bool is_good_ins_status(std::uint32_t status) { return status == 3 || status == 6; }
std::string ins_status_name(std::uint32_t status) {
  constexpr std::array<std::string_view, 13> names{"inactive",
                                                   "aligning",
                                                   "high variance",
                                                   "good",
                                                   "",
                                                   "",
                                                   "good, GNSS rejected",
                                                   "alignment complete, not yet moved enough",
                                                   "determining orientation",
                                                   "waiting for a position",
                                                   "waiting for an azimuth",
                                                   "initialising biases",
                                                   "motion detected"};
  const std::string_view known = status < names.size() ? names[status] : "";
  return known.empty() ? fmt::format("status {}", status) : std::string(known);
}
bool has_ins_attitude(std::uint32_t status) { return status == 2 || status == 3 || status == 6 || status == 7; }

std::optional<InsSolution> decode_inspva(std::span<const std::byte> body) {
  const auto time = novatel_time(field<std::uint32_t>(body, 0), field<double>(body, 4));
  InsSolution out;
  out.status = field<std::uint32_t>(body, 84);
  out.position = read_place(body, 12, 0.0);
  if (!time || !may_give(read_motion(body, 36, out), out)) return {};
  out.time = *time;
  out.is_good = is_good_ins_status(out.status);
  return out;
}

std::optional<InsSolution> decode_inspvax(const NovatelHeader& header, std::span<const std::byte> body) {
  const auto time = header_time(header);
  InsSolution out;
  out.status = field<std::uint32_t>(body, 0);
  out.position = read_place(body, 8, static_cast<double>(field<float>(body, 32)));
  if (!time || !may_give(read_motion(body, 36, out), out)) return {};
  out.time = *time;
  out.is_good = is_good_ins_status(out.status);
  out.sigma = read_sigma(body, 84);
  return out;
}

std::optional<InsUncertainty> decode_insstdev(const NovatelHeader& header, std::span<const std::byte> body) {
  const auto time = header_time(header);
  const auto sigma = read_sigma(body, 0);
  if (!time || !sigma) return {};
  InsUncertainty out;
  out.time = *time;
  out.sigma = *sigma;
  return out;
}

std::optional<GnssFix> decode_bestpos(const NovatelHeader& header, std::span<const std::byte> body) {
  const auto time = header_time(header);
  GnssFix out;
  out.position = read_place(body, 8, static_cast<double>(field<float>(body, 32)));
  if (!time || !is_on_earth(out.position)) return {};
  out.time = *time;
  constexpr std::uint32_t kSolutionComputed = 0;
  if (field<std::uint32_t>(body, 0) == kSolutionComputed) out.type = fix_type(field<std::uint32_t>(body, 4));
  out.sigma_enu = {static_cast<double>(field<float>(body, 44)), static_cast<double>(field<float>(body, 40)),
                   static_cast<double>(field<float>(body, 48))};
  for (const double sigma : out.sigma_enu)
    if (!(sigma >= 0) || !std::isfinite(sigma)) return {};
  out.satellites = field<std::uint8_t>(body, 65);
  return out;
}

std::optional<DecodedTime> decode_time(const NovatelHeader& header, std::span<const std::byte> body) {
  using std::chrono::seconds;
  const auto time = header_time(header);
  if (!time) return {};
  DecodedTime out;
  out.label.second = GpsTime(std::chrono::floor<seconds>(time->time_since_epoch()));
  constexpr std::uint32_t kClockValid = 0, kUtcValid = 1;
  out.label.is_valid = header_is_fine(header) && field<std::uint32_t>(body, 0) == kClockValid;
  const double utc_minus_gps = field<double>(body, 20);
  if (field<std::uint32_t>(body, 40) != kUtcValid || !(std::abs(utc_minus_gps) < 1000)) return out;
  out.label.utc_offset = seconds(-std::lround(utc_minus_gps));

  const auto milliseconds = field<std::uint32_t>(body, 36);
  UtcTime utc{static_cast<int>(std::min(field<std::uint32_t>(body, 28), 9999u)),
              field<std::uint8_t>(body, 32),
              field<std::uint8_t>(body, 33),
              field<std::uint8_t>(body, 34),
              field<std::uint8_t>(body, 35),
              static_cast<int>(std::min(milliseconds / 1000, 99u)),
              static_cast<std::int32_t>(milliseconds % 1000) * 1'000'000};
  const auto by_calendar = from_utc(utc, out.label.utc_offset);
  out.contradicts_utc = !by_calendar || std::chrono::abs(*by_calendar - *time) > std::chrono::milliseconds(500);
  if (out.contradicts_utc) out.label.is_valid = false;
  return out;
}

std::optional<EventMark> decode_marktime(const NovatelHeader& header, int input, std::span<const std::byte> body) {
  const auto time = novatel_time(field<std::uint32_t>(body, 0), field<double>(body, 4));
  if (!time) return {};
  EventMark out;
  out.time = *time;
  out.input = input;
  constexpr std::uint32_t kClockValid = 0;
  out.is_valid = header_is_fine(header) && field<std::uint32_t>(body, 36) == kClockValid &&
                 std::abs(field<double>(body, 12)) <= kMaxClockOffsetS;
  return out;
}

std::optional<EventMark> decode_markpva(const NovatelHeader& header, int input, std::span<const std::byte> body) {
  const auto time = novatel_time(field<std::uint32_t>(body, 0), field<double>(body, 4));
  if (!time) return {};
  EventMark out;
  out.time = *time;
  out.input = input;
  out.is_valid = header_is_fine(header);
  return out;
}

FixType fix_type(std::uint32_t position_type) {
  switch (position_type) {
    case 1:
    case 2:
    case 16:
    case 19:
    case 53:
      return FixType::Single;  // FIXEDPOS, FIXEDHEIGHT, SINGLE, PROPAGATED, INS_PSRSP
    case 17:
    case 18:
    case 20:
    case 52:
    case 54:
      return FixType::Dgnss;  // PSRDIFF, WAAS, OMNISTAR, INS_SBAS, INS_PSRDIFF
    case 32:
    case 33:
    case 34:
    case 55:
      return FixType::RtkFloat;  // L1, IONOFREE, NARROW_FLOAT, INS_RTKFLOAT
    case 48:
    case 49:
    case 50:
    case 51:
    case 56:
      return FixType::RtkFixed;  // L1, WIDE, NARROW_INT, RTK_DIRECT_INS, INS_RTKFIXED
    case 64:
    case 65:
    case 66:
    case 67:
    case 68:
    case 69:
      return FixType::Ppp;  // OMNISTAR_HP, _XP and INS forms, PPP_CONVERGING, PPP
    case 73:
    case 74:
    case 77:
    case 78:
    case 79:
    case 80:
      return FixType::Ppp;  // INS_PPP(_CONVERGING), PPP_BASIC and INS forms
    default:
      return FixType::None;
  }
}

}  // namespace hueline::drivers
