#include "drivers/xsens/xsens_decoder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "core/angle.hpp"
#include "core/calendar.hpp"
#include "core/geodesy.hpp"
#include "drivers/xsens/xbus_form.hpp"
#include "drivers/xsens/xsens_epoch.hpp"

namespace hueline::drivers {
namespace {

std::vector<std::unique_ptr<MessageForm>> xsens_forms() {
  std::vector<std::unique_ptr<MessageForm>> out;
  out.push_back(std::make_unique<XbusForm>());
  return out;
}

constexpr std::uint8_t kMtData2 = 0x36, kErrorMessage = 0x42;
/// The kinds of data that are read, without the bits of their format.
enum Data : std::uint16_t {
  kUtcTime = 0x1010,
  kPacketCounter = 0x1020,
  kQuaternion = 0x2010,
  kRotationMatrix = 0x2020,
  kEuler = 0x2030,
  kAcceleration = 0x4020,
  kAltitude = 0x5020,
  kPositionEcef = 0x5030,
  kLatLon = 0x5040,
  kGnssPvt = 0x7010,
  kRateOfTurn = 0x8020,
  kVelocity = 0xD010,
  kStatusWord = 0xE020,
};
enum Frame : int { kNed = 4, kNwu = 8 };  // else east, north, up

/// Up to nine numbers, or none.
struct Numbers {
  bool is_there = false;
  std::array<double, 9> values{};
  explicit operator bool() const { return is_there; }
  double operator[](std::size_t i) const { return values[i]; }
  Eigen::Vector3d vector() const { return {values[0], values[1], values[2]}; }
};

/// Reads `count` numbers in the format that the lowest two bits of the identifier name.
Numbers numbers(std::uint16_t id, std::span<const std::byte> data, std::size_t count) {
  constexpr std::size_t kSizes[] = {4, 4, 6, 8};  // float, fixed point 12.20, fixed point 16.32, double
  const std::size_t size = kSizes[id & 3];
  Numbers out;
  if (data.size() != size * count) return out;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t at = i * size;
    double& value = out.values[i];
    switch (id & 3) {
      case 0:
        value = static_cast<double>(stream_field_big<float>(data, at));
        break;
      case 1:
        value = static_cast<double>(stream_field_big<std::int32_t>(data, at)) / (1 << 20);
        break;
      case 2:  // the fraction comes before the whole part
        value = static_cast<double>(stream_field_big<std::int16_t>(data, at + 4)) +
                static_cast<double>(stream_field_big<std::uint32_t>(data, at)) / 4294967296.0;
        break;
      default:
        value = stream_field_big<double>(data, at);
    }
    if (!std::isfinite(value)) return {};
  }
  out.is_there = true;
  return out;
}

/// Takes a place in the Earth's frame, if it is one near the ground.
void take_ecef(const Eigen::Vector3d& place, XsensEpoch& epoch) {
  constexpr double kDeepest_m = 6.3e6, kHighest_m = 6.5e6;
  if (const double radius = place.norm(); !(radius > kDeepest_m && radius < kHighest_m)) return;
  const Geodetic found = to_geodetic(Point<Ecef>{place});
  epoch.latitude_deg = found.latitude / kRadPerDeg;
  epoch.longitude_deg = found.longitude / kRadPerDeg;
  epoch.height_m = found.ellipsoidal_height;
}

/// Returns UTC at `at` of the data: year, month, day, hour, minute, second.
UtcTime calendar(std::span<const std::byte> data, std::size_t at) {
  const auto u8 = [&](std::size_t i) { return static_cast<int>(data[at + i]); };
  return {stream_field_big<std::uint16_t>(data, at), u8(2), u8(3), u8(4), u8(5), u8(6), 0};
}

/// Returns the orientation that the numbers state, in the local frame that the identifier `id` names.
std::optional<Eigen::Quaterniond> orientation(std::uint16_t id, const Numbers& n) {
  switch (id & 0xFFF0) {
    case kQuaternion:
      return xsens_quaternion(n[0], n[1], n[2], n[3]);
    case kRotationMatrix: {
      // The matrix comes by its columns, the axes of the sensor.
      const Eigen::Matrix3d R = Eigen::Map<const Eigen::Matrix3d>(n.values.data());
      if (!(R * R.transpose()).isIdentity(0.01) || R.determinant() < 0) return std::nullopt;
      return Eigen::Quaterniond(R).normalized();
    }
    default:
      return xsens_euler(n[0], n[1], n[2]);
  }
}

Eigen::Matrix3d enu_from_nwu() {
  Eigen::Matrix3d out;
  out << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  return out;
}

}  // namespace

XsensDecoder::XsensDecoder(const Config&) : StreamDecoder(xsens_forms()) {}

void XsensDecoder::forget() {
  seconds_.forget();
  counter_.forget();
}

bool XsensDecoder::take(const Message& message) {
  const auto id = static_cast<std::uint8_t>(message.bytes[2]);
  const std::size_t header = message.bytes[3] == std::byte{255} ? 6 : 4;
  const auto data = message.bytes.subspan(header, message.bytes.size() - header - 1);
  name(id == kMtData2 ? "MTData2" : id == kErrorMessage ? "Error" : fmt::format("MID {:02X}", id));
  if (id == kErrorMessage && !data.empty())
    fault(FaultKind::Refused, message.received, 1,
          fmt::format("the device answered with error {}", static_cast<int>(data[0])));
  return id == kMtData2 && take_data(data, message.received);
}

