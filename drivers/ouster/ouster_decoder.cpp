#include "drivers/ouster/ouster_decoder.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "core/calendar.hpp"
#include "drivers/ouster/ouster_kernel.hpp"

namespace hueline::drivers {
namespace {

using std::chrono::seconds;

/// The scanner is asked for its time once a second; what it answers holds for so long.
constexpr nanoseconds kReportHolds = seconds(5);
/// A label is given up to this time after its second. Later the next second may begin before the packet arrives.
constexpr std::uint64_t kLabelToNs = 900'000'000;
/// Stamps from the year 2000 on are dates; smaller ones count from when the scanner was switched on.
constexpr std::uint64_t kYear2000Ns = 946'684'800'000'000'000;
/// No stamp is larger: 100 years. It is the period of the scanner's own counter too.
constexpr nanoseconds kLongest = std::chrono::hours(876'000);
/// A scanner that follows PTP and is farther from its master has not settled. It takes up to a minute.
constexpr double kSettledNs = 100e3;

const char* words_of(OusterTimestampMode mode) {
  switch (mode) {
    case OusterTimestampMode::Unknown:
      return "its metadata do not say what its stamps count";
    case OusterTimestampMode::Oscillator:
      return "stamps from its own oscillator";
    case OusterTimestampMode::SyncPulse:
      return "stamps from its pulse input";
    case OusterTimestampMode::Ptp:
      return "stamps from PTP; whether they count TAI or UTC is the master's choice";
  }
  return "";
}

}  // namespace

void OusterDecoder::Config::visit(Keys& keys) {
  keys.choice(
      {"clock", "",
       "What the scanner's time stamps count. `told`: what its metadata and its own report of its clock say; as "
       "neither names the time scale of a PTP master, whole seconds come from the POS. `utc` (by NMEA "
       "sentences, or by PTP with a valid UTC offset) and `tai` (by PTP) state it, and that the clock is "
       "locked."},
      scale, {{"told", Scale::Told}, {"utc", Scale::Utc}, {"tai", Scale::Tai}});
  keys.number({"min_range_m", "m", "Nearer returns are dropped."}, min_range_m, {0, 100});
  keys.number({"max_range_m", "m", "Farther returns are dropped. It is above `min_range_m`.", "none is dropped"},
              max_range_m, {0, 1100});
}

KeyError OusterDecoder::Config::validate() const {
  if (KeyError wrong = check_keys(*this); !wrong.empty()) return wrong;
  if (max_range_m && *max_range_m <= min_range_m)
    return not_allowed("max_range_m", number_text(*max_range_m), "more than min_range_m");
  return {};
}

OusterDecoder::OusterDecoder(const Config& config, std::optional<OusterMetadata> metadata) : config_(config) {
  if (metadata) use(std::move(*metadata));
}

OusterDecoder::~OusterDecoder() = default;

void OusterDecoder::reset() {
  counter_.reset();
  frame_.reset();
  previous_.reset();
  arrivals_.reset();
  report_.reset();
  told_second_.reset();
  told_state_.reset();
}

void OusterDecoder::use(OusterMetadata metadata) {
  kernel_ = std::make_unique<OusterKernel>(metadata, config_.min_range_m, config_.max_range_m.value_or(1e9));
  name_ = metadata.name();
  const int in_frame = metadata.columns_per_frame / metadata.columns_per_packet;
  packets_.clear();
  packets_per_frame_ = 0;
  for (int i = 0; i < in_frame; ++i) {
    bool is_sent = false;
    for (int c = i * metadata.columns_per_packet; c < (i + 1) * metadata.columns_per_packet; ++c) {
      const bool from = c >= metadata.window_first, to = c <= metadata.window_last;
      is_sent |= metadata.window_first <= metadata.window_last ? from && to : from || to;
    }
    // A packet outside the window is not expected; if it comes nevertheless, it has the number of the next one.
    packets_.push_back(packets_per_frame_);
    packets_per_frame_ += is_sent ? 1 : 0;
  }
  metadata_ = std::move(metadata);
  counter_.reset();
  frame_.reset();
  init_id_.reset();
}

void OusterDecoder::tell(const Packet& packet, FaultKind kind, std::uint64_t count, std::string what,
                         std::vector<Measurement>& out) const {
  out.push_back(Fault{sensor_, kind, packet.received, count, name_ + ": " + what});
}

void OusterDecoder::refuse(const Packet& packet, FaultKind kind, const std::string& what,
                           std::vector<Measurement>& out) {
  if (kind == FaultKind::Malformed) {
    counts_.malformed_bytes += packet.bytes.size();
    ++counts_.malformed_messages;
  } else {
    counts_.ignored_bytes += packet.bytes.size();
  }
  tell(packet, kind, 1, what, out);
}

void OusterDecoder::ignore(const Packet& packet, const char* name) {
  counts_.ignored_bytes += packet.bytes.size();
  ++counts_.messages[name];
}

void OusterDecoder::decode(const Packet& packet, std::vector<Measurement>& out) {
  sensor_ = packet.sensor;
  const auto bytes = packet.bytes.bytes();
  if (is_json(bytes)) return decode_text(packet, out);
  if (!metadata_ || bytes.size() != metadata_->packet_bytes()) {
    if (const auto other = ouster_other(bytes)) return ignore(packet, *other == OusterOther::Imu ? "IMU" : "zones");
    if (!metadata_)
      return refuse(packet, FaultKind::Implausible,
                    "data before the scanner's metadata, which have the angles of its beams: not used. Name the file "
                    "with its metadata, or the address at which it can be asked",
                    out);
    if (looks_like_ouster(bytes))
      return refuse(packet, FaultKind::WrongDevice,
                    fmt::format("data packet of {} bytes; by its metadata ({} channels, {}) it has {}: its settings "
                                "were changed, or the metadata are another scanner's",
                                bytes.size(), metadata_->channels, metadata_->profile->name, metadata_->packet_bytes()),
                    out);
    return refuse(packet, FaultKind::Malformed,
                  fmt::format("datagram of {} bytes that is no packet of it", bytes.size()), out);
  }
  if (!is_ouster_packet(bytes, *metadata_))
    return refuse(packet, FaultKind::Malformed, "a data packet whose columns do not follow each other", out);
  const OusterHeader header = decode_ouster_header(bytes, *metadata_);
  if (!is_of_this_scanner(packet, header, out)) return;
  const int column = decode_ouster_column(bytes.data() + metadata_->head_bytes(), *metadata_).number;
  if (!follow(packet, header, column, out)) return;

  LaserBatch batch;
  const OusterColumns columns = kernel_->decode(bytes, batch.returns);
  if (columns.invalid == metadata_->columns_per_packet) return ignore(packet, "data outside the window");
  const auto time = time_of(columns.first_ns);
  if (!time) {
    if (columns.first_ns < kYear2000Ns)
      return refuse(packet, FaultKind::NoTime,
                    "its stamps count from when it was switched on: it follows neither a receiver nor PTP", out);
    return refuse(packet, FaultKind::Malformed, fmt::format("a stamp of {} ns", columns.first_ns), out);
  }
  check_clock(packet, columns.first_ns, out);
  tell_clock(packet, columns.first_ns, *time, out);
  batch.sensor = sensor_;
  batch.received = packet.received;
  batch.packet_sequence = packet.sequence;
  batch.time = *time;
  const std::size_t bad_bytes = metadata_->column_bytes() * static_cast<std::size_t>(columns.malformed);
  if (columns.malformed > 0) {
    counts_.malformed_bytes += bad_bytes;
    ++counts_.malformed_messages;
    tell(packet, FaultKind::Malformed, 1,
         fmt::format("{} of {} columns have a time that cannot be", columns.malformed, metadata_->columns_per_packet),
         out);
  }
  counts_.decoded_bytes += bytes.size() - bad_bytes;
  ++counts_.messages[metadata_->profile->name];
  out.push_back(std::move(batch));
}

void OusterDecoder::decode_text(const Packet& packet, std::vector<Measurement>& out) {
  const auto bytes = packet.bytes.bytes();
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (const auto clock = parse_ouster_clock(text); clock.ok()) {
    report_ = Report{*clock, packet.received};
    counts_.decoded_bytes += bytes.size();
    ++counts_.messages["time"];
    const State now = state(packet.received);
    told_state_ = now.clock;
    out.push_back(LaserStatus{sensor_, packet.received, {}, now.clock, now.words});
    return;
  }
  auto metadata = parse_ouster_metadata(text);
  if (!metadata.ok()) return refuse(packet, FaultKind::Malformed, metadata.error().message, out);
  counts_.decoded_bytes += bytes.size();
  ++counts_.messages["metadata"];
  use(std::move(metadata).value());
}

/// Returns whether the packet is one of the scanner that the metadata describe.
bool OusterDecoder::is_of_this_scanner(const Packet& packet, const OusterHeader& header,
                                       std::vector<Measurement>& out) {
  if (header.serial && metadata_->serial && *header.serial != *metadata_->serial) {
    refuse(packet, FaultKind::WrongDevice,
           fmt::format("data of the scanner {}; the metadata are those of {}, with the angles of other beams: not used",
                       *header.serial, *metadata_->serial),
           out);
    return false;
  }
  const bool is_hot = header.shuts_down || header.limits_shots;
  if (is_hot && !is_hot_)
    tell(packet, FaultKind::Implausible, 1,
         header.shuts_down ? "it is hot and about to switch itself off: cool it"
                           : "it is hot and limits its shots, or is about to: returns will be missing. Cool it",
         out);
  is_hot_ = is_hot;
  if (header.init_id && header.init_id != init_id_) {
    if (init_id_) {
      counter_.reset();
      frame_.reset();
      tell(packet, FaultKind::Lost, 1, "it was started again or has new settings; what it sent meanwhile is not known",
           out);
    }
    if (metadata_->init_id && *metadata_->init_id != *header.init_id)
      tell(packet, FaultKind::Implausible, 1,
           "the metadata are of an earlier start of the scanner, and its settings may have changed since: used as they "
           "are",
           out);
    init_id_ = header.init_id;
  }
  return true;
}

/// Returns whether to use the packet.
bool OusterDecoder::follow(const Packet& packet, const OusterHeader& header, int column,
                           std::vector<Measurement>& out) {
  std::int64_t frame = header.frame;
  if (frame_) {
    // The nearest number that the header's may stand for.
    const auto ahead =
        metadata_->is_fusa
            ? static_cast<std::int64_t>(static_cast<std::int32_t>(header.frame - static_cast<std::uint32_t>(*frame_)))
            : static_cast<std::int64_t>(static_cast<std::int16_t>(header.frame - static_cast<std::uint32_t>(*frame_)));
    frame = *frame_ + ahead;
    if (ahead > 0) frame_ = frame;
  } else {
    frame_ = frame;
  }
  const int number = packets_[static_cast<std::size_t>(column / metadata_->columns_per_packet)];
  const auto seen = counter_.add(static_cast<std::uint32_t>(frame * packets_per_frame_ + number));
  using Verdict = CounterWatch::Verdict;
  switch (seen.verdict) {
    case Verdict::InOrder:
      break;
    case Verdict::Gap:
      tell(packet, FaultKind::Lost, seen.missing, fmt::format("{} data packets missing", seen.missing), out);
      break;
    case Verdict::Late:
      tell(packet, FaultKind::Late, 1, "a data packet came after newer ones, and had counted as lost", out);
      break;
    case Verdict::Leap:
      frame_ = header.frame;
      tell(packet, FaultKind::Lost, 1,
           "its count of frames leapt: it restarted, and what it sent meanwhile is not known", out);
      break;
    case Verdict::Twice:
      ++counts_.messages["data again"];
      refuse(packet, FaultKind::Spurious, "the same packet came again", out);
      return false;
  }
  return true;
}

/// Returns the time that a stamp names; nothing if it cannot be one.
std::optional<LaserTime> OusterDecoder::time_of(std::uint64_t stamp_ns) const {
  if (stamp_ns >= static_cast<std::uint64_t>(kLongest.count())) return {};
  const nanoseconds since_1970(static_cast<std::int64_t>(stamp_ns));
  const bool is_date = stamp_ns >= kYear2000Ns;
  switch (config_.scale) {
    case Scale::Utc:
      if (!is_date) return {};
      return UnixTime(since_1970 - seconds(metadata_->nmea_leap_seconds));
    case Scale::Tai:
      if (!is_date) return {};
      return unix_of_tai(since_1970);
    case Scale::Told:
      break;
  }
  // The scanner adds the seconds that its settings name to the receiver's UTC.
  if (is_date && metadata_->timestamp_mode == OusterTimestampMode::SyncPulse && metadata_->reads_nmea)
    return UnixTime(since_1970 - seconds(metadata_->nmea_leap_seconds));
  return LaserCounter{CounterOrigin::Own, kLongest, since_1970};
}

void OusterDecoder::check_clock(const Packet& packet, std::uint64_t stamp_ns, std::vector<Measurement>& out) {
  const auto before = std::exchange(previous_, Previous{stamp_ns, packet.received});
  if (!before) return;
  const nanoseconds passed(static_cast<std::int64_t>(stamp_ns - before->stamp_ns));
  if (const auto found = arrivals_.add(passed, packet.received - before->received))
    tell(packet, found->kind, 1, found->words("its clock"), out);
}

OusterDecoder::State OusterDecoder::state(HostTime now) const {
  if (config_.scale != Scale::Told) return {SyncState::Locked, "locked, as the rig says"};
  const OusterTimestampMode told = metadata_ ? metadata_->timestamp_mode : OusterTimestampMode::Unknown;
  if (!report_ || now - report_->received > kReportHolds)
    return {SyncState::Unlocked, std::string(words_of(told)) + "; whether a reference holds its clock is not known"};
  const OusterClock& clock = report_->clock;
  const OusterTimestampMode mode = clock.mode == OusterTimestampMode::Unknown ? told : clock.mode;
  switch (mode) {
    case OusterTimestampMode::SyncPulse: {
      const bool needs_nmea = metadata_ && metadata_->reads_nmea;
      const bool is_locked = clock.is_pulse_locked && (clock.is_nmea_locked || !needs_nmea);
      std::string words = clock.is_pulse_locked ? "PPS locked" : "PPS not locked";
      if (needs_nmea) words += clock.is_nmea_locked ? ", NMEA locked" : ", NMEA not locked";
      return {is_locked               ? SyncState::Locked
              : clock.is_pulse_locked ? SyncState::Acquiring
                                      : SyncState::Unlocked,
              std::move(words)};
    }
    case OusterTimestampMode::Ptp: {
      if (clock.ptp_state != "SLAVE")
        return {clock.ptp_state == "UNCALIBRATED" ? SyncState::Acquiring : SyncState::Unlocked,
                "PTP port " + (clock.ptp_state.empty() ? std::string("in no state") : clock.ptp_state)};
      if (!clock.ptp_offset_ns) return {SyncState::Acquiring, "PTP port SLAVE, offset from the master not told"};
      return {std::abs(*clock.ptp_offset_ns) <= kSettledNs ? SyncState::Locked : SyncState::Acquiring,
              fmt::format("PTP port SLAVE, {:.0f} us from the master", *clock.ptp_offset_ns * 1e-3)};
    }
    case OusterTimestampMode::Oscillator:
    case OusterTimestampMode::Unknown:
      break;
  }
  return {SyncState::Unlocked, words_of(mode)};
}

/// Says once a second what the stamps are worth, and which second it is.
void OusterDecoder::tell_clock(const Packet& packet, std::uint64_t stamp_ns, const LaserTime& time,
                               std::vector<Measurement>& out) {
  const State now = state(packet.received);
  const std::uint64_t second = stamp_ns / 1'000'000'000;
  if (told_second_ == second && told_state_ == now.clock) return;
  told_second_ = second;
  told_state_ = now.clock;
  out.push_back(LaserStatus{sensor_, packet.received, time, now.clock, now.words});
  const auto* utc = std::get_if<UnixTime>(&time);
  if (!utc || stamp_ns % 1'000'000'000 > kLabelToNs) return;
  TimeLabel label;
  label.sensor = sensor_;
  label.received = packet.received;
  label.second = from_unix(std::chrono::floor<seconds>(*utc));
  label.is_valid = now.clock == SyncState::Locked;
  out.push_back(label);
}

}  // namespace hueline::drivers
