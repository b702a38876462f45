#include "drivers/novatel/decoder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "drivers/novatel/ascii.hpp"
#include "drivers/novatel/messages.hpp"

namespace hueline::drivers {
namespace {

constexpr nanoseconds kSameMark{1000};  // far below the shortest interval between marks that a receiver can report

std::string message_name(const NovatelHeader& header, const NovatelMessageInfo* info) {
  if (header.is_response) return "response";
  const std::string name = info ? info->name : fmt::format("#{}", header.id);
  return header.antenna == 0 ? name : fmt::format("{}_{}", name, header.antenna);
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && static_cast<unsigned char>(text.back()) <= ' ') text.remove_suffix(1);
  while (!text.empty() && static_cast<unsigned char>(text.front()) <= ' ') text.remove_prefix(1);
  return text;
}

}  // namespace

void NovatelDecoder::Config::visit(Keys& keys) {
  keys.flag(
      {"accept_alignment_complete", "",
       "Whether points are also placed while the receiver says \"alignment complete\": it navigates, but the vehicle "
       "has not moved enough for it to keep its specification. Use this to try a rig on a standing vehicle."},
      accepts_alignment_complete);
}

KeyError NovatelDecoder::Config::validate() const {
  const std::string wrong = framer.validate();
  return {"", wrong.empty() ? imu.validate() : wrong};
}

NovatelDecoder::NovatelDecoder(const Config& config)
    : framer_(config.framer), imu_(config.imu), accepts_alignment_complete_(config.accepts_alignment_complete) {}

void NovatelDecoder::decode(const Packet& packet, std::vector<Measurement>& out) {
  sensor_ = packet.sensor;
  out_ = &out;
  framer_.feed(packet.bytes.bytes(), packet.received, *this);
  out_ = nullptr;
}

void NovatelDecoder::flush(std::vector<Measurement>& out) {
  out_ = &out;
  framer_.flush(*this);
  losses_.finish();
  if (auto lost = losses_.told(sensor_, newest_, true)) out.push_back(std::move(*lost));
  out_ = nullptr;
}

void NovatelDecoder::reset() {
  std::vector<Measurement> unheard;
  out_ = &unheard;
  framer_.discard(*this);
  out_ = nullptr;
  imu_.forget();
  losses_.forget();
  time_status_.reset();
  ins_is_good_ = false;
}

void NovatelDecoder::on_message(const NovatelMessage& message) {
  const NovatelHeader& header = message.header;
  const NovatelMessageInfo* info = find_novatel_message(header.id);
  count(header, info);
  bool used = false;
  measured_.reset();
  if (header.is_response) {
    // The body is a u32 response id (1 means OK) and then the text.
    if (message.body.size() >= 4 && field<std::uint32_t>(message.body, 0) != 1) {
      const auto text = message.body.subspan(4);
      fault(FaultKind::Refused, message.received, 1,
            fmt::format("command {} refused: {}", header.id,
                        trimmed({reinterpret_cast<const char*>(text.data()), text.size()})));
    }
  } else if (info && header.antenna == 0) {
    if (info->is_timely() && header.time_status) time_status_ = header.time_status;
    used = use(message, *info);
    if (info->is_timely()) note_arrival(message);
  }
  if (!header.is_response) watch_losses(message, info);
  (used ? counts_.decoded_bytes : counts_.ignored_bytes) += message.wire_bytes;
}

void NovatelDecoder::watch_losses(const NovatelMessage& message, const NovatelMessageInfo* info) {
  newest_ = message.received;
  const auto time = header_time(message.header);
  if (time_status_ && !time_is_fine())
    losses_.forget();
  else if (time)
    losses_.take(message, info, *time);
  if (auto lost = losses_.told(sensor_, newest_)) out_->push_back(std::move(*lost));
}

bool NovatelDecoder::use(const NovatelMessage& message, const NovatelMessageInfo& info) {
  const NovatelHeader& header = message.header;
  const auto body = message.body;
  // The body of a message with a fixed length is never shorter: the framer has checked it.
  switch (info.use) {
    case NovatelUse::InsPva:
    case NovatelUse::InsPvaX: {
      auto solution = info.use == NovatelUse::InsPva ? decode_inspva(body) : decode_inspvax(header, body);
      if (!solution) return false;
      if (accepts_alignment_complete_ && solution->status == kInsAlignmentComplete) solution->is_good = true;
      if (time_status_ && !time_is_fine()) solution->is_good = false;
      ins_is_good_ = solution->is_good;
      imu_.learn_attitude(*solution);
      return emit(std::move(solution), message.received);
    }
    case NovatelUse::InsStdev: {
      auto uncertainty = decode_insstdev(header, body);
      if (!uncertainty) return false;
      uncertainty->sensor = sensor_;
      measured_ = uncertainty->time;
      out_->emplace_back(*uncertainty);
      return true;
    }
    case NovatelUse::BestPos:
      return emit(decode_bestpos(header, body), message.received);
    case NovatelUse::Time: {
      bool used = false;
      use_time(message, used);
      return used;
    }
    case NovatelUse::MarkTime:
      return use_mark(decode_marktime(header, info.input, body), message.received);
    case NovatelUse::MarkPva:
      return use_mark(decode_markpva(header, info.input, body), message.received);
    case NovatelUse::RawImu:
      return emit(imu_.decode_rawimu(body), message.received);
    case NovatelUse::RawImuX:
      return emit(imu_.decode_rawimux(body), message.received);
    case NovatelUse::CorrImuData:
      return emit(imu_.decode_corrimudata(body), message.received);
    case NovatelUse::CorrImuS:
      return emit(imu_.decode_corrimus(header, body), message.received);
    case NovatelUse::ImuRateCorrImuS:
      return emit(imu_.decode_imuratecorrimus(body), message.received);
    case NovatelUse::InsConfig:
      if (body.size() >= 4) imu_.learn_type(static_cast<int>(std::min(field<std::uint32_t>(body, 0), 255u)));
      return false;
    case NovatelUse::Ignored:
      return false;
  }
  return false;
}

