#include "drivers/wheel/wheel_decoder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace hueline::drivers {
namespace {

constexpr int kRefusedInARow = 10;      // after so many refusals the older speed was the wrong one
constexpr double kSpeedStep = 0.5;      // m/s; allows for quantisation and noise in addition to the acceleration
constexpr double kLongestStep_s = 1.0;  // older speeds say nothing about the next one
constexpr std::int64_t kMostCounted = 2'000'000'000'000;  // more than a gap has; a wide counter tells of any number

std::size_t needed_bytes(const WheelDecoder::Message& message) {
  std::size_t needed = message.checksum ? message.checksum->byte + 1 : 0;
  for (const WheelSignal& signal : message.speeds)
    if (signal.selections.empty()) needed = std::max(needed, signal.needed_bytes());
  for (const auto& pulses : message.pulses) needed = std::max(needed, pulses.signal.needed_bytes());
  if (message.counter) needed = std::max(needed, message.counter->needed_bytes());
  return needed;
}

std::string id_text(const WheelDecoder::Message& message) {
  return message.is_extended ? fmt::format("{:08X}", message.id) : fmt::format("{:03X}", message.id);
}

}  // namespace

WheelDecoder::WheelDecoder(Config config) : config_(std::move(config)), states_(config_.messages.size()) {
  if (!config_.has_names()) use(config_.messages);
}

void WheelDecoder::use(std::vector<Message> messages) {
  messages_ = std::move(messages);
  is_directional_ = false;
  for (const Message& message : messages_)
    for (const WheelSignal& signal : message.speeds)
      is_directional_ |= signal.is_signed || signal.offset < 0 || signal.number != CanNumber::Integer;
}

/// Looks up the named signals in the vehicle's database.
void WheelDecoder::take_database(std::string_view text, HostTime received, std::vector<Measurement>& out) {
  count("database");
  if (!config_.has_names()) return;
  auto found = config_.find_signals(text);
  if (found.ok()) return use(std::move(*found));
  messages_.clear();
  is_waiting_told_ = true;
  tell(FaultKind::WrongDevice, received, 1, out,
       fmt::format("the recorded database does not have the signals of the rig: {}", found.error().message));
}

void WheelDecoder::forget() {
  for (State& state : states_)
    state = {.counter = {},
             .counted = 0,
             .cycle = {},
             .pulses = {},
             .pulses_at = {},
             .speed = {},
             .distance_m = state.distance_m};
}

void WheelDecoder::flush(std::vector<Measurement>& out) {
  for (std::size_t i = 0; i < messages_.size(); ++i)
    if (CanCycle& cycle = states_[i].cycle; cycle.last())
      tell_missing(messages_[i], states_[i], cycle.settle(), *cycle.last(), out);
}

/// Tells losses that only the cycle of a message shows, if there are any. A counter shows all but whole turns of it.
void WheelDecoder::tell_missing(const Message& message, State& state, std::int64_t count, HostTime time,
                                std::vector<Measurement>& out) const {
  const std::int64_t others = count - std::exchange(state.counted, 0);
  if (!message.counter) {
    if (others > 0)
      tell(FaultKind::Lost, time, static_cast<std::uint64_t>(others), out,
           fmt::format("{} messages {} are missing, by their cycle: it has no counter", others, id_text(message)));
    return;
  }
  const std::int64_t turn = counter_range(*message.counter).count;
  if (const auto turns = std::llround(static_cast<double>(others) / static_cast<double>(turn)); turns > 0)
    tell(FaultKind::Lost, time, static_cast<std::uint64_t>(turns * turn), out,
         fmt::format("{} messages {} are missing, by their cycle: the counter went round", turns * turn,
                     id_text(message)));
}

bool WheelDecoder::take_other(const Packet& packet, std::vector<Measurement>& out) {
  const auto database = decode_database_packet(packet.bytes.bytes());
  if (database) take_database(*database, packet.received, out);
  return database.has_value();
}

