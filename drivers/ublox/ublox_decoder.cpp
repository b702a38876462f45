#include "drivers/ublox/ublox_decoder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "core/angle.hpp"
#include "core/calendar.hpp"
#include "drivers/stream/line_form.hpp"
#include "drivers/stream/rtcm_form.hpp"
#include "drivers/ublox/ubx_fields.hpp"
#include "drivers/ublox/ubx_form.hpp"
#include "drivers/ublox/ubx_names.hpp"

namespace hueline::drivers {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ubx::accuracy;
using ubx::angle;
using ubx::axes;
using ubx::millis;
using ubx::place;

/// The forms of the stream, in the order in which they are asked.
enum Form : std::size_t { kUbx, kNmea, kRtcm, kLine };

std::vector<std::unique_ptr<MessageForm>> ublox_forms() {
  std::vector<std::unique_ptr<MessageForm>> out;
  out.push_back(std::make_unique<UbxForm>());
  out.push_back(std::make_unique<NmeaForm>());
  out.push_back(std::make_unique<RtcmForm>());
  out.push_back(std::make_unique<LineForm>());
  return out;
}

constexpr std::uint8_t kNav = 0x01, kAck = 0x05, kTim = 0x0D, kEsf = 0x10, kHnr = 0x28;
/// The ids of the messages that are read.
enum NavId : std::uint8_t {
  kPosllh = 0x02,
  kStatus = 0x03,
  kAtt = 0x05,
  kSol = 0x06,
  kPvt = 0x07,
  kHpposllh = 0x14,
  kPvat = 0x17,
  kTimegps = 0x20,
  kTimeutc = 0x21,
  kCov = 0x36,
  kEoe = 0x61,
};
/// The parts of an epoch, as bits of Epoch::seen.
enum Part : unsigned {
  kPartPosllh = 1,
  kPartStatus = 2,
  kPartAtt = 4,
  kPartSol = 8,
  kPartPvt = 16,
  kPartHpposllh = 32,
  kPartPvat = 64,
  kPartTimegps = 128,
  kPartTimeutc = 256,
  kPartCov = 512,
};
/// The more of an epoch a message tells, the higher its rank.
enum Rank : int { kRankPosllh = 1, kRankSol, kRankPvt, kRankPvat };

struct PartOf {
  std::uint8_t id;
  unsigned part;
  std::size_t least_bytes;
};
constexpr PartOf kParts[] = {
    {kPosllh, kPartPosllh, 28},     {kStatus, kPartStatus, 16},   {kAtt, kPartAtt, 32},
    {kSol, kPartSol, 52},           {kPvt, kPartPvt, 84},         {kPvat, kPartPvat, 116},
    {kHpposllh, kPartHpposllh, 36}, {kTimegps, kPartTimegps, 16}, {kTimeutc, kPartTimeutc, 20},
    {kCov, kPartCov, 64},
};

constexpr std::uint8_t kFixDeadReckoning = 1, kFixFused = 4, kFixTimeOnly = 5;  // the last: of a surveyed antenna
constexpr std::int64_t kWeekMs = kSecondsPerWeek * 1000;
constexpr double kLabelAccuracy_s = 0.1;  // a clock that is farther off may name the wrong second
constexpr double kMarkAccuracy_s = 1e-6;

/// A position beyond the receiver's own limits (its flag "fix OK" is not set) is a position all the same: its sigmas
/// say how good it is.
FixType fix_type(std::uint8_t fix, bool is_differential, int carrier) {
  if (fix == 0 || fix == kFixDeadReckoning || fix > kFixTimeOnly) return FixType::None;
  if (carrier == 2) return FixType::RtkFixed;
  if (carrier == 1) return FixType::RtkFloat;
  return is_differential ? FixType::Dgnss : FixType::Single;
}

/// Returns the roots of the diagonal of a covariance of north, east, down at `at`, in the order east, north, up.
std::optional<std::array<double, 3>> root_of_diagonal(std::span<const std::byte> payload, std::size_t at) {
  std::array<double, 3> out{};
  const std::array<std::size_t, 3> offsets{at + 12, at, at + 20};
  for (std::size_t i = 0; i < 3; ++i) {
    const double variance = static_cast<double>(stream_field<float>(payload, offsets[i]));
    if (!(variance >= 0) || !std::isfinite(variance)) return {};
    out[i] = std::sqrt(variance);
  }
  return out;
}

}  // namespace