template <class T>
bool NovatelDecoder::emit(std::optional<T> measurement, HostTime received) {
  if (!measurement) return false;
  measurement->sensor = sensor_;
  measurement->received = received;
  measured_ = measurement->time;
  out_->emplace_back(std::move(*measurement));
  return true;
}

void NovatelDecoder::use_time(const NovatelMessage& message, bool& used) {
  auto time = decode_time(message.header, message.body);
  if (!time) return;
  time->label.sensor = sensor_;
  time->label.received = message.received;
  if (time->contradicts_utc)
    fault(FaultKind::LabelConflict, message.received, 1,
          "TIME: its UTC fields and its header name different seconds; label not trusted");
  out_->emplace_back(time->label);
  used = true;
}

bool NovatelDecoder::use_mark(std::optional<EventMark> mark, HostTime received) {
  if (!mark) return false;
  const auto input = static_cast<std::size_t>(mark->input);
  auto& seen = seen_marks_[input];
  const bool is_repeated = std::any_of(seen.begin(), seen.end(), [&](const auto& time) {
    return time && std::chrono::abs(*time - mark->time) < kSameMark;
  });
  if (is_repeated) {
    measured_ = mark->time;
    return true;  // the other message of the same event has already become the measurement
  }
  seen[next_seen_[input]++ % seen.size()] = mark->time;
  return emit(std::move(mark), received);
}

void NovatelDecoder::note_arrival(const NovatelMessage& message) {
  // Before the first long header, a good INS solution shows that the clock is fine: the filter does not start without
  // fine time.
  const bool is_fine_now = message.header.time_status ? is_fine(*message.header.time_status)
                                                      : (time_status_ ? time_is_fine() : ins_is_good_);
  const auto time = measured_ ? measured_ : header_time(message.header);
  if (is_fine_now && time) out_->emplace_back(TimedArrival{sensor_, message.received, *time});
}

void NovatelDecoder::on_text(std::string_view text, HostTime received) {
  // A prompt may stand before an ASCII log on the same line.
  const std::string_view line = text.substr(std::min(text.find_first_of("#%"), text.size()));
  if (is_novatel_ascii(line)) {
    const Result<NovatelAsciiLog> log = decode_novatel_ascii(trimmed(line));
    if (log.ok() && !log->body.empty()) return on_message({log->header, log->body, text.size(), received});
    if (!log.ok() && log.error().code == ErrorCode::Malformed) {
      const NovatelMessageInfo* info = find_novatel_ascii(novatel_ascii_name(line));
      return on_skipped(text.size(), 1, info ? info->id : std::uint16_t{0}, received);
    }
    // A log that is not used, or whose line is too long to be read, is counted by its name.
    counts_.ignored_bytes += text.size();
    ++counts_.messages[std::string(novatel_ascii_name(line)) + (log.ok() && log->header.antenna == 1 ? "_1" : "")];
    return;
  }
  counts_.ignored_bytes += text.size();
  ++counts_.messages["text"];
  if (text.find("<ERROR") != std::string_view::npos)
    fault(FaultKind::Refused, received, 1, fmt::format("the receiver answered {}", trimmed(text)));
}

void NovatelDecoder::on_skipped(std::uint64_t bytes, std::uint64_t messages, std::uint16_t first_id,
                                HostTime received) {
  counts_.malformed_bytes += bytes;
  counts_.malformed_messages += messages;
  losses_.skipped(bytes, messages);
  std::string detail = fmt::format("{} bytes skipped", bytes);
  if (messages > 0) {
    NovatelHeader header;
    header.id = first_id;
    detail += fmt::format(", {} broken message{} among them, first {}", messages, messages == 1 ? "" : "s",
                          message_name(header, find_novatel_message(first_id)));
  }
  fault(FaultKind::Malformed, received, bytes, std::move(detail));
}

void NovatelDecoder::count(const NovatelHeader& header, const NovatelMessageInfo* info) {
  const std::uint32_t key = header.is_response ? 0xFFFFFFFFu : (std::uint32_t{header.antenna} << 16 | header.id);
  if (const auto known = counters_.find(key); known != counters_.end()) {
    ++*known->second;
    return;
  }
  std::uint64_t& messages = counts_.of(message_name(header, info));
  if (counters_.size() < DecodeCounts::kMostNames) counters_[key] = &messages;
  ++messages;
}

void NovatelDecoder::fault(FaultKind kind, HostTime time, std::uint64_t number, std::string detail) {
  out_->emplace_back(Fault{sensor_, kind, time, number, std::move(detail)});
}

}  // namespace hueline::drivers
