#include "drivers/hesai/hesai_decoder.hpp"

#include <fmt/format.h>

#include <utility>

#include "core/calendar.hpp"
#include "drivers/hesai/hesai_angles.hpp"
#include "drivers/hesai/hesai_kernel.hpp"

namespace hueline::drivers {
namespace {

using std::chrono::seconds;

/// GPS packets come once a second; what they say holds for so long.
constexpr nanoseconds kStatusHolds = seconds(5);
/// A label is given up to this time after its second. Later the next second may begin before the packet arrives.
constexpr nanoseconds kLabelTo = std::chrono::milliseconds(900);

const char* const kModelSentence =
    "The scanner's model. Header or size of its packets have to agree with it, or there is fault WrongDevice.";

}  // namespace

void HesaiDecoder::Config::visit(Keys& keys) {
  keys.choice(required("model", "", kModelSentence), model,
              {{"Pandar40P", HesaiModel::Pandar40P},
               {"Pandar64", HesaiModel::Pandar64},
               {"PandarQT64", HesaiModel::Qt64},
               {"QT128", HesaiModel::Qt128},
               {"PandarXT-16", HesaiModel::Xt16},
               {"PandarXT-32", HesaiModel::Xt32},
               {"XT32M2X", HesaiModel::Xt32m2},
               {"OT128", HesaiModel::Ot128},
               {"Pandar128", HesaiModel::Pandar128}});
  keys.choice(
      {"clock", "",
       "What the scanner's clock follows. `told`: a GNSS receiver, and the scanner's GPS packets say whether it "
       "is locked. The data packets do not say whether a clock follows PTP, nor on which time scale: `ptp_utc` "
       "and `ptp_tai` state it."},
      reference, {{"told", Reference::Told}, {"ptp_utc", Reference::PtpUtc}, {"ptp_tai", Reference::PtpTai}});
  keys.number({"min_range_m", "m", "Nearer returns are dropped."}, min_range_m, {0, 100});
  keys.number({"max_range_m", "m", "Farther returns are dropped. It is above `min_range_m`.", "none is dropped"},
              max_range_m, {0, 400});
  keys.numbers(
      {"elevations_deg", "deg",
       "Elevation of each beam, in the order of the channels: the second column of the scanner's calibration "
       "file. Those of another model are refused: each beam has to be within 1.5 deg of the model's nominal one.",
       "the model's nominal ones"},
      elevations_deg, {-90, 90});
  keys.numbers({"azimuths_deg", "deg",
                "Azimuth of each beam against the block's: the third column of the calibration file. It is given with "
                "`elevations_deg`."},
               azimuths_deg, {-180, 180});
}

KeyError HesaiDecoder::Config::validate() const {
  if (KeyError wrong = check_keys(*this); !wrong.empty()) return wrong;
  if (max_range_m && *max_range_m <= min_range_m)
    return not_allowed("max_range_m", number_text(*max_range_m), "more than min_range_m");
  const std::size_t channels = hesai_table(model).beams.size();
  const std::string allowed = fmt::format("{} numbers, one for each channel, in both lists or in none", channels);
  if (!elevations_deg.empty() && elevations_deg.size() != channels)
    return not_allowed("elevations_deg", fmt::format("a list of {}", elevations_deg.size()), allowed);
  if (azimuths_deg.size() != elevations_deg.size())
    return not_allowed("azimuths_deg", fmt::format("a list of {}", azimuths_deg.size()), allowed);
  if (!elevations_deg.empty())
    if (const std::string wrong = why_not_of(hesai_table(model), {elevations_deg, azimuths_deg, {}}); !wrong.empty())
      return {"elevations_deg", wrong};
  return {};
}

HesaiDecoder::HesaiDecoder(const Config& config)
    : config_(config), table_(hesai_table(config.model)), kernel_(std::make_unique<HesaiKernel>(config)) {}

HesaiDecoder::~HesaiDecoder() = default;

void HesaiDecoder::reset() {
  counter_.reset();
  previous_.reset();
  arrivals_.reset();
  status_.reset();
  last_label_.reset();
}

void HesaiDecoder::refuse(const Packet& packet, FaultKind kind, const std::string& what,
                          std::vector<Measurement>& out) {
  if (kind == FaultKind::Malformed) {
    counts_.malformed_bytes += packet.bytes.size();
    ++counts_.malformed_messages;
  } else {
    counts_.ignored_bytes += packet.bytes.size();
  }
  out.push_back(Fault{sensor_, kind, packet.received, 1, what});
}

void HesaiDecoder::decode(const Packet& packet, std::vector<Measurement>& out) {
  sensor_ = packet.sensor;
  const auto bytes = packet.bytes.bytes();
  if (const auto gps = decode_hesai_gps(bytes)) return decode_gps(packet, *gps, out);
  const auto model = hesai_model(bytes);
  if (!model)
    return refuse(packet, FaultKind::Malformed,
                  fmt::format("{}: datagram of {} bytes that is no data packet of it", table_.name, bytes.size()), out);
  if (*model != config_.model)
    return refuse(
        packet, FaultKind::WrongDevice,
        fmt::format("data packet of a {}; the rig names a {}: the key model", hesai_table(*model).name, table_.name),
        out);
  const auto data = decode_hesai(bytes, table_);
  if (!data) return refuse(packet, FaultKind::Malformed, data.error().message, out);
  if (!follow(packet, *data, out)) return;
  if (!data->time)
    return refuse(packet, FaultKind::NoTime,
                  fmt::format("{}: its packets carry no date: it follows neither a receiver nor PTP", table_.name),
                  out);
  UnixTime time = *data->time;
  if (config_.reference == Reference::PtpTai) time = unix_of_tai(time.time_since_epoch());
  check_clock(packet, time, out);
  label(packet, time, out);

  LaserBatch batch;
  batch.sensor = sensor_;
  batch.received = packet.received;
  batch.packet_sequence = packet.sequence;
  const HesaiBlocks blocks = kernel_->decode(bytes, *data, batch.returns);
  batch.time = time + blocks.first_firing;
  const std::size_t bad_bytes = table_.block_bytes() * static_cast<std::size_t>(blocks.malformed);
  if (blocks.malformed > 0) {
    counts_.malformed_bytes += bad_bytes;
    ++counts_.malformed_messages;
    out.push_back(Fault{
        sensor_, FaultKind::Malformed, packet.received, 1,
        fmt::format("{}: {} of {} blocks have a wrong flag or azimuth", table_.name, blocks.malformed, table_.blocks)});
  }
  counts_.decoded_bytes += bytes.size() - bad_bytes;
  data_.add(counts_, data->returns == 1 ? "data" : data->returns == 2 ? "data dual" : "data triple");
  out.push_back(std::move(batch));
}

/// Returns whether to use the packet.
bool HesaiDecoder::follow(const Packet& packet, const HesaiPacket& data, std::vector<Measurement>& out) {
  if (!data.sequence) return true;
  const auto seen = counter_.add(*data.sequence);
  const auto tell = [&](FaultKind kind, std::uint64_t count, std::string detail) {
    out.push_back(Fault{sensor_, kind, packet.received, count, std::move(detail)});
  };
  using Verdict = CounterWatch::Verdict;
  switch (seen.verdict) {
    case Verdict::InOrder:
      break;
    case Verdict::Gap:
      tell(FaultKind::Lost, seen.missing, fmt::format("{}: {} data packets missing", table_.name, seen.missing));
      break;
    case Verdict::Late:
      tell(FaultKind::Late, 1,
           fmt::format("{}: a data packet came after newer ones, and had counted as lost", table_.name));
      break;
    case Verdict::Leap:
      tell(FaultKind::Lost, 1,
           fmt::format("{}: its count of packets leapt: it restarted, and what it sent meanwhile is not known",
                       table_.name));
      break;
    case Verdict::Twice:
      ++counts_.messages["data again"];
      refuse(packet, FaultKind::Spurious, fmt::format("{}: the same packet came again", table_.name), out);
      return false;
  }
  return true;
}

void HesaiDecoder::check_clock(const Packet& packet, UnixTime time, std::vector<Measurement>& out) {
  const auto before = std::exchange(previous_, Previous{time, packet.received});
  if (!before) return;
  if (const auto found = arrivals_.add(time - before->time, packet.received - before->received))
    out.push_back(
        Fault{sensor_, found->kind, packet.received, 1, fmt::format("{}: {}", table_.name, found->words("its clock"))});
}

void HesaiDecoder::decode_gps(const Packet& packet, const HesaiGps& gps, std::vector<Measurement>& out) {
  LaserStatus status;
  status.sensor = sensor_;
  status.received = packet.received;
  status.clock = gps.is_locked ? SyncState::Locked : SyncState::Unlocked;
  status.words = std::string(gps.is_locked ? "PPS locked" : "PPS not locked") + (gps.has_fix ? ", fix" : ", no fix");
  status_ = status;
  out.push_back(std::move(status));
  counts_.decoded_bytes += packet.bytes.size();
  ++counts_.messages["GPS"];
}

bool HesaiDecoder::is_locked(HostTime now) const {
  if (config_.reference != Reference::Told) return true;
  return status_ && status_->clock == SyncState::Locked && now - status_->received <= kStatusHolds;
}

void HesaiDecoder::label(const Packet& packet, UnixTime time, std::vector<Measurement>& out) {
  const auto second = std::chrono::floor<seconds>(time);
  if (time - second > kLabelTo) return;
  TimeLabel label;
  label.sensor = sensor_;
  label.received = packet.received;
  label.second = from_unix(second);
  label.is_valid = is_locked(packet.received);
  if (last_label_ && last_label_->second == label.second && last_label_->is_valid == label.is_valid) return;
  last_label_ = label;
  // The rig vouches for PTP, and nothing else reports the state of the clock.
  if (config_.reference != Reference::Told)
    out.push_back(LaserStatus{sensor_, packet.received, LaserTime(time), SyncState::Locked, "PTP, as the rig says"});
  out.push_back(label);
}

}  // namespace hueline::drivers