void UbloxDecoder::Config::visit(Keys& keys) {
  keys.choice({"mark_edge", "", "The edge at the input EXTINT that is the event (TIM-TM2 reports both)."}, mark_edge,
              {{"rising", Edge::Rising}, {"falling", Edge::Falling}});
}

UbloxDecoder::UbloxDecoder(const Config& config) : StreamDecoder(ublox_forms()), config_(config) {}

void UbloxDecoder::forget() {
  epoch_.reset();
  nmea_.forget();
  high_rate_.forget();
  has_high_rate_ = false;
  usual_ = 0;
  latest_.reset();
  labelled_.reset();
  has_navigation_ = false;
}

void UbloxDecoder::finish() {
  close_epoch();
  std::vector<Measurement> last;
  if (!has_navigation_) nmea_.finish(last);
  emit_all(std::move(last));
}

bool UbloxDecoder::take(const Message& message) {
  switch (message.form) {
    case kUbx:
      return take_ubx(message);
    case kNmea: {
      const NmeaSentence sentence(message.bytes);
      name(std::string(sentence.talker()) + std::string(sentence.type()));
      if (has_navigation_) return false;
      std::vector<Measurement> made;
      const bool is_used = nmea_.take(sentence, message.received, made);
      emit_all(std::move(made));
      return is_used;
    }
    case kRtcm:
      name(fmt::format("RTCM {}", rtcm_number(message.bytes)));
      return false;
    default:
      name("text");
      return false;
  }
}

bool UbloxDecoder::take_ubx(const Message& message) {
  const auto kind = static_cast<std::uint8_t>(message.bytes[2]), id = static_cast<std::uint8_t>(message.bytes[3]);
  const Payload payload = message.bytes.subspan(kUbxHeaderBytes, message.bytes.size() - kUbxOverheadBytes);
  name(ubx_name(kind, id));
  if (kind == kNav) return take_navigation(id, payload, message);
  if (kind == kTim && id == 0x03 && payload.size() >= 28) return take_mark(payload, message.received);
  if (kind == kHnr) return take_high_rate(id, payload, message);
  if (kind == kEsf && id == 0x10 && payload.size() >= 16) {
    fusion_mode_ = stream_field<std::uint8_t>(payload, 12);
    return true;
  }
  if (kind == kAck && id == 0x00 && payload.size() >= 2)
    fault(FaultKind::Refused, message.received, 1,
          fmt::format("the receiver refused {}",
                      ubx_name(static_cast<std::uint8_t>(payload[0]), static_cast<std::uint8_t>(payload[1]))));
  return false;
}

bool UbloxDecoder::take_high_rate(std::uint8_t id, Payload payload, const Message& message) {
  UbloxHighRate::Taken taken = high_rate_.take(id, payload, message.received, {utc_offset_, fusion_mode_});
  if (taken.time) watch("HNR-PVT", milliseconds_of(*taken.time), message);
  if (taken.solution) {
    has_high_rate_ = true;
    const HostTime received = taken.solution->received;
    emit(std::move(*taken.solution), received);
  }
  return taken.is_used;
}

