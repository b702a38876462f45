#include "drivers/applanix/applanix_decoder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/angle.hpp"
#include "core/calendar.hpp"
#include "drivers/applanix/applanix_form.hpp"
#include "drivers/stream/line_form.hpp"
#include "drivers/stream/nmea_form.hpp"

namespace hueline::drivers {
namespace {

/// The forms of the stream, in the order in which they are asked.
enum Form : std::size_t { kApplanix, kNmea, kLine };

std::vector<std::unique_ptr<MessageForm>> applanix_forms() {
  std::vector<std::unique_ptr<MessageForm>> out;
  out.push_back(std::make_unique<ApplanixForm>());
  out.push_back(std::make_unique<NmeaForm>());
  out.push_back(std::make_unique<LineForm>());
  return out;
}

constexpr int kRollover = 1024;
constexpr int kFirstWeek = 1668;  // of 2012

enum Scale : int { kGps = 1, kUtc = 2 };
enum GroupNumber : int { kNavigation = 1, kErrors = 2, kGnssStatus = 3, kEvent1 = 5, kEvent2 = 6, kPulse = 7 };

std::optional<int> event_input(int number) {
  if (number != kEvent1 && number != kEvent2) return {};
  return number - kEvent1 + 1;
}

std::size_t least_bytes(int number) {
  switch (number) {
    case kNavigation:
      return 135 + kGroupFooterBytes;
    case kErrors:
      return 70 + kGroupFooterBytes;
    case kGnssStatus:
      return 64 + kGroupFooterBytes;
    case kPulse:
      return 39 + kGroupFooterBytes;
    default:
      return event_input(number) ? 38 + kGroupFooterBytes : kGroupHeaderBytes;
  }
}

}  // namespace

void ApplanixDecoder::Config::visit(Keys& keys) {
  keys.flag({"accept_fine_alignment", "",
             "Whether points are also placed while the POS says \"fine alignment\": it navigates, but its heading is "
             "only better than 15 deg. Use this to try a rig on a standing vehicle."},
            accepts_fine_alignment);
}

ApplanixDecoder::ApplanixDecoder(const Config& config) : StreamDecoder(applanix_forms()), config_(config) {}

void ApplanixDecoder::forget() {
  latest_.reset();
  week_.reset();
  seconds_.forget();
  is_synchronised_.reset();
}

bool ApplanixDecoder::take(const Message& message) {
  if (message.form == kNmea) {
    const NmeaSentence sentence(message.bytes);
    name(std::string(sentence.talker()) + std::string(sentence.type()));
    return false;
  }
  if (message.form == kLine) {
    name("text");
    return false;
  }
  const int number = stream_field<std::uint16_t>(message.bytes, 4);
  if (message.bytes[1] == std::byte{'M'}) {
    name(fmt::format("MSG {}", number));
    return false;
  }
  name(fmt::format("GRP {}", number));
  return message.bytes.size() >= least_bytes(number) && take_group(number, message);
}

bool ApplanixDecoder::take_group(int number, const Message& message) {
  const Group group = message.bytes;
  const HostTime received = message.received;
  if (number == kGnssStatus) {
    take_status(group);
    return true;
  }
  const auto input = event_input(number);
  if (number != kNavigation && number != kErrors && number != kPulse && !input) return false;
  const auto time = time_of(group, received);
  if (!time) return false;
  if (!input) watch(fmt::format("GRP {}", number), *time, message);
  if (number == kNavigation) return take_solution(group, *time, received);
  if (number == kErrors) {
    const auto value = [&](std::size_t i) { return static_cast<double>(stream_field<float>(group, 34 + 4 * i)); };
    InsUncertainty errors;
    errors.time = *time;
    constexpr std::array<std::size_t, 9> kWireIndex{1, 0, 2, 4, 3, 5, 6, 7, 8};  // our order has east before north
    for (std::size_t i = 0; i < 9; ++i) {
      errors.sigma[i] = value(kWireIndex[i]) * (i < 6 ? 1 : kRadPerDeg);
      if (!(errors.sigma[i] >= 0) || !std::isfinite(errors.sigma[i])) return false;
    }
    emit(errors);
    return true;
  }
  if (number == kPulse) {
    const auto status = stream_field<std::uint8_t>(group, 38);
    is_synchronised_ = status == 2;
    fault_once(status != 2, is_unsynchronised_, FaultKind::NoTime, received,
               status == 3 ? "group 7: the POS uses an old offset of its clock: its pulses name no second"
                           : "group 7: the POS is not synchronised to GNSS: its pulses name no second");
    if (status != 2) return false;
    // The pulse is a full second; its time is stamped by the clock of the POS.
    const GpsTime pulse(std::chrono::round<std::chrono::seconds>(time->time_since_epoch()));
    if (auto second = seconds_.take(pulse, utc_offset_)) emit(*second, received);
    return true;
  }
  EventMark mark;
  mark.time = *time;
  mark.input = *input;
  mark.pulse_count = stream_field<std::uint32_t>(group, 34);
  mark.is_valid = is_synchronised_.value_or(true);
  if (!mark.is_valid)
    fault(FaultKind::NoTime, received, 1,
          fmt::format("group {}: an event while the POS is not synchronised: it is not trusted", number));
  emit(mark, received);
  return true;
}

bool ApplanixDecoder::take_solution(Group group, GpsTime time, HostTime received) {
  const auto f64 = [&](std::size_t at) { return stream_field<double>(group, at); };
  const auto f32 = [&](std::size_t at) { return static_cast<double>(stream_field<float>(group, at)); };
  InsSolution solution;
  solution.time = time;
  solution.position = {f64(34) * kRadPerDeg, f64(42) * kRadPerDeg, f64(50)};
  solution.velocity_enu = {f32(62), f32(58), -f32(66)};
  solution.attitude = {f64(70) * kRadPerDeg, f64(78) * kRadPerDeg, f64(86) * kRadPerDeg};
  solution.status = stream_field<std::uint8_t>(group, 134);
  const bool is_possible = std::abs(f64(34)) <= 90 && std::abs(f64(42)) <= 180 && std::abs(f64(50)) < 1e5 &&
                           solution.velocity_enu.allFinite() && std::abs(f64(70)) <= 360 && std::abs(f64(78)) <= 90 &&
                           std::abs(f64(86)) <= 360;
  if (!is_possible) return false;
  solution.is_good = solution.status == 0 || (solution.status == 1 && config_.accepts_fine_alignment);
  emit(std::move(solution), received);
  return true;
}

/// Takes week and leap seconds, which stand behind the channels of the receiver.
void ApplanixDecoder::take_status(Group group) {
  const std::size_t week_at = std::size_t{38} + stream_field<std::uint16_t>(group, 36) + 14;
  if (week_at + 12 > group.size()) return;
  const auto week = stream_field<std::uint32_t>(group, week_at);
  if (week == 0 || week >= 10000) return;
  week_ = static_cast<int>(week);
  // A larger number was counted from 1980 on, such as that of a drive in 2009.
  if (*week_ < kRollover)
    while (*week_ < kFirstWeek) *week_ += kRollover;
  const double offset = std::abs(stream_field<double>(group, week_at + 4));  // its sign differs between firmwares
  if (offset > 0 && offset < 100) utc_offset_ = std::chrono::seconds(std::lround(offset));
}

/// Returns the time of a group on the GPS scale, by whichever of its two times is on a scale of GNSS.
std::optional<GpsTime> ApplanixDecoder::time_of(Group group, HostTime received) {
  const auto types = stream_field<std::uint8_t>(group, 32);
  const int first = types & 15, second = types >> 4;
  const bool takes_second = first != kGps && (second == kGps || (first != kUtc && second == kUtc));
  const int scale = takes_second ? second : first;
  const double tow = stream_field<double>(group, takes_second ? 16 : 8);
  const bool is_known = (scale == kGps || scale == kUtc) && tow >= 0 && tow < static_cast<double>(kSecondsPerWeek) + 1;
  fault_once(!is_known || !week_, has_no_time_, FaultKind::NoTime, received,
             is_known ? "no group 3 yet: nothing says which GPS week it is"
                      : "groups with POS time alone: set Time 1 or Time 2 to GPS or UTC, or wait for the receiver");
  if (!is_known || !week_) return {};
  GpsTime time = from_gps_week(*week_, from_seconds(tow));
  if (scale == kUtc) time += utc_offset_ ? *utc_offset_ : utc_offset_from_table(time);
  // Around the turn of the week, group 3 may name the other week.
  constexpr auto kWeek = std::chrono::seconds(kSecondsPerWeek);
  if (latest_) {
    if (time - *latest_ > kWeek / 2) time -= kWeek;
    if (time - *latest_ < -kWeek / 2) time += kWeek;
  }
  latest_ = time;
  return time;
}

}  // namespace hueline::drivers
