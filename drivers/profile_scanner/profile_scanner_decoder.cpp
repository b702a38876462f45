#include "drivers/profile_scanner/profile_scanner_decoder.hpp"

#include <fmt/format.h>

#include <numbers>
#include <utility>

#include "core/calendar.hpp"
#include "drivers/label_limit.hpp"
#include "drivers/profile_scanner/profile_scanner_kernel.hpp"

namespace hueline::drivers {
namespace {

using std::chrono::seconds;

constexpr nanoseconds kCounterPeriod = seconds(std::int64_t{1} << 32U);

LaserTime time_of(const ProfileHeader& header) {
  const nanoseconds since = seconds(header.second) + nanoseconds(header.nanosecond);
  if (header.scale == ProfileTimeScale::Gps) return GpsTime(since);
  if (header.scale == ProfileTimeScale::Utc) return UnixTime(since);
  return LaserCounter{CounterOrigin::Own, kCounterPeriod, since};
}

}  // namespace

void ProfileScannerDecoder::Config::visit(Keys& keys) {
  keys.whole(
      {"scanner_id", "",
       "The scanner's number in its datagrams. Datagrams of other scanners on its ports cause fault WrongDevice.",
       "0: the first that sends"},
      scanner_id, {0, 65535});
  keys.number({"min_range_m", "m", "Nearer returns are dropped."}, min_range_m, {0, 1000});
  keys.number({"max_range_m", "m", "Farther returns are dropped. It is above `min_range_m`."}, max_range_m,
              {0, 10'000});
  keys.angle({"angle_begin_deg", "deg", "Mirror angles are kept from here ..."}, angle_begin, {0, 360, Ends::MinOnly});
  keys.angle({"angle_end_deg", "deg", "... to here, through 0 if it is smaller than `angle_begin_deg`."}, angle_end,
             {0, 360});
}

KeyError ProfileScannerDecoder::Config::validate() const {
  if (KeyError wrong = check_keys(*this); !wrong.empty()) return wrong;
  if (max_range_m <= min_range_m) return not_allowed("max_range_m", number_text(max_range_m), "more than min_range_m");
  if (angle_begin == angle_end)
    return {"angle_end_deg", "is equal to angle_begin_deg, so no angle would be kept; allowed: another one"};
  return {};
}

ProfileScannerDecoder::ProfileScannerDecoder(const Config& config)
    : config_(config), kernel_(std::make_unique<ProfileScannerKernel>(config)) {
  if (config.scanner_id != 0) scanner_ = static_cast<std::uint16_t>(config.scanner_id);
}

ProfileScannerDecoder::~ProfileScannerDecoder() = default;

void ProfileScannerDecoder::reset() {
  data_counter_.reset();
  status_counter_.reset();
  last_label_.reset();
}

void ProfileScannerDecoder::decode(const Packet& packet, std::vector<Measurement>& out) {
  sensor_ = packet.sensor;
  const Result<ProfileHeader> header = decode_profile_header(packet.bytes.bytes());
  if (!header) return malformed(packet, header.error().message, out);
  if (!is_ours(packet, *header, out)) return;
  if (header->kind == ProfileKind::Data)
    decode_data(packet, *header, out);
  else
    decode_status(packet, *header, out);
}

void ProfileScannerDecoder::malformed(const Packet& packet, const std::string& what, std::vector<Measurement>& out) {
  counts_.malformed_bytes += packet.bytes.size();
  ++counts_.malformed_messages;
  out.push_back(Fault{sensor_, FaultKind::Malformed, packet.received, 1, "profile scanner: " + what});
}

bool ProfileScannerDecoder::is_ours(const Packet& packet, const ProfileHeader& header, std::vector<Measurement>& out) {
  if (!scanner_) scanner_ = header.scanner;
  if (*scanner_ == header.scanner) return true;
  ++counts_.messages["of another scanner"];
  counts_.ignored_bytes += packet.bytes.size();
  out.push_back(Fault{sensor_, FaultKind::WrongDevice, packet.received, 1,
                      fmt::format("datagram of scanner {}; this one is {}", header.scanner, *scanner_)});
  return false;
}

bool ProfileScannerDecoder::follow(const Packet& packet, const ProfileHeader& header, std::optional<std::uint32_t> line,
                                   std::vector<Measurement>& out) {
  const char* what = line ? "data" : "status";
  const auto seen = (line ? data_counter_ : status_counter_).add(header.counter);
  const auto tell = [&](FaultKind kind, std::uint64_t count, std::string detail) {
    out.push_back(Fault{sensor_, kind, packet.received, count, std::move(detail)});
  };
  using Verdict = CounterWatch::Verdict;
  switch (seen.verdict) {
    case Verdict::InOrder:
      break;
    case Verdict::Gap:
      tell(FaultKind::Lost, seen.missing,
           fmt::format("scanner {}: {} {} datagrams missing before number {}{}", header.scanner, seen.missing, what,
                       header.counter, line ? fmt::format(", line {}", *line) : std::string()));
      break;
    case Verdict::Late:
      tell(FaultKind::Late, 1,
           fmt::format("scanner {}: {} datagram {} came after newer ones, and had counted as lost", header.scanner,
                       what, header.counter));
      break;
    case Verdict::Leap:
      tell(FaultKind::Lost, 1,
           fmt::format("scanner {}: its count of {} datagrams leapt to {}: it restarted, and what it sent meanwhile is "
                       "not known",
                       header.scanner, what, header.counter));
      break;
    case Verdict::Twice:
      ++counts_.messages[line ? "data twice" : "status twice"];
      counts_.ignored_bytes += packet.bytes.size();
      tell(FaultKind::Spurious, 1,
           fmt::format("scanner {}: {} datagram {} came twice; used once", header.scanner, what, header.counter));
      return false;
  }
  return true;
}

void ProfileScannerDecoder::decode_data(const Packet& packet, const ProfileHeader& header,
                                        std::vector<Measurement>& out) {
  const Result<ProfileData> data = decode_profile_data(packet.bytes.bytes());
  if (!data) return malformed(packet, data.error().message, out);
  if (!follow(packet, header, data->line, out)) return;
  LaserBatch batch;
  batch.sensor = sensor_;
  batch.received = packet.received;
  batch.packet_sequence = packet.sequence;
  batch.time = time_of(header);
  kernel_->decode(*data, batch.returns);
  counts_.decoded_bytes += packet.bytes.size();
  ++counts_.messages["data"];
  out.push_back(std::move(batch));
}

void ProfileScannerDecoder::decode_status(const Packet& packet, const ProfileHeader& header,
                                          std::vector<Measurement>& out) {
  const Result<ProfileStatus> status = decode_profile_status(packet.bytes.bytes());
  if (!status) return malformed(packet, status.error().message, out);
  if (!follow(packet, header, std::nullopt, out)) return;
  counts_.decoded_bytes += packet.bytes.size();
  ++counts_.messages["status"];
  LaserStatus said;
  said.sensor = sensor_;
  said.received = packet.received;
  said.time = time_of(header);
  said.clock = status->pps.clock;
  said.words = status->pps.words + (!status->has_label       ? ", seconds not named"
                                    : status->is_label_valid ? ", seconds named"
                                                             : ", seconds named without a fix");
  out.push_back(std::move(said));
  label(packet, header, *status, out);
}

void ProfileScannerDecoder::label(const Packet& packet, const ProfileHeader& header, const ProfileStatus& status,
                                  std::vector<Measurement>& out) {
  if (!status.has_label || header.scale == ProfileTimeScale::None) return;
  const nanoseconds since =
      seconds(std::int64_t{header.second} - std::int64_t{status.edge_second}) + nanoseconds(header.nanosecond);
  if (since < nanoseconds(0) || since > kLabelTo) return;
  TimeLabel label;
  label.sensor = sensor_;
  label.received = packet.received;
  label.second = header.scale == ProfileTimeScale::Gps ? GpsTime(seconds(status.edge_second))
                                                       : from_unix(UnixTime(seconds(status.edge_second)));
  label.is_valid = status.is_label_valid && status.pps.clock == SyncState::Locked;
  if (last_label_ && last_label_->second == label.second && last_label_->is_valid == label.is_valid) return;
  last_label_ = label;
  out.push_back(label);
}

}  // namespace hueline::drivers