void WheelDecoder::prepare(HostTime received, std::vector<Measurement>& out) {
  if (messages_.empty() && !std::exchange(is_waiting_told_, true))
    tell(FaultKind::WrongDevice, received, 1, out,
         "the rig names signals, and the recording holds no database (`dbc`) to find them in: nothing is decoded");
}

WheelDecoder::Use WheelDecoder::take(const CanFrame& frame, HostTime received, std::vector<Measurement>& out) {
  const auto known = std::find_if(messages_.begin(), messages_.end(), [&](const Message& message) {
    return message.id == frame.id && message.is_extended == frame.is_extended;
  });
  if (known == messages_.end()) return Use::Ignored;
  const Message& message = *known;
  State& state = states_[static_cast<std::size_t>(known - messages_.begin())];
  const std::size_t needed = needed_bytes(message);
  if (frame.length < needed) {
    tell(FaultKind::Malformed, received, 1, out,
         fmt::format("message {} has {} bytes, its signals need {}", id_text(message), frame.length, needed));
    return Use::Malformed;
  }
  if (message.checksum) {
    const std::uint8_t expected = can_checksum(message.checksum->kind, frame.bytes(), message.checksum->byte);
    if (frame.data[message.checksum->byte] != expected) {
      tell(FaultKind::Malformed, received, 1, out,
           fmt::format("message {} has check sum {:02X}, {:02X} expected", id_text(message),
                       frame.data[message.checksum->byte], expected));
      return Use::Malformed;
    }
  }
  if (!is_new(message, state, frame, received, out)) return Use::Ignored;
  WheelSpeed wheel;
  wheel.sensor = sensor();
  wheel.received = received;
  wheel.adapter_time = frame.adapter_time;
  wheel.speed = read_speed(message, state, frame, received, out);
  wheel.sigma = config_.sigma_speed;
  wheel.distance_m = read_distance(message, state, frame, received, out);
  wheel.is_directional = is_directional_;
  if (!wheel.speed && !wheel.distance_m) return Use::Ignored;
  out.push_back(wheel);
  return Use::Decoded;
}

/// Follows the message's counter and period, and reports losses. Returns false if the counter did not change: the
/// message came again, or its sender hangs.
bool WheelDecoder::is_new(const Message& message, State& state, const CanFrame& frame, HostTime received,
                          std::vector<Measurement>& out) {
  const CanCycle::Gap gap = state.cycle.take(received);
  if (gap.missing) tell_missing(message, state, *gap.missing, received, out);
  if (!message.counter) return true;
  const std::int64_t count = message.counter->raw(frame.bytes());
  const CounterRange range = counter_range(*message.counter);
  if (!range.has(count)) {
    tell(FaultKind::Implausible, received, 1, out,
         fmt::format("message {} has counter {}, which it never counts to: not used", id_text(message), count));
    return false;
  }
  // The counter gives the number of steps except for whole turns. Those the cycle gives, when it is known what came
  // late; but the same count again is a turn if there was time for one.
  std::int64_t steps = state.counter ? range.steps(*state.counter, count) : 1;
  if (steps == 0 && 2 * (gap.before + 1) >= range.count) steps = range.count;
  if (steps == 0) {
    tell(FaultKind::Spurious, received, 1, out,
         fmt::format("message {} came again with counter {}: not used", id_text(message), count));
    return false;
  }
  if (steps > 1)
    tell(FaultKind::Lost, received, static_cast<std::uint64_t>(steps - 1), out,
         fmt::format("message {} went from counter {} to {}: {} are missing", id_text(message),
                     state.counter.value_or(count), count, steps - 1));
  state.counted = std::min(state.counted + std::min(steps - 1, kMostCounted), kMostCounted);
  state.counter = count;
  return true;
}