bool XsensDecoder::take_data(std::span<const std::byte> data, HostTime received) {
  XsensEpoch epoch;
  bool is_used = false;
  while (data.size() >= 3) {
    const auto id = stream_field_big<std::uint16_t>(data, 0);
    const auto size = static_cast<std::size_t>(data[2]);
    if (data.size() < 3 + size) break;
    const auto value = data.subspan(3, size);
    data = data.subspan(3 + size);
    const int frame = id & 0x0C;
    switch (id & 0xFFF0) {
      case kUtcTime:
        // The bits of the last byte: the date, the time of day and the leap seconds are valid.
        if (size == 12 && (static_cast<unsigned>(value[11]) & 7) == 7)
          if (const auto whole = from_utc(calendar(value, 4)))
            epoch.time = *whole + nanoseconds(std::min(stream_field_big<std::uint32_t>(value, 0), 999'999'999u));
        break;
      case kPacketCounter:
        if (size == 2) count(stream_field_big<std::uint16_t>(value, 0), received);
        break;
      case kQuaternion:
      case kRotationMatrix:
      case kEuler: {
        const int kind = id & 0xFFF0;
        const auto found = numbers(id, value, kind == kQuaternion ? 4 : kind == kRotationMatrix ? 9 : 3);
        fault_once(frame == kNed, is_ned_, FaultKind::Implausible, received,
                   "the orientation is in north-east-down, whose axes depend on the device's settings: not used; set "
                   "the output to ENU or NWU");
        if (!found || frame == kNed) break;
        const auto q = orientation(id, found);
        if (!q) break;
        epoch.R_enu_sensor = frame == kNwu ? Eigen::Quaterniond(enu_from_nwu() * q->toRotationMatrix()) : *q;
        break;
      }
      case kAcceleration:
        if (const auto found = numbers(id, value, 3)) epoch.acceleration = found.vector();
        break;
      case kRateOfTurn:
        if (const auto found = numbers(id, value, 3)) epoch.rate = found.vector();
        break;
      case kAltitude:
        if (const auto found = numbers(id, value, 1)) epoch.height_m = found[0];
        break;
      case kLatLon:
        if (const auto found = numbers(id, value, 2)) {
          epoch.latitude_deg = found[0];
          epoch.longitude_deg = found[1];
        }
        break;
      case kPositionEcef:
        if (const auto found = numbers(id, value, 3); found && !epoch.latitude_deg) take_ecef(found.vector(), epoch);
        break;
      case kVelocity:
        if (const auto found = numbers(id, value, 3)) {
          const Eigen::Vector3d v = found.vector();
          epoch.velocity_enu = frame == kNed   ? Eigen::Vector3d(v.y(), v.x(), -v.z())
                               : frame == kNwu ? Eigen::Vector3d(-v.y(), v.x(), v.z())
                                               : v;
        }
        break;
      case kStatusWord:
        if (size == 4) epoch.status = stream_field_big<std::uint32_t>(value, 0);
        break;
      case kGnssPvt:
        is_used |= take_fix(value, received);
        break;
      default:
        break;
    }
  }
  // Messages that need no time, as those with GNSS data alone, say nothing of the others.
  if (epoch.needs_time())
    fault_once(!epoch.time, has_no_time_, FaultKind::NoTime, received,
               "no UTC time, or one that is not fully resolved: ask the device for UtcTime; nothing is stamped");
  if (!epoch.time) return is_used;
  if (auto second = seconds_.take(*epoch.time, {})) emit(*second, received);
  if (auto sample = epoch.sample()) {
    emit(*sample, received);
    is_used = true;
  }
  if (auto solution = epoch.solution()) {
    emit(std::move(*solution), received);
    is_used = true;
  }
  return is_used;
}

bool XsensDecoder::take_fix(std::span<const std::byte> pvt, HostTime received) {
  if (pvt.size() < 84 || (static_cast<unsigned>(pvt[11]) & 7) != 7) return false;
  const auto i32 = [&](std::size_t at) { return static_cast<double>(stream_field_big<std::int32_t>(pvt, at)); };
  const auto whole = from_utc(calendar(pvt, 4));
  const auto nano = stream_field_big<std::int32_t>(pvt, 16);
  const auto flags = static_cast<unsigned>(pvt[21]);
  if (!whole || std::abs(nano) > 1'000'000'000) return false;
  GnssFix fix;
  fix.time = *whole + nanoseconds(nano);
  const auto kind = static_cast<unsigned>(pvt[20]);
  if ((flags & 1) != 0 && (kind == 2 || kind == 3 || kind == 4)) {
    const unsigned carrier = flags >> 6;
    fix.type = carrier == 2       ? FixType::RtkFixed
               : carrier == 1     ? FixType::RtkFloat
               : (flags & 2) != 0 ? FixType::Dgnss
                                  : FixType::Single;
  }
  fix.satellites = static_cast<int>(pvt[22]);
  fix.position = {i32(28) * 1e-7 * kRadPerDeg, i32(24) * 1e-7 * kRadPerDeg, i32(32) * 1e-3};
  const double plane = stream_field_big<std::uint32_t>(pvt, 40) * 1e-3 / std::numbers::sqrt2;
  fix.sigma_enu = {{plane, plane, stream_field_big<std::uint32_t>(pvt, 44) * 1e-3}};
  emit(fix, received);
  return true;
}

void XsensDecoder::count(std::uint16_t counter, HostTime received) {
  if (const std::uint64_t missing = counter_.take(counter); missing > 0)
    fault(FaultKind::Lost, received, missing,
          fmt::format("MTData2: {} packets are missing, by their counter", missing));
}

}  // namespace hueline::drivers