bool UbloxDecoder::take_navigation(std::uint8_t id, Payload payload, const Message& message) {
  if (id == kEoe) {
    close_epoch();
    return false;
  }
  const auto* known = std::find_if(std::begin(kParts), std::end(kParts), [&](const PartOf& p) { return p.id == id; });
  if (known == std::end(kParts) || payload.size() < known->least_bytes) return false;
  const std::size_t itow_at = id == kHpposllh ? 4 : 0;
  const auto itow = stream_field<std::uint32_t>(payload, itow_at);
  if (itow >= kWeekMs) return false;  // the receiver does not know the time of the week yet
  open_epoch(itow, known->part);
  Epoch& epoch = *epoch_;
  const auto u8 = [&](std::size_t at) { return stream_field<std::uint8_t>(payload, at); };
  const HostTime received = message.received;
  switch (id) {
    case kPvt:
    case kPvat: {
      // PVAT has the fields of PVT in another order.
      struct Layout {
        std::size_t year, valid, accuracy, nano, fix, lon, h_acc, vel, s_acc;
      };
      const Layout l =
          id == kPvt ? Layout{4, 11, 12, 16, 20, 24, 40, 48, 68} : Layout{6, 5, 16, 20, 24, 28, 44, 52, 68};
      const std::uint8_t flags = u8(l.fix + 1);
      use_calendar(payload, l.year, u8(l.valid), stream_field<std::int32_t>(payload, l.nano),
                   accuracy(payload, l.accuracy, 1e-9), (flags & 1) != 0, received);
      if (!outranks(id == kPvt ? kRankPvt : kRankPvat, received)) break;
      epoch.is_ok = (flags & 1) != 0;
      epoch.fix_type = u8(l.fix);
      epoch.fix.type = fix_type(epoch.fix_type, (flags & 2) != 0, flags >> 6);
      epoch.fix.satellites = u8(l.fix + 3);
      epoch.fix.position = place(payload, l.lon);
      epoch.fix.sigma_enu = axes(accuracy(payload, l.h_acc, 1e-3), accuracy(payload, l.h_acc + 4, 1e-3));
      epoch.velocity_enu = {millis(payload, l.vel + 4), millis(payload, l.vel), -millis(payload, l.vel + 8)};
      epoch.has_velocity = true;
      epoch.velocity_accuracy = accuracy(payload, l.s_acc, 1e-3);
      if (id == kPvat && (flags & 0x38) == 0x38) {
        epoch.attitude = Attitude{angle(payload, 72), angle(payload, 76), angle(payload, 80)};
        for (std::size_t i = 0; i < 3; ++i)
          epoch.attitude_sigma[i] =
              static_cast<double>(stream_field<std::uint16_t>(payload, 88 + 2 * i)) * 1e-2 * kRadPerDeg;
      }
      break;
    }
    case kSol: {
      const std::uint8_t flags = u8(11);
      if ((flags & 0x0C) == 0x0C) {
        epoch.week = stream_field<std::int16_t>(payload, 8);
        epoch.nanoseconds = stream_field<std::int32_t>(payload, 4);
        label(time_of(epoch), (flags & 1) != 0, received);
      }
      if (!outranks(kRankSol, received)) break;
      epoch.is_ok = (flags & 1) != 0;
      epoch.fix_type = u8(10);
      epoch.fix.type = fix_type(epoch.fix_type, (flags & 2) != 0, 0);
      epoch.fix.satellites = u8(47);
      const auto cm = [&](std::size_t at) {
        return static_cast<double>(stream_field<std::int32_t>(payload, at)) * 1e-2;
      };
      epoch.fix.position = to_geodetic(Point<Ecef>{Eigen::Vector3d(cm(12), cm(16), cm(20))});
      const double each = accuracy(payload, 24, 1e-2) / std::numbers::sqrt3;
      epoch.fix.sigma_enu = {{each, each, each}};
      break;
    }
    case kPosllh:
      if (!outranks(kRankPosllh, received)) break;
      epoch.fix.position = place(payload, 4);
      epoch.fix.sigma_enu = axes(accuracy(payload, 20, 1e-3), accuracy(payload, 24, 1e-3));
      break;
    case kStatus:
      if (epoch.rank > kRankPosllh) break;
      epoch.is_ok = (u8(5) & 1) != 0;
      epoch.fix_type = u8(4);
      epoch.fix.type = fix_type(epoch.fix_type, (u8(5) & 2) != 0, 0);
      break;
    case kHpposllh:
      if ((u8(3) & 1) != 0) break;  // invalid
      epoch.precise = place(payload, 8);
      epoch.precise->longitude += stream_field<std::int8_t>(payload, 24) * 1e-9 * kRadPerDeg;
      epoch.precise->latitude += stream_field<std::int8_t>(payload, 25) * 1e-9 * kRadPerDeg;
      epoch.precise->ellipsoidal_height += stream_field<std::int8_t>(payload, 26) * 1e-4;
      epoch.precise_sigma = axes(accuracy(payload, 28, 1e-4), accuracy(payload, 32, 1e-4));
      break;
    case kAtt:
      if (epoch.attitude && epoch.rank == kRankPvat) break;
      epoch.attitude = Attitude{angle(payload, 8), angle(payload, 12), angle(payload, 16)};
      for (std::size_t i = 0; i < 3; ++i) epoch.attitude_sigma[i] = accuracy(payload, 20 + 4 * i, 1e-5) * kRadPerDeg;
      break;
    case kTimegps:
      if ((u8(11) & 4) != 0) utc_offset_ = seconds(stream_field<std::int8_t>(payload, 10));
      if ((u8(11) & 3) == 3) {
        epoch.week = stream_field<std::int16_t>(payload, 8);
        epoch.nanoseconds = stream_field<std::int32_t>(payload, 4);
        label(time_of(epoch), accuracy(payload, 12, 1e-9) < kLabelAccuracy_s, received);
      }
      break;
    case kTimeutc:
      use_calendar(payload, 12, u8(19) == 7 ? 7 : 0, stream_field<std::int32_t>(payload, 8), accuracy(payload, 4, 1e-9),
                   true, received);
      break;
    case kCov:
      if (u8(5) == 1) epoch.position_sigma = root_of_diagonal(payload, 16);
      if (u8(6) == 1) epoch.velocity_sigma = root_of_diagonal(payload, 40);
      break;
    default:
      break;
  }
  if (id == kPvt || id == kPvat || id == kSol || id == kPosllh) {
    has_navigation_ = true;
    if (const auto time = time_of(epoch)) watch(ubx_name(kNav, id), milliseconds_of(*time), message);
  }
  if (usual_ != 0 && (epoch.seen & usual_) == usual_) close_epoch();
  return true;
}