std::optional<double> WheelDecoder::read_speed(const Message& message, State& state, const CanFrame& frame,
                                               HostTime received, std::vector<Measurement>& out) {
  if (message.speeds.empty()) return {};
  double sum = 0;
  int count = 0;
  for (const WheelSignal& signal : message.speeds) {
    if (!signal.is_in(frame.bytes())) continue;
    if (frame.length < signal.needed_bytes()) {
      tell(FaultKind::Malformed, received, 1, out,
           fmt::format("message {} has {} bytes, its multiplexed signal {} needs {}", id_text(message), frame.length,
                       signal.name, signal.needed_bytes()));
      continue;
    }
    const double value = signal.value(frame.bytes());
    if (signal.allows(value) && std::abs(value) <= config_.max_speed) {
      sum += value;
      ++count;
      continue;
    }
    tell(FaultKind::Implausible, received, 1, out,
         fmt::format("message {} says {:.2f} m/s: no speed of this vehicle, not used", id_text(message), value));
  }
  if (count == 0) return {};
  const double speed = sum / count;
  const double dt = to_seconds(received - state.speed_at);
  if (state.speed && dt >= 0 && dt <= kLongestStep_s && state.refused < kRefusedInARow &&
      std::abs(speed - *state.speed) > config_.max_acceleration * dt + kSpeedStep) {
    ++state.refused;
    tell(FaultKind::Implausible, received, 1, out,
         fmt::format("message {} leaps from {:.2f} to {:.2f} m/s within {:.3f} s: not used", id_text(message),
                     *state.speed, speed, dt));
    return {};
  }
  state.refused = 0;
  state.speed = speed;
  state.speed_at = received;
  return speed;
}

std::optional<double> WheelDecoder::read_distance(const Message& message, State& state, const CanFrame& frame,
                                                  HostTime received, std::vector<Measurement>& out) {
  if (message.pulses.empty()) return {};
  std::vector<std::int64_t> counts;
  for (const Pulses& pulses : message.pulses) {
    counts.push_back(pulses.signal.raw(frame.bytes()));
    if (counter_range(pulses.signal).has(counts.back())) continue;
    tell(FaultKind::Implausible, received, 1, out,
         fmt::format("message {} has {} pulses, which it never counts to: not used", id_text(message), counts.back()));
    return state.distance_m;
  }
  const std::vector<std::int64_t> before = std::exchange(state.pulses, counts);
  const std::optional<HostTime> last = std::exchange(state.pulses_at, received);
  if (!last) return state.distance_m;
  double sum = 0;
  const double most = config_.max_speed * std::max(0.0, to_seconds(received - *last));
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const Pulses& pulses = message.pulses[i];
    const CounterRange range = counter_range(pulses.signal);
    if (most > static_cast<double>(range.count) / 2 * pulses.metres_per_pulse) {
      tell(FaultKind::Implausible, received, 1, out,
           fmt::format("no message {} for {:.2f} s: its pulses may have wrapped, that distance is unknown",
                       id_text(message), to_seconds(received - *last)));
      return state.distance_m;
    }
    std::int64_t ahead = range.steps(before[i], counts[i]);
    if (ahead > range.count / 2) ahead -= range.count;  // the vehicle rolled back
    sum += static_cast<double>(ahead) * pulses.metres_per_pulse;
  }
  const double moved = sum / static_cast<double>(counts.size());
  // Messages may have waited on their way and come together. Only a distance far beyond that is a wrong count.
  const double usual = static_cast<double>(counter_range(message.pulses.front().signal).count) / 4 *
                       message.pulses.front().metres_per_pulse;
  if (std::abs(moved) > std::max(most, usual)) {
    tell(FaultKind::Implausible, received, 1, out,
         fmt::format("message {} counts {:.2f} m within {:.3f} s: not used", id_text(message), moved,
                     to_seconds(received - *last)));
    return state.distance_m;
  }
  state.distance_m += moved;
  return state.distance_m;
}

}  // namespace hueline::drivers
