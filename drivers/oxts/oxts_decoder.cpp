#include "drivers/oxts/oxts_decoder.hpp"

#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "core/angle.hpp"
#include "drivers/oxts/ncom_form.hpp"

namespace hueline::drivers {
namespace {

using std::chrono::milliseconds;
using std::chrono::minutes;

std::vector<std::unique_ptr<MessageForm>> oxts_forms() {
  std::vector<std::unique_ptr<MessageForm>> out;
  out.push_back(std::make_unique<NcomForm>());
  return out;
}

enum State : int { kInitialising = 2, kLocking = 3, kLocked = 4, kTriggered = 20, kLastTriggered = 22 };
constexpr std::uint8_t kTooOld = 150;  // an accuracy with this age is not valid
constexpr auto kSigmaHolds = std::chrono::seconds(5);
constexpr int kMinuteMs = 60'000;
/// A packet that is so much behind the one before was overtaken on its way.
constexpr int kOvertakenMs = 1000;
/// A gap that is longer by the packets' own times, or by their arrivals, may as well be longer by whole minutes.
constexpr int kLongestGapMs = 5000;
constexpr auto kLongestSilence = std::chrono::seconds(30);

/// Returns a signed number of 24 bits; nothing for the number that means "not known".
std::optional<double> number24(std::span<const std::byte> bytes, std::size_t at) {
  const auto raw = static_cast<std::int32_t>(static_cast<std::uint32_t>(bytes[at]) << 8 |
                                             static_cast<std::uint32_t>(bytes[at + 1]) << 16 |
                                             static_cast<std::uint32_t>(bytes[at + 2]) << 24) /
                   256;
  if (raw == -8388608) return {};
  return raw;
}

}  // namespace

void OxtsDecoder::Config::visit(Keys& keys) {
  keys.flag({"accept_locking", "",
             "Whether points are also placed while the system says \"locking\": it navigates, but has not reached its "
             "real-time state yet."},
            accepts_locking);
}

OxtsDecoder::OxtsDecoder(const Config& config) : StreamDecoder(oxts_forms()), config_(config) {}

void OxtsDecoder::forget() {
  minute_.reset();
  latest_.reset();
  position_.reset();
  velocity_.reset();
  attitude_.reset();
  triggers_ = {};
  latest_received_ = {};
  seconds_.forget();
}

bool OxtsDecoder::take(const Message& message) {
  const Content packet = message.bytes;
  const int state = stream_field<std::uint8_t>(packet, 21), channel = stream_field<std::uint8_t>(packet, 62);
  name(fmt::format("NCOM state {}", state));
  const bool is_trigger = state >= kTriggered && state <= kLastTriggered;
  const bool has_navigation = state >= kInitialising && state <= kLocked;
  // The minute is that of this packet, so it is read before the packet's own time.
  const int ms = stream_field<std::uint16_t>(packet, 1);
  if (message.received - std::exchange(latest_received_, message.received) > kLongestSilence) minute_.reset();
  const bool is_channel_used = take_channel(channel, packet.subspan(63, 8), ms, state, message.received);
  if (!has_navigation || is_trigger) return is_channel_used;
  const auto time = time_of(ms);
  fault_once(!time, has_no_time_, FaultKind::NoTime, message.received,
             "no minute of channel 0 yet, or none since a long gap: the packets have the time within a minute only");
  if (!time) return is_channel_used;
  watch("NCOM", *time, message);
  if (state >= kLocking)
    if (auto second = seconds_.take(*time, {})) emit(*second, message.received);
  return take_solution(packet, state, *time, message.received) || is_channel_used;
}

bool OxtsDecoder::take_channel(int channel, Content content, int ms, int state, HostTime received) {
  switch (channel) {
    case 0: {
      if (state < kInitialising || state > kLocked) return false;
      const auto minute = stream_field<std::int32_t>(content, 0);
      // From 2000 to 2100; before the first fix it is 0 or anything.
      if (minute < 10'500'000 || minute > 63'000'000 || ms >= kMinuteMs) return false;
      const auto carried = carried_minute(ms);
      if (state >= kLocking && carried && *carried != minute)
        fault(FaultKind::LabelConflict, received, 1,
              fmt::format("channel 0 says a minute that is {} from the one before, which was carried on: packets "
                          "between the two, behind a gap, have a wrong time",
                          minute - *carried));
      minute_ = minute;
      latest_ms_ = ms;
      return true;
    }
    case 3:
      take_sigma(position_, content, 1e-3);
      return true;
    case 4:
      take_sigma(velocity_, content, 1e-3);
      return true;
    case 5:
      take_sigma(attitude_, content, 1e-5);
      return true;
    case 24:
    case 43: {
      auto& counter = triggers_[channel == 24 ? 0 : 1];
      const auto count = stream_field<std::uint8_t>(content, 7);
      const auto minute = stream_field<std::int32_t>(content, 0);
      const auto trigger_ms = stream_field<std::uint16_t>(content, 4);
      // The channel repeats the latest trigger; the first that is heard may be an old one.
      const bool is_new = counter && *counter != count;
      const bool is_first = !counter;
      counter = count;
      if (minute < 10'500'000 || minute > 63'000'000 || trigger_ms >= kMinuteMs || (!is_new && !is_first)) return false;
      EventMark mark;
      mark.time = GpsTime(minutes(minute) + milliseconds(trigger_ms) +
                          std::chrono::microseconds(4 * stream_field<std::int8_t>(content, 6)));
      mark.input = channel == 24 ? 1 : 2;
      mark.pulse_count = count;
      mark.is_valid = state >= kLocking && state != kTriggered;  // that one is a trigger while initialising
      if (is_first && latest_ && *latest_ - mark.time > std::chrono::seconds(10)) return false;  // of before
      emit(mark, received);
      return true;
    }
    default:
      return false;
  }
}

void OxtsDecoder::take_sigma(std::optional<Sigma>& sigma, Content content, double unit) {
  if (stream_field<std::uint8_t>(content, 6) >= kTooOld) {
    sigma.reset();
    return;
  }
  Sigma taken;
  for (std::size_t i = 0; i < 3; ++i) taken.values[i] = stream_field<std::uint16_t>(content, 2 * i) * unit;
  taken.time = latest_.value_or(GpsTime{});
  sigma = taken;
}

/// Returns the minute of a packet that says it is `ms` within it: it follows the packet before, unless a gap is
/// between.
std::optional<std::int64_t> OxtsDecoder::carried_minute(int ms) const {
  if (!minute_) return {};
  const int step = (ms - latest_ms_ + kMinuteMs) % kMinuteMs;
  if (step >= kMinuteMs - kOvertakenMs) return *minute_ - (ms > latest_ms_ ? 1 : 0);
  if (step > kLongestGapMs) return {};
  return *minute_ + (ms < latest_ms_ ? 1 : 0);
}

std::optional<GpsTime> OxtsDecoder::time_of(int ms) {
  if (ms >= kMinuteMs) return {};
  const auto minute = carried_minute(ms);
  if (!minute) {
    minute_.reset();
    return {};
  }
  const GpsTime time(minutes(*minute) + milliseconds(ms));
  const bool is_overtaken = *minute < *minute_ || (*minute == *minute_ && ms < latest_ms_);
  if (is_overtaken) return time;
  minute_ = minute;
  latest_ms_ = ms;
  latest_ = time;
  return time;
}

bool OxtsDecoder::take_solution(Content packet, int state, GpsTime time, HostTime received) {
  InsSolution solution;
  solution.time = time;
  solution.position = {stream_field<double>(packet, 23), stream_field<double>(packet, 31),
                       static_cast<double>(stream_field<float>(packet, 39))};
  const auto north = number24(packet, 43), east = number24(packet, 46), down = number24(packet, 49);
  const auto heading = number24(packet, 52), pitch = number24(packet, 55), roll = number24(packet, 58);
  if (!(std::abs(solution.position.latitude) <= 90 * kRadPerDeg) ||
      !(std::abs(solution.position.longitude) <= 180 * kRadPerDeg) ||
      !(std::abs(solution.position.ellipsoidal_height) < 1e5) || !north || !east || !down || !heading || !pitch ||
      !roll)
    return false;
  solution.velocity_enu = {*east * 1e-4, *north * 1e-4, -*down * 1e-4};
  solution.attitude = {*roll * 1e-6, *pitch * 1e-6, *heading * 1e-6};
  if (solution.attitude.heading < 0) solution.attitude.heading += 2 * std::numbers::pi;
  solution.status = static_cast<std::uint32_t>(state);
  solution.is_good = state == kLocked || (state == kLocking && config_.accepts_locking);
  const auto holds = [&](const std::optional<Sigma>& s) { return s && time - s->time < kSigmaHolds; };
  if (holds(position_) && holds(velocity_) && holds(attitude_)) {
    const auto& p = position_->values;  // north, east, down
    const auto& v = velocity_->values;
    const auto& a = attitude_->values;  // heading, pitch, roll
    solution.sigma = {{p[1], p[0], p[2], v[1], v[0], v[2], a[2], a[1], a[0]}};
  }
  emit(std::move(solution), received);
  return true;
}

}  // namespace hueline::drivers
