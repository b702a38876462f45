#include "drivers/xsens/xsens_can_decoder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <span>
#include <utility>

#include "core/calendar.hpp"
#include "drivers/stream/message_form.hpp"

namespace hueline::drivers {
namespace {

/// The identifiers of the messages that are read.
enum Kind : std::uint32_t {
  kError = 0x01,
  kSampleTime = 0x05,
  kGroupCounter = 0x06,
  kUtc = 0x07,
  kStatusWord = 0x11,
  kQuaternion = 0x21,
  kEulerAngles = 0x22,
  kRateOfTurn = 0x32,
  kAcceleration = 0x34,
  kAccelerationHr = 0x61,
  kRateOfTurnHr = 0x62,
  kLatLong = 0x71,
  kAltitude = 0x72,
  kVelocity = 0x76,
};
struct Message {
  std::uint32_t kind;
  std::size_t bytes;
};
constexpr Message kMessages[] = {
    {kError, 1},        {kSampleTime, 4},  {kGroupCounter, 2}, {kUtc, 8},          {kStatusWord, 4},
    {kQuaternion, 8},   {kEulerAngles, 6}, {kRateOfTurn, 6},   {kAcceleration, 6}, {kAccelerationHr, 6},
    {kRateOfTurnHr, 6}, {kLatLong, 8},     {kAltitude, 4},     {kVelocity, 6},
};

constexpr double kRateStep = 1.0 / 512, kAccelerationStep = 1.0 / 256, kVelocityStep = 1.0 / 64, kEulerStep = 1.0 / 128,
                 kHeightStep = 1.0 / 32768, kLatitudeStep = 1.0 / (1 << 24), kLongitudeStep = 1.0 / (1 << 23),
                 kQuaternionStep = 1.0 / 32767;
constexpr std::chrono::microseconds kTick{100};
constexpr std::uint32_t kLongestCarry = 100'000;  // ticks for which a UTC is carried on: 10 s

/// The numbers of a frame.
class Data {
 public:
  explicit Data(std::span<const std::uint8_t> bytes) : bytes_(std::as_bytes(bytes)) {}
  std::uint8_t u8(std::size_t at) const { return std::to_integer<std::uint8_t>(bytes_[at]); }
  std::uint16_t u16(std::size_t at) const { return stream_field_big<std::uint16_t>(bytes_, at); }
  std::uint32_t u32(std::size_t at) const { return stream_field_big<std::uint32_t>(bytes_, at); }
  double i16(std::size_t at) const { return stream_field_big<std::int16_t>(bytes_, at); }
  double i32(std::size_t at) const { return stream_field_big<std::int32_t>(bytes_, at); }
  Eigen::Vector3d vector(double step) const { return Eigen::Vector3d(i16(0), i16(2), i16(4)) * step; }

