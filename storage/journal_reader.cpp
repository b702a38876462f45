#include "storage/journal_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <utility>

#include "storage/raw_packet.hpp"

namespace hueline::storage {
namespace {

Result<JournalHeader> read_header(const std::filesystem::path& path, McapReader& mcap) {
  JournalHeader header;
  bool described = false;
  for (const McapMetadata& metadata : mcap.metadata())
    if (metadata.name == kJournalMetadata) {
      header.about = metadata.values;
      const std::string format = header.about["format"];
      header.about.erase("format");
      header.has_packed_images = format == kPackedJournalFormat;
      if (format != kJournalFormat && !header.has_packed_images)
        return Error{ErrorCode::Unsupported, path.string() + " has recording format \"" + format +
                                                 "\", this program reads " + kJournalFormat + " and " +
                                                 kPackedJournalFormat + ": use a newer one"};
      described = true;
    }
  for (const auto& [id, channel] : mcap.channels()) {
    const auto schema = mcap.schemas().find(channel.schema_id);
    if (schema == mcap.schemas().end() || schema->second.name != kRawPacketSchema) continue;
    const auto value = [&facts = channel.metadata](const char* key) {
      const auto found = facts.find(key);
      return found == facts.end() ? std::string() : found->second;
    };
    if (header.sensors.size() <= id) header.sensors.resize(id + std::size_t{1});
    header.sensors[id] = {value("name"), value("device")};
  }
  for (const McapAttachment& file : mcap.attachments()) header.files.push_back({file.name, file.media_type, file.data});
  if (described && !header.sensors.empty()) return header;
  // A file that was cut inside its header returns that error instead.
  Result<McapMessage> first = mcap.next();
  if (!first && first.error().code != ErrorCode::EndOfData) return first.error();
  return Error{ErrorCode::Unsupported, path.string() + " is an MCAP file, but not a recording of raw packets"};
}

/// Returns what the last segment of the recording says of the others. A program that was killed may have left one
/// without a header, or somebody a file of another recording, behind it.
SegmentPlace place_of_newest(const std::vector<Segment>& segments, const std::string& recording) {
  for (std::size_t i = segments.size(); i-- > 1;) {
    auto mcap = McapReader::open(segments[i].path);
    if (!mcap.ok()) continue;
    const auto header = read_header(segments[i].path, *mcap);
    if (!header.ok()) continue;
    if (SegmentPlace place = SegmentPlace::of(*header); place.recording == recording) return place;
  }
  return {};
}

}  // namespace

Result<std::unique_ptr<JournalReader>> JournalReader::open(const std::filesystem::path& path) {
  std::unique_ptr<JournalReader> reader(new JournalReader(path));
  if (Status opened = reader->open_first(); !opened) return opened.error();
  return reader;
}

Status JournalReader::open_first() {
  Result<McapReader> mcap = McapReader::open(path_);
  if (!mcap) return mcap.error();
  Result<JournalHeader> header = read_header(path_, *mcap);
  if (!header) return header.error();
  header_ = std::move(*header);
  mcap_ = std::move(*mcap);
  mcap_->skip_chunks_without(only_);
  recording_ = SegmentPlace::of(header_).recording;
  segments_ = {first_of(path_)};
  segments_.front().path = path_;
  if (!recording_.empty()) {
    const auto found = find_segments(path_);
    if (!found.ok()) return found.error();
    if (found->front().path == path_) segments_ = *found;
  }
  newest_ = place_of_newest(segments_, recording_);
  file_size_ = mcap_->file_size();
  for (std::size_t i = 1; i < segments_.size(); ++i)
    if (const auto file = InputFile::open(segments_[i].path); file.ok()) file_size_ += file->size();
  at_ = 0;
  bytes_before_ = 0;
  segments_missed_ = 0;
  last_sequence_.reset();
  peeked_.reset();
  end_.reset();
  untouched_ = true;
  return {};
}

Status JournalReader::open() { return mcap_ && untouched_ ? Status() : open_first(); }

Result<Packet> JournalReader::next(std::stop_token stop) {
  if (stop.stop_requested()) return Error{ErrorCode::Stopped, "stopped while reading " + path_.string()};
  if (!peeked_) return read_next();
  Result<Packet> packet = std::move(*peeked_);
  peeked_.reset();
  return packet;
}

const Result<Packet>& JournalReader::peek() {
  if (!peeked_) peeked_ = read_next();
  return *peeked_;
}

Result<Packet> JournalReader::read_next() {
  if (end_) return *end_;
  if (!mcap_ && segments_.empty()) return Error{ErrorCode::Invalid, path_.string() + " is not open"};
  untouched_ = false;
  while (true) {
    Result<Packet> packet = next_of_segment();
    if (packet) {
      last_sequence_ = packet->sequence;
      if (skip_before_ > 0 && count_ns(packet->received) >= static_cast<std::int64_t>(skip_before_)) {
        skip_before_ = 0;
        mcap_->skip_chunks_before(0);
      }
      return packet;
    }
    const ErrorCode code = packet.error().code;
    const bool is_over = code == ErrorCode::EndOfData || code == ErrorCode::Truncated || code == ErrorCode::Io ||
                         code == ErrorCode::Unsupported;
    if (!is_over || !is_other_segment_left()) return packet;
    if (Status gone_on = go_on(packet.error()); !gone_on) return gone_on.error();
  }
}

Result<Packet> JournalReader::next_of_segment() {
  // A segment that could not be opened has been reported.
  if (!mcap_) return Error{ErrorCode::EndOfData, "end of " + segments_[at_].path.string()};
  while (true) {
    Result<McapMessage> message = mcap_->next();
    if (!message) return message.error();
    const auto& channel = mcap_->channels().at(message->channel);
    const auto schema = mcap_->schemas().find(channel.schema_id);
    // Messages that other programs have added.
    if (schema == mcap_->schemas().end() || schema->second.name != kRawPacketSchema) continue;
    Result<Packet> packet = decode_raw_packet(message->data);
    if (packet && packet->sensor != message->channel)
      return Error{ErrorCode::Malformed, segments_[at_].path.string() + ": a packet of sensor " +
                                             std::to_string(packet->sensor) + " on " + channel.topic};
    return packet;
  }
}

/// Returns the next segment, if the list does not have it yet and the present one has ended: it was closed, or the next
/// one has a packet already, which is written after the present one was left.
std::optional<Segment> JournalReader::segment_begun_since() const {
  if (recording_.empty() || is_other_segment_left()) return {};
  const auto found = find_segments(path_);
  if (!found.ok()) return {};
  const auto next = std::ranges::upper_bound(*found, segments_[at_].number, {}, &Segment::number);
  if (next == found->end()) return {};
  auto mcap = McapReader::open(next->path);
  const auto header = mcap.ok() ? read_header(next->path, *mcap) : Result<JournalHeader>(mcap.error());
  if (!header.ok() || SegmentPlace::of(*header).recording != recording_) return {};
  const bool is_left = !mcap_ || mcap_->is_whole() || mcap->next().ok();
  return is_left ? std::optional(*next) : std::nullopt;
}

bool JournalReader::look_again() {
  if (segments_.empty()) return false;
  if (peeked_ && !peeked_->ok()) peeked_.reset();
  // The present segment is looked at last: what was written into it before the next one began is there by then.
  const auto next = segment_begun_since();
  if (mcap_ && mcap_->look_again()) return true;
  if (!next) return false;
  end_.reset();
  segments_.push_back(*next);
  // The newest of all, which may be far ahead, knows what the ring has removed before this one.
  if (const auto found = find_segments(path_); found.ok()) newest_ = place_of_newest(*found, recording_);
  return true;
}

/// Opens the next segment. Returns Malformed if something is missing between the two; reading goes on in any case.
Status JournalReader::go_on(const Error& end) {
  const Segment before = segments_[at_];
  if (mcap_) bytes_before_ += mcap_->file_size();
  // Of packets that were passed over nobody knows the sequence.
  if (mcap_ && mcap_->chunks_skipped() > 0 && (skip_before_ > 0 || !only_.empty())) last_sequence_.reset();
  mcap_.reset();
  const Segment& present = segments_[++at_];
  const auto left_out = [&](const std::string& why) {
    return Error{ErrorCode::Malformed, why + "; this segment of the recording is left out"};
  };
  Result<McapReader> mcap = McapReader::open(present.path);
  Result<JournalHeader> header = mcap.ok() ? read_header(present.path, *mcap) : Result<JournalHeader>(mcap.error());
  if (!header.ok()) {
    // A program that was killed as it began a segment leaves one without a header, behind which nothing came.
    if (!is_other_segment_left()) {
      end_ = Error{ErrorCode::Truncated, header.error().message};
      return *end_;
    }
    return left_out(header.error().message);
  }
  if (SegmentPlace::of(*header).recording != recording_ || header->sensors != header_.sensors)
    return left_out(present.path.string() + " is of another recording than " + segments_.front().path.string());
  mcap_ = std::move(*mcap);
  mcap_->skip_chunks_before(skip_before_);
  mcap_->skip_chunks_without(only_);
  return check_place(*header, before, end);
}

/// Checks that a segment goes on where the one before ended.
Status JournalReader::check_place(const JournalHeader& header, const Segment& before, const Error& end) {
  const Segment& present = segments_[at_];
  const SegmentPlace place = SegmentPlace::of(header);
  std::uint32_t missing = 0;
  for (std::uint32_t number = before.number + 1; number < present.number; ++number)
    missing += !newest_.is_removed(number) && !place.is_removed(number);
  segments_missed_ += present.number - before.number - 1 - missing;
  if (missing > 0)
    return Error{ErrorCode::Malformed,
                 fmt::format("{} of the segments between {} and {} are missing: copy them beside the others", missing,
                             before.path.string(), present.path.string())};
  if (present.number != before.number + 1 || !place.follows || !last_sequence_ || *place.follows == *last_sequence_)
    return {};
  return Error{ErrorCode::Malformed,
               fmt::format("{}; {} goes on behind what is missing", end.message, present.path.string())};
}

void JournalReader::read_only(const std::vector<SensorId>& sensors) {
  only_ = sensors;
  if (mcap_) mcap_->skip_chunks_without(only_);
}

void JournalReader::skip_before(HostTime time) {
  skip_before_ = static_cast<std::uint64_t>(std::max<std::int64_t>(0, count_ns(time)));
  if (mcap_) mcap_->skip_chunks_before(skip_before_);
}

std::optional<HostTime> JournalReader::newest() const {
  for (std::size_t i = segments_.size(); i-- > 0;)
    if (const auto time = newest_log_time(segments_[i].path)) return host_time_ns(static_cast<std::int64_t>(*time));
  return {};
}

void JournalReader::close() {
  peeked_.reset();
  mcap_.reset();
  segments_.clear();
}

}  // namespace hueline::storage
