#include "drivers/livox/livox_decoder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/calendar.hpp"

namespace hueline::drivers {
namespace {

using std::chrono::seconds;

/// A gap of the stamps up to this long is told in packets.
constexpr std::int64_t kLongestGapNs = 10'000'000'000;
/// A label is given up to this time after its second. Later the next second may begin before the packet arrives.
constexpr std::int64_t kLabelToNs = 900'000'000;
constexpr std::int64_t kSecondNs = 1'000'000'000;
/// Stamps from the year 2000 on are dates.
constexpr std::int64_t kYear2000Ns = 946'684'800'000'000'000;
/// Period of the scanner's own counter: 100 years.
constexpr nanoseconds kLongest = std::chrono::hours(876'000);
/// Intervals between the firings of the first generation: 100 000 firings a second (Mid) and 240 000 (the others).
constexpr std::array<double, 2> kIntervalsNs{10'000, 1e9 / 240'000};

struct ClockWords {
  SyncState state;
  const char* words;
};

ClockWords clock_of(const LivoxPacket& data) {
  if (data.is_clock_abnormal) return {SyncState::Unlocked, "the scanner says that what its clock follows is broken"};
  switch (data.time_kind) {
    case LivoxTimeKind::Own:
      return {SyncState::Unlocked, "no reference: time since power-up"};
    case LivoxTimeKind::Ptp:
      return {SyncState::Locked, "PTP; whether it counts TAI or UTC is the master's choice"};
    case LivoxTimeKind::Utc:
      return {SyncState::Locked, "PPS and UTC of a receiver"};
    case LivoxTimeKind::Pulse:
      return {SyncState::Locked, "PPS, without a receiver's date"};
    case LivoxTimeKind::Unknown:
      break;
  }
  return {SyncState::Unlocked, "a kind of time that is not known"};
}

}  // namespace

void LivoxDecoder::Config::visit(Keys& keys) {
  keys.choice({"clock", "",
               "The time scale of the PTP master that the scanner follows. `told`: the packets do not say it, so whole "
               "seconds come from the POS. `utc` and `tai` state it; then a packet of a scanner that follows no PTP "
               "and no receiver is not used."},
              scale, {{"told", Scale::Told}, {"utc", Scale::Utc}, {"tai", Scale::Tai}});
  keys.number({"min_range_m", "m", "Nearer returns are dropped."}, min_range_m, {0, 100});
  keys.number({"max_range_m", "m", "Farther returns are dropped. It is above `min_range_m`.", "none is dropped"},
              max_range_m, {0, 1100});
}

KeyError LivoxDecoder::Config::validate() const {
  if (KeyError wrong = check_keys(*this); !wrong.empty()) return wrong;
  if (max_range_m && *max_range_m <= min_range_m)
    return not_allowed("max_range_m", number_text(*max_range_m), "more than min_range_m");
  return {};
}

void LivoxDecoder::reset() {
  scanner_.reset();
  previous_.reset();
  arrivals_.reset();
  is_abnormal_told_ = false;
  told_second_.reset();
  told_state_.reset();
}

void LivoxDecoder::tell(const Packet& packet, FaultKind kind, std::uint64_t count, std::string what,
                        std::vector<Measurement>& out) const {
  out.push_back(Fault{sensor_, kind, packet.received, count, "Livox: " + what});
}

void LivoxDecoder::refuse(const Packet& packet, FaultKind kind, const std::string& what,
                          std::vector<Measurement>& out) {
  if (kind == FaultKind::Malformed) {
    counts_.malformed_bytes += packet.bytes.size();
    ++counts_.malformed_messages;
  } else {
    counts_.ignored_bytes += packet.bytes.size();
  }
  tell(packet, kind, 1, what, out);
}

void LivoxDecoder::decode(const Packet& packet, std::vector<Measurement>& out) {
  sensor_ = packet.sensor;
  const auto bytes = packet.bytes.bytes();
  const auto data = decode_livox(bytes);
  if (!data)
    return refuse(packet, FaultKind::Malformed,
                  fmt::format("datagram of {} bytes that is no packet of it", bytes.size()), out);
  if (data->form->returns == 0) {
    counts_.ignored_bytes += bytes.size();
    ++counts_.messages[data->form->name];
    return;
  }
  if (!scanner_) scanner_ = data->scanner;
  if (*scanner_ != data->scanner)
    return refuse(packet, FaultKind::WrongDevice,
                  fmt::format("packets of two scanners behind a hub: those of slot {}, number {} are not used",
                              data->scanner >> 8, data->scanner & 0xFF),
                  out);
  if (data->time_kind == LivoxTimeKind::Unknown || !data->time_ns)
    return refuse(packet, FaultKind::Malformed, "a time that cannot be", out);
  const auto time = time_of(*data);
  if (!time)
    return refuse(packet, FaultKind::NoTime, "it follows neither PTP nor a receiver, though the rig says so: not used",
                  out);
  if (!follow(packet, *data, out)) return;
  if (data->is_clock_abnormal && !is_abnormal_told_)
    tell(packet, FaultKind::NoTime, 1, "it says that what its clock follows is broken: its times are its own", out);
  is_abnormal_told_ = data->is_clock_abnormal;
  tell_clock(packet, *data, *time, out);

  LaserBatch batch;
  batch.sensor = sensor_;
  batch.received = packet.received;
  batch.packet_sequence = packet.sequence;
  batch.time = *time;
  kernel_.decode(*data, interval_ns(*data), batch.returns);
  counts_.decoded_bytes += bytes.size();
  points_.add(counts_, data->form->name);
  out.push_back(std::move(batch));
}

/// Returns the time of the first firing; nothing if the rig says that it is a date, and it is none.
std::optional<LaserTime> LivoxDecoder::time_of(const LivoxPacket& data) const {
  const nanoseconds time(*data.time_ns);
  switch (data.time_kind) {
    case LivoxTimeKind::Utc:
      return UnixTime(time);
    case LivoxTimeKind::Pulse:
      if (config_.scale != Scale::Told) return {};
      return LaserCounter{CounterOrigin::Utc, seconds(1), time % seconds(1)};
    case LivoxTimeKind::Ptp:
      if (config_.scale == Scale::Told) break;
      if (time.count() < kYear2000Ns) return {};
      if (config_.scale == Scale::Utc) return UnixTime(time);
      return unix_of_tai(time);
    case LivoxTimeKind::Own:
    case LivoxTimeKind::Unknown:
      if (config_.scale != Scale::Told) return {};
      break;
  }
  return LaserCounter{CounterOrigin::Own, kLongest, time};
}

/// Compares the packet with the one before. Returns whether to use it.
bool LivoxDecoder::follow(const Packet& packet, const LivoxPacket& data, std::vector<Measurement>& out) {
  const Previous now{data.time_kind, *data.time_ns, data.points, data.sequence, packet.received};
  if (!previous_) {
    previous_ = now;
    return true;
  }
  const Previous before = *previous_;
  if (before.time_kind != now.time_kind) {
    previous_ = now;
    tell(packet, FaultKind::ClockStep, 1, fmt::format("another clock stamps from now on: {}", clock_of(data).words),
         out);
    return true;
  }
  std::int64_t since = now.time_ns - before.time_ns;
  if (now.time_kind == LivoxTimeKind::Pulse && since < -kSecondNs / 2) since += kSecondNs;  // the next pulse came
  if (since == 0 && before.sequence == now.sequence) {
    ++counts_.messages["points again"];
    refuse(packet, FaultKind::Spurious, "the same packet came again", out);
    return false;
  }
  if (const auto found = arrivals_.add(nanoseconds(since), packet.received - before.received)) {
    tell(packet, found->kind, 1, found->words("its clock"), out);
    if (found->kind == FaultKind::ClockStep) {
      previous_ = now;
      return true;
    }
  }
  if (since < 0) {
    tell(packet, FaultKind::Late, 1, "a packet came after newer ones", out);
    return true;
  }
  const auto sequence_before = before.sequence.value_or(0);
  previous_ = now;
  follow_count(packet, data, since, sequence_before, out);
  return true;
}

void LivoxDecoder::follow_count(const Packet& packet, const LivoxPacket& data, std::int64_t since_ns,
                                std::uint16_t sequence_before, std::vector<Measurement>& out) {
  std::uint64_t missing = 0;
  if (data.sequence) {
    // 0 begins a frame, whose length is not known.
    const auto ahead = static_cast<std::uint16_t>(*data.sequence - sequence_before);
    if (*data.sequence != 0 && ahead > 1) missing = ahead - 1u;
  } else {
    const double packet_ns = static_cast<double>(since_ns) / static_cast<double>(data.points);
    for (const double interval : kIntervalsNs)
      if (std::abs(packet_ns - interval) < 0.1 * interval) learnt_interval_ns_ = interval;
    const double span = interval_ns(data) * static_cast<double>(data.points);
    if (static_cast<double>(since_ns) > 1.5 * span && since_ns < kLongestGapNs)
      missing = static_cast<std::uint64_t>(std::llround(static_cast<double>(since_ns) / span)) - 1;
  }
  if (missing > 0) tell(packet, FaultKind::Lost, missing, fmt::format("{} packets missing", missing), out);
}

double LivoxDecoder::interval_ns(const LivoxPacket& data) const {
  if (data.span_ns)
    return static_cast<double>(*data.span_ns) / static_cast<double>(std::max<std::size_t>(1, data.points));
  // The forms without a tag are those of the Mid-40.
  return learnt_interval_ns_.value_or(kIntervalsNs[data.form->has_tag ? 1 : 0]);
}

/// Says once a second what the stamps are worth, and which second it is.
void LivoxDecoder::tell_clock(const Packet& packet, const LivoxPacket& data, const LaserTime& time,
                              std::vector<Measurement>& out) {
  ClockWords clock = clock_of(data);
  const std::int64_t second = *data.time_ns / kSecondNs;
  if (told_second_ == second && told_state_ == clock.state) return;
  told_second_ = second;
  told_state_ = clock.state;
  const auto* utc = std::get_if<UnixTime>(&time);
  const bool is_ptp = data.time_kind == LivoxTimeKind::Ptp;
  out.push_back(LaserStatus{sensor_, packet.received, time, clock.state,
                            utc && is_ptp ? "PTP, time scale as the rig says" : clock.words});
  if (!utc || utc->time_since_epoch().count() % kSecondNs > kLabelToNs) return;
  TimeLabel label;
  label.sensor = sensor_;
  label.received = packet.received;
  label.second = from_unix(std::chrono::floor<seconds>(*utc));
  label.is_valid = clock.state == SyncState::Locked;
  out.push_back(label);
}

}  // namespace hueline::drivers