/// Makes sure that the open epoch is that of `itow_ms`.
void UbloxDecoder::open_epoch(std::uint32_t itow_ms, unsigned part) {
  if (epoch_ && epoch_->itow_ms != itow_ms) {
    usual_ = 0;  // a message that used to come is missing: learn again
    close_epoch();
  }
  if (!epoch_) {
    epoch_.emplace();
    epoch_->itow_ms = itow_ms;
    if (closed_itow_ == itow_ms) {  // a message behind what was taken for the last one of the epoch
      epoch_->is_again = true;
      usual_ = 0;
      late_ = closed_seen_;
    }
  }
  epoch_->seen |= part;
}

/// Returns whether a position of this rank is better than what the epoch has, and notes it if so.
bool UbloxDecoder::outranks(int rank, HostTime received) {
  if (rank < epoch_->rank) return false;
  epoch_->rank = rank;
  epoch_->received = received;
  return true;
}

/// Takes the UTC of an epoch at `at` of the payload: year, month, day, hour, minute, second. `valid` has u-blox's bits:
/// 1 the date, 2 the time of day, 4 no ambiguity of a second.
void UbloxDecoder::use_calendar(Payload payload, std::size_t at, std::uint8_t valid, std::int32_t nanosecond,
                                double accuracy_s, bool is_ok, HostTime received) {
  if ((valid & 3) != 3) return;
  const auto u8 = [&](std::size_t offset) {
    return static_cast<int>(stream_field<std::uint8_t>(payload, at + offset));
  };
  const UtcTime utc{stream_field<std::uint16_t>(payload, at), u8(2), u8(3), u8(4), u8(5), u8(6), 0};
  const auto whole = from_utc(utc, utc_offset_);
  if (!whole || std::abs(nanosecond) > 1'000'000'000) return;
  Epoch& epoch = *epoch_;
  const GpsTime by_calendar = *whole + nanoseconds(nanosecond);
  // The time of the week says which second it is; the calendar says which week, and the part of a millisecond.
  const milliseconds tow(epoch.itow_ms);
  const std::int64_t week = std::llround(to_seconds(by_calendar.time_since_epoch() - tow) / kSecondsPerWeek);
  const GpsTime by_week = from_gps_week(static_cast<int>(week), tow);
  const nanoseconds difference = by_calendar - by_week;
  const bool is_contradiction = std::chrono::abs(difference) > milliseconds(500);
  if (is_contradiction && (valid & 4) != 0 && is_ok && !contradicts_)
    fault(FaultKind::LabelConflict, received, 1,
          fmt::format(
              "the time of the week and UTC with {} leap seconds differ by {:.3f} s: the time of the week is used",
              (utc_offset_ ? *utc_offset_ : utc_offset_from_table(by_week)).count(), to_seconds(difference)));
  contradicts_ = is_contradiction && (valid & 4) != 0;
  epoch.time = is_contradiction ? by_week : by_calendar;
  label(epoch.time, (valid & 4) != 0 && is_ok && accuracy_s < kLabelAccuracy_s, received);
}

/// Returns the time of an epoch: from its own messages, or with the week of the epoch before.
std::optional<GpsTime> UbloxDecoder::time_of(const Epoch& epoch) const {
  if (epoch.time) return epoch.time;
  const nanoseconds tow = milliseconds(epoch.itow_ms) + nanoseconds(epoch.nanoseconds);
  if (epoch.week && *epoch.week > 0) return from_gps_week(*epoch.week, tow);
  if (!latest_) return {};
  const std::int64_t week = std::llround(to_seconds(latest_->time_since_epoch() - tow) / kSecondsPerWeek);
  return from_gps_week(static_cast<int>(week), tow);
}

void UbloxDecoder::label(std::optional<GpsTime> time, bool is_valid, HostTime received) {
  if (!time || !is_valid) return;
  const GpsTime second(std::chrono::floor<seconds>((*time + milliseconds(1)).time_since_epoch()));
  if (labelled_ && *labelled_ == second) return;
  labelled_ = second;
  emit(TimeLabel{0, {}, second, utc_offset_, true}, received);
}

void UbloxDecoder::close_epoch() {
  if (!epoch_) return;
  Epoch epoch = *std::exchange(epoch_, {});
  usual_ = std::exchange(late_, 0u) | epoch.seen;
  closed_itow_ = epoch.itow_ms;
  closed_seen_ = usual_;
  const auto time = time_of(epoch);
  if (time) latest_ = time;
  if (epoch.rank == 0) return;
  if (!time) {
    if (!has_no_time_)
      fault(FaultKind::NoTime, epoch.received, 1, "the receiver does not know the date: its positions have no time");
    has_no_time_ = true;
    return;
  }
  has_no_time_ = false;
  if (epoch.is_again) return;
  GnssFix& fix = epoch.fix;
  fix.time = *time;
  if (epoch.position_sigma) fix.sigma_enu = *epoch.position_sigma;
  if (epoch.precise) {
    fix.position = *epoch.precise;
    fix.sigma_enu = *epoch.precise_sigma;
  }
  // Where high-rate solutions come, the epochs are slower and later.
  if (epoch.attitude && epoch.has_velocity && !has_high_rate_) {
    InsSolution solution;
    solution.time = *time;
    solution.position = fix.position;
    solution.velocity_enu = epoch.velocity_enu;
    solution.attitude = *epoch.attitude;
    const bool is_fused = epoch.fix_type == kFixFused || epoch.fix_type == kFixDeadReckoning;
    solution.is_good = epoch.is_ok && is_fused && fusion_mode_.value_or(1) == 1;
    solution.status = epoch.fix_type;
    const double each = epoch.velocity_accuracy / std::numbers::sqrt3;
    const auto velocity = epoch.velocity_sigma.value_or(std::array<double, 3>{each, each, each});
    solution.sigma = {{fix.sigma_enu[0], fix.sigma_enu[1], fix.sigma_enu[2], velocity[0], velocity[1], velocity[2],
                       epoch.attitude_sigma[0], epoch.attitude_sigma[1], epoch.attitude_sigma[2]}};
    emit(std::move(solution), epoch.received);
  }
  emit(fix, epoch.received);
}

bool UbloxDecoder::take_mark(Payload payload, HostTime received) {
  const auto flags = stream_field<std::uint8_t>(payload, 1);
  const bool is_rising = config_.mark_edge == Edge::Rising;
  if ((flags & (is_rising ? 0x80 : 0x04)) == 0) return false;  // the other edge
  const auto week = stream_field<std::uint16_t>(payload, is_rising ? 4 : 6);
  const auto ms = stream_field<std::uint32_t>(payload, is_rising ? 8 : 16);
  const auto ns = stream_field<std::uint32_t>(payload, is_rising ? 12 : 20);
  if (week == 0 || ms >= kWeekMs || ns >= 1'000'000) return false;
  const int base = flags >> 3 & 3;  // 0: the receiver's own clock, 1: GNSS, 2: UTC
  EventMark mark;
  mark.time = from_gps_week(week, milliseconds(ms) + nanoseconds(ns));
  if (base == 2) mark.time += utc_offset_ ? *utc_offset_ : utc_offset_from_table(mark.time);
  mark.input = stream_field<std::uint8_t>(payload, 0) + 1;
  mark.pulse_count = stream_field<std::uint16_t>(payload, 2);
  const double accuracy_s = accuracy(payload, 24, 1e-9);
  mark.is_valid = (flags & 0x40) != 0 && base != 0 && accuracy_s <= kMarkAccuracy_s;
  if (!mark.is_valid)
    fault(FaultKind::NoTime, received, 1,
          fmt::format("TIM-TM2: {}; the mark is not trusted",
                      (flags & 0x40) == 0 ? "the receiver calls its time not valid"
                      : base == 0         ? "stamped by the receiver's own clock, which follows no GNSS"
                                          : "its accuracy is worse than a microsecond"));
  emit(mark, received);
  return true;
}

}  // namespace hueline::drivers
