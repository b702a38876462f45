#include "drivers/sick/sick_decoder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <utility>

#include "core/portable_math.hpp"
#include "drivers/sick/cola_form.hpp"

namespace hueline::drivers {
namespace {

constexpr double kFullCircle = 2 * std::numbers::pi;
constexpr std::size_t kText = 1;          // index of ColaAForm in sick_forms()
constexpr std::uint16_t kRestart = 1000;  // a larger step of the counter is no loss
constexpr nanoseconds kClockPeriod = std::chrono::microseconds(std::int64_t{1} << 32);
constexpr std::size_t kMostEchoes = 5;
/// Smaller values are codes: no echo, dazzled.
constexpr std::uint16_t kSmallestDistance = 16;

std::vector<std::unique_ptr<MessageForm>> sick_forms() {
  std::vector<std::unique_ptr<MessageForm>> out;
  out.push_back(std::make_unique<ColaBForm>());
  out.push_back(std::make_unique<ColaAForm>());
  return out;
}

std::string status_words(std::uint16_t status) {
  switch (status & 0xFF) {
    case 0:
      return "device ok";
    case 1:
      return "device error";
    case 2:
      return "pollution warning";
    case 4:
      return "pollution error";
    default:
      return fmt::format("device status {}", status);
  }
}

/// Returns whether an answer says that the scanner did not do what it was told.
bool is_refusal(const SickTelegram& telegram) {
  if (telegram.command != "sAN" || telegram.values.empty()) return false;
  if (telegram.name != "SetAccessMode" && telegram.name != "Run") return false;
  const std::byte last = telegram.values.back();
  return last == std::byte{0} || last == std::byte{'0'};
}

}  // namespace

void SickDecoder::Config::visit(Keys& keys) {
  keys.choice(
      {"clock", "",
       "The stamp of a scan that is used. `counter`: the scanner's time since power-up, which is related to GPS "
       "time by arrivals; `utc`: date and time in the telegram, for a scanner whose clock NTP sets."},
      clock, {{"counter", Clock::Counter}, {"utc", Clock::Utc}});
  keys.angle({"index_angle_deg", "deg", "The mirror's angle at the stamp of a scan."}, index_angle, {-360, 360});
  keys.number({"min_range_m", "m", "Nearer returns are dropped."}, min_range_m, {0, 1000});
  keys.number({"max_range_m", "m", "Farther returns are dropped. It is above `min_range_m`."}, max_range_m,
              {0, 10'000});
  keys.angle({"angle_begin_deg", "deg", "Angles of the scanner are kept from here ..."}, angle_begin, {-180, 360});
  keys.angle({"angle_end_deg", "deg", "... to here."}, angle_end, {-180, 360});
}

KeyError SickDecoder::Config::validate() const {
  if (KeyError wrong = check_keys(*this); !wrong.empty()) return wrong;
  if (max_range_m <= min_range_m) return not_allowed("max_range_m", number_text(max_range_m), "more than min_range_m");
  if (angle_end <= angle_begin)
    return not_allowed("angle_end_deg", number_text(angle_end / kRadPerDeg), "more than angle_begin_deg");
  return {};
}

SickDecoder::SickDecoder(const Config& config) : StreamDecoder(sick_forms()), config_(config) {}

bool SickDecoder::take(const Message& message) {
  const bool is_text = message.form == kText;
  const auto telegram =
      read_sick_telegram(is_text ? message.bytes.subspan(1, message.bytes.size() - kColaAOverheadBytes)
                                 : message.bytes.subspan(kColaBHeaderBytes, message.bytes.size() - kColaBOverheadBytes),
                         is_text);
  if (!telegram.ok()) {
    name("unknown");
    fault(FaultKind::Malformed, message.received, message.bytes.size(), telegram.error().message);
    return false;
  }
  if (telegram->command == "sFA") {
    name("sFA");
    const std::uint32_t code = sick_error_code(*telegram);
    fault(FaultKind::Refused, message.received, 1,
          fmt::format("the scanner answered a command with error {:X}: {}", code, sick_error(code)));
    return true;
  }
  // Names come from the bytes of a stream: only those that are known get a count of their own.
  const bool is_scan = telegram->name == "LMDscandata" && (telegram->command == "sSN" || telegram->command == "sRA");
  name(is_scan ? "LMDscandata" : "answer");
  if (is_scan) return take_scan(*telegram, message.received);
  if (!is_refusal(*telegram)) return false;
  fault(FaultKind::Refused, message.received, 1,
        fmt::format("the scanner refused {}: another program may be logged in, or its password was changed",
                    telegram->name));
  return true;
}

bool SickDecoder::take_scan(const SickTelegram& telegram, HostTime received) {
  const auto scan = read_sick_scan(telegram);
  if (!scan.ok() || !(scan->scan_hz >= 0.1 && scan->scan_hz <= 10'000)) {
    fault(FaultKind::Malformed, received, 1,
          scan.ok() ? fmt::format("LMDscandata: a scan frequency of {:.2f} Hz", scan->scan_hz) : scan.error().message);
    return false;
  }
  if (!follow(scan->telegrams, received)) return false;
  tell_status(*scan, received);
  // The planes of such a scanner take turns, and one of them is 0.
  fault_once(has_planes_ || scan->layer != 0, has_planes_, FaultKind::WrongDevice, received,
             "scans of several planes: this scanner is not supported, only those with one plane (LMS5xx, LMS1xx)");
  if (has_planes_) return false;
  const auto first =
      std::ranges::find_if(scan->channels, [](const SickChannel& c) { return c.name.starts_with("DIST"); });
  if (first == scan->channels.end()) return true;

  const bool is_set = scan->clock && *scan->clock > UnixTime(std::chrono::hours(24 * 365 * 10));
  fault_once(config_.clock == Clock::Utc && !is_set, has_no_clock_, FaultKind::NoTime, received,
             "the scanner's clock is not set: point it at an NTP server, or use `clock: counter`");
  if (config_.clock == Clock::Utc && !is_set) return false;
  LaserBatch batch;
  const nanoseconds to_first = from_seconds((first->start - config_.index_angle) / (kFullCircle * scan->scan_hz));
  if (config_.clock == Clock::Utc) {
    batch.time = *scan->clock + to_first;
  } else {
    const nanoseconds value =
        (std::chrono::microseconds(scan->since_start_us) + to_first + kClockPeriod) % kClockPeriod;
    batch.time = LaserCounter{CounterOrigin::Own, kClockPeriod, value};
  }
  batch.returns = returns_of(*scan);
  emit(std::move(batch), received);
  return true;
}

void SickDecoder::forget() {
  telegrams_.reset();
  words_.clear();
  has_planes_ = false;
}

/// Follows the counter of telegrams. Returns false for one that came before.
bool SickDecoder::follow(std::uint16_t telegrams, HostTime received) {
  const std::optional<std::uint16_t> last = std::exchange(telegrams_, telegrams);
  if (!last) return true;
  const auto step = static_cast<std::uint16_t>(telegrams - *last);
  if (step == 0)
    fault(FaultKind::Spurious, received, 1, fmt::format("scan telegram {} came twice; used once", telegrams));
  else if (step > 1 && step <= kRestart)
    fault(FaultKind::Lost, received, step - 1U,
          fmt::format("{} scans missing before telegram {}", step - 1, telegrams));
  else if (step > kRestart)
    fault(FaultKind::Lost, received, 1,
          fmt::format("the count of scans leapt to {}: the scanner restarted, and what it sent meanwhile is not known",
                      telegrams));
  return step != 0;
}

void SickDecoder::tell_status(const SickScan& scan, HostTime received) {
  LaserStatus status;
  const bool is_utc = config_.clock == Clock::Utc && scan.clock.has_value();
  // Telegrams do not say whether NTP still disciplines the clock. A rig that says so is believed.
  status.clock = is_utc ? SyncState::Locked : SyncState::Unlocked;
  status.words = status_words(scan.status) + (is_utc ? ", clock set by NTP as the rig says" : ", own clock");
  if (status.words == words_) return;
  words_ = status.words;
  emit(std::move(status), received);
}

std::vector<LaserReturn> SickDecoder::returns_of(const SickScan& scan) const {
  // Channels by echo: DIST1 and RSSI1 are those of the first.
  std::array<const SickChannel*, kMostEchoes> distances{}, strengths{};
  std::size_t values = 0;
  for (const SickChannel& channel : scan.channels) {
    if (channel.name.size() != 5 || channel.name[4] < '1' || channel.name[4] > '5') continue;
    const auto echo = static_cast<std::size_t>(channel.name[4] - '1');
    if (channel.name.starts_with("DIST")) {
      distances[echo] = &channel;
      values = std::max(values, channel.values.size());
    }
    if (channel.name.starts_with("RSSI")) strengths[echo] = &channel;
  }
  std::vector<LaserReturn> out;
  out.reserve(values);
  for (std::size_t i = 0; i < values; ++i) {
    const std::size_t begin = out.size();
    std::uint8_t count = 0;
    for (std::size_t echo = 0; echo < kMostEchoes; ++echo) {
      const SickChannel* channel = distances[echo];
      if (!channel || i >= channel->values.size() || channel->values[i] < kSmallestDistance) continue;
      const double range = (channel->values[i] * channel->scale + channel->offset) * 1e-3;
      const double angle = channel->start + static_cast<double>(i) * channel->step;
      ++count;
      if (range < config_.min_range_m || range > config_.max_range_m || angle < config_.angle_begin ||
          angle > config_.angle_end)
        continue;
      LaserReturn one;
      one.range_m = static_cast<float>(range);
      one.x = static_cast<float>(range * portable::cos(angle));
      one.y = static_cast<float>(range * portable::sin(angle));
      const double turned = angle - kFullCircle * std::floor(angle / kFullCircle);
      one.azimuth = static_cast<float>(turned < kFullCircle - 1e-6 ? turned : 0.0);
      one.time_offset_ns = static_cast<std::int32_t>(
          std::llround(1e9 * static_cast<double>(i) * channel->step / (kFullCircle * scan.scan_hz)));
      if (const SickChannel* rssi = strengths[echo]; rssi && i < rssi->values.size())
        one.reflectivity = static_cast<std::uint8_t>(rssi->is_byte ? rssi->values[i] : rssi->values[i] >> 8);
      out.push_back(one);
    }
    std::sort(out.begin() + static_cast<std::ptrdiff_t>(begin), out.end(),
              [](const LaserReturn& a, const LaserReturn& b) { return a.range_m < b.range_m; });
    for (std::size_t k = begin; k < out.size(); ++k) {
      out[k].return_number = static_cast<std::uint8_t>(k - begin + 1);
      out[k].return_count = count;
    }
  }
  return out;
}

void SickOutput::visit(Keys& keys) {
  keys.choice({"form", "",
               "The form of the telegrams that the scanner's port expects: `cola_b` is binary (usually port 2112), "
               "`cola_a` is text (2111)."},
              form, {{"cola_b", Form::ColaB}, {"cola_a", Form::ColaA}});
  keys.choice({"echoes", "", "Which echoes of a firing the scanner sends."}, echoes,
              {{"first", Echoes::First}, {"all", Echoes::All}, {"last", Echoes::Last}});
  keys.flag({"rssi", "", "Whether it sends the strength of each echo."}, rssi);
}

std::string SickOutput::dialogue() const {
  const auto filter = static_cast<std::uint8_t>(echoes);
  const std::uint8_t channels = echoes == Echoes::All ? 0x1F : 0x01, with_rssi = rssi ? 1 : 0;
  // The login is that of an authorised client, with the password that the maker ships.
  if (form == Form::ColaA)
    return make_cola_a("sMN SetAccessMode 03 F4724744") + make_cola_a(fmt::format("sWN FREchoFilter {}", filter)) +
           make_cola_a(fmt::format("sWN LMDscandatacfg {:02X} 00 {} 0 0 00 00 0 0 0 1 +1", channels, with_rssi)) +
           make_cola_a("sMN Run") + make_cola_a("sEN LMDscandata 1");
  return make_cola_b("sMN SetAccessMode", {3, 0xF4, 0x72, 0x47, 0x44}) + make_cola_b("sWN FREchoFilter", {filter}) +
         make_cola_b("sWN LMDscandatacfg", {channels, 0, with_rssi, 0, 0, 0, 0, 0, 0, 0, 1, 0, 1}) +
         make_cola_b("sMN Run", {}) + make_cola_b("sEN LMDscandata", {1});
}

}  // namespace hueline::drivers