 private:
  std::span<const std::byte> bytes_;
};

std::optional<GpsTime> read_utc(const Data& data) {
  constexpr int kCentury = 2000;
  const std::uint16_t tenth_ms = data.u16(6);
  const auto whole = from_utc({kCentury + data.u8(0), data.u8(1), data.u8(2), data.u8(3), data.u8(4), data.u8(5), 0});
  if (!whole || tenth_ms >= 10'000) return std::nullopt;
  return *whole + tenth_ms * kTick;
}

}  // namespace

void XsensCanDecoder::forget() {
  epoch_ = {};
  kinds_.clear();
  ticks_.reset();
  anchor_.reset();
  status_.reset();
  was_fixed_ = false;
  group_.forget();
  seconds_.forget();
}

void XsensCanDecoder::flush(std::vector<Measurement>& out) { end_sample(out); }

CanDecoder::Use XsensCanDecoder::take(const CanFrame& frame, HostTime received, std::vector<Measurement>& out) {
  const auto* known = std::ranges::find(kMessages, frame.id, &Message::kind);
  if (known == std::end(kMessages)) return Use::Ignored;
  if (frame.length < known->bytes) {
    tell(FaultKind::Malformed, received, 1, out,
         fmt::format("message {:03X} has {} bytes, an MTi's has {}", frame.id, frame.length, known->bytes));
    return Use::Malformed;
  }
  const Data data(frame.bytes());
  begin_with(frame.id, out);
  received_ = received;
  switch (frame.id) {
    case kError:
      tell(FaultKind::Lost, received, 1, out,
           fmt::format("the device lost at least one message, because its buffer to the bus is full (error {}): lower "
                       "its output rates or raise the bit rate",
                       data.u8(0)));
      break;
    case kSampleTime:
      ticks_ = data.u32(0);
      break;
    case kGroupCounter:
      count_group(data.u16(0), received, out);
      break;
    case kUtc:
      epoch_.time = read_utc(data);
      break;
    case kStatusWord:
      status_ = data.u32(0);
      was_fixed_ |= (*status_ & XsensEpoch::kGnssFix) != 0;
      break;
    case kQuaternion:
      epoch_.R_enu_sensor = xsens_quaternion(data.i16(0) * kQuaternionStep, data.i16(2) * kQuaternionStep,
                                             data.i16(4) * kQuaternionStep, data.i16(6) * kQuaternionStep);
      break;
    case kEulerAngles:
      // The quaternion, which came before, is finer.
      if (!epoch_.R_enu_sensor)
        epoch_.R_enu_sensor = xsens_euler(data.i16(0) * kEulerStep, data.i16(2) * kEulerStep, data.i16(4) * kEulerStep);
      break;
    case kRateOfTurn:
    case kRateOfTurnHr:
      epoch_.rate = data.vector(kRateStep);
      break;
    case kAcceleration:
    case kAccelerationHr:
      epoch_.acceleration = data.vector(kAccelerationStep);
      break;
    case kLatLong:
      epoch_.latitude_deg = data.i32(0) * kLatitudeStep;
      epoch_.longitude_deg = data.i32(4) * kLongitudeStep;
      break;
    case kAltitude:
      epoch_.height_m = data.i32(0) * kHeightStep;
      break;
    case kVelocity:
      epoch_.velocity_enu = data.vector(kVelocityStep);
      break;
    default:
      break;
  }
  return Use::Decoded;
}

/// Ends the sample that is under way if a frame of this kind belongs to the next one.
void XsensCanDecoder::begin_with(std::uint32_t kind, std::vector<Measurement>& out) {
  if (kind == kError) return;
  const bool is_head = kind <= kUtc;
  const bool has_data = std::ranges::any_of(kinds_, [](std::uint32_t one) { return one > kUtc; });
  if (std::ranges::find(kinds_, kind) != kinds_.end() || (is_head && has_data)) end_sample(out);
  kinds_.push_back(kind);
}

void XsensCanDecoder::count_group(std::uint16_t counter, HostTime received, std::vector<Measurement>& out) {
  if (const std::uint64_t missing = group_.take(counter); missing > 0)
    tell(FaultKind::Lost, received, missing, out,
         fmt::format("{} samples are missing, by their group counter", missing));
}

/// Gives the sample its time: its own UTC, or an earlier one carried on by the device's clock.
void XsensCanDecoder::find_time() {
  if (!was_fixed_) {
    epoch_.time.reset();
    return;
  }
  if (epoch_.time) {
    if (ticks_) anchor_ = Anchor{*epoch_.time, *ticks_};
  } else if (ticks_ && anchor_) {
    const std::uint32_t ahead = *ticks_ - anchor_->ticks;
    if (ahead < kLongestCarry) epoch_.time = anchor_->time + std::int64_t{ahead} * kTick;
  }
}

void XsensCanDecoder::end_sample(std::vector<Measurement>& out) {
  const auto emit = [&](auto measurement) {
    measurement.sensor = sensor();
    measurement.received = received_;
    out.emplace_back(std::move(measurement));
  };
  find_time();
  epoch_.status = status_;
  const bool is_untimed = epoch_.needs_time() && !epoch_.time;
  if (is_untimed && !has_no_time_)
    tell(FaultKind::NoTime, received_, 1, out,
         was_fixed_ ? "no UTC: let the device send UTC, and SampleTime if not each sample has UTC; nothing is stamped"
                    : "no GNSS fix has set the device's time yet, or it sends no StatusWord; nothing is stamped");
  if (epoch_.needs_time()) has_no_time_ = is_untimed;
  if (epoch_.time && status_ && (*status_ & XsensEpoch::kGnssFix) != 0)
    if (auto second = seconds_.take(*epoch_.time, {})) emit(*second);
  if (auto sample = epoch_.sample()) emit(*sample);
  if (auto solution = epoch_.solution()) emit(std::move(*solution));
  epoch_ = {};
  kinds_.clear();
  ticks_.reset();
}

}  // namespace hueline::drivers
