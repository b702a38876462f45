#include "storage/mcap_writer.hpp"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "storage/crc32.hpp"

namespace hueline::storage {
namespace {

/// Chunks that may wait for the disk. The disk's own memory bounds their bytes.
constexpr std::size_t kMostInFlight = 16;

}  // namespace

std::string McapWriter::Config::validate() const {
  if (chunk_bytes < 1024 || chunk_bytes > (256u << 20)) return "chunk_bytes must be from 1024 to 268435456";
  if (chunk_time <= nanoseconds(0)) return "chunk_time must be above 0";
  return {};
}

Result<McapWriter> McapWriter::create(const std::filesystem::path& path, const Config& config, Disk& disk) {
  if (std::string wrong = config.validate(); !wrong.empty()) return Error{ErrorCode::Invalid, wrong};
  Result<FileWriter> file =
      config.replaces_when_whole ? FileWriter::replace(path, disk) : FileWriter::create(path, config.if_exists, disk);
  if (!file) return file.error();
  McapWriter writer(std::move(*file), config);
  Bytes start(kMcapMagic.begin(), kMcapMagic.end());
  const std::size_t at = begin_record(start, McapOpcode::Header);
  append_string(start, config.profile);
  append_string(start, config.library);
  end_record(start, at);
  if (Status written = writer.put_record(start); !written) return written.error();
  return writer;
}

McapWriter::~McapWriter() {
  if (file_.is_open() && !config_.replaces_when_whole) (void)close();
}

Status McapWriter::usable() const {
  if (error_) return *error_;
  if (!file_.is_open()) return Error{ErrorCode::Invalid, path().string() + " is closed: nothing more can be written"};
  return {};
}

Status McapWriter::put_record(ByteView record) {
  if (Status before = settle(); !before) return before;
  const std::uint64_t whole = file_.size();
  if (Status written = file_.write(record); !written) {
    error_ = written.error();
    (void)file_.cut_back(whole);
    return written;
  }
  data_crc_ = crc32(data_crc_, record);
  return {};
}

Result<std::uint16_t> McapWriter::add_schema(McapSchema schema) {
  schema.id = static_cast<std::uint16_t>(schemas_.size() + 1);
  Bytes record;
  append_record(record, schema);
  if (Status written = put_record(record); !written) return written.error();
  const std::uint16_t id = schema.id;
  schemas_.push_back(std::move(schema));
  ++statistics_.schema_count;
  return id;
}

Status McapWriter::add_channel(const McapChannel& channel) {
  if (std::any_of(channels_.begin(), channels_.end(), [&](const auto& c) { return c.id == channel.id; }))
    return Error{ErrorCode::Invalid,
                 "channel " + std::to_string(channel.id) + " (" + channel.topic + ") exists already"};
  Bytes record;
  append_record(record, channel);
  if (Status written = put_record(record); !written) return written;
  channels_.push_back(channel);
  ++statistics_.channel_count;
  return {};
}

Status McapWriter::add_metadata(const McapMetadata& metadata) {
  Bytes record;
  append_record(record, metadata);
  const std::uint64_t offset = file_.size();
  if (Status written = put_record(record); !written) return written;
  const std::size_t at = begin_record(metadata_indexes_, McapOpcode::MetadataIndex);
  append(metadata_indexes_, offset);
  append(metadata_indexes_, static_cast<std::uint64_t>(record.size()));
  append_string(metadata_indexes_, metadata.name);
  end_record(metadata_indexes_, at);
  ++statistics_.metadata_count;
  return {};
}

Status McapWriter::add_attachment(const McapAttachment& attachment) {
  Bytes record;
  append_record(record, attachment);
  const std::uint64_t offset = file_.size();
  if (Status written = put_record(record); !written) return written;
  const std::size_t at = begin_record(attachment_indexes_, McapOpcode::AttachmentIndex);
  append(attachment_indexes_, offset);
  append(attachment_indexes_, static_cast<std::uint64_t>(record.size()));
  append(attachment_indexes_, attachment.log_time);
  append(attachment_indexes_, attachment.create_time);
  append(attachment_indexes_, static_cast<std::uint64_t>(attachment.data.size()));
  append_string(attachment_indexes_, attachment.name);
  append_string(attachment_indexes_, attachment.media_type);
  end_record(attachment_indexes_, at);
  ++statistics_.attachment_count;
  return {};
}

Status McapWriter::write(const McapChunk::Message& message, ByteView head, const Buffer& payload) {
  if (Status before = usable(); !before) return before;
  const std::uint64_t size = head.size() + payload.size();
  const bool spans_too_much =
      message.log_time > chunk_.first_log_time() &&
      message.log_time - chunk_.first_log_time() >= static_cast<std::uint64_t>(config_.chunk_time.count());
  // A large message gets a chunk of its own. Otherwise a reader that keeps it in memory would keep its small neighbours
  // too, or they would keep it.
  if (!chunk_.empty() && (size >= config_.chunk_bytes || spans_too_much))
    if (Status ended = end_chunk(); !ended) return ended;
  chunk_.add(message, head, payload);
  if (chunk_.size() < config_.chunk_bytes) return {};
  Status ended = end_chunk();
  if (!ended) --lost_messages_;  // this message was refused; it was not accepted and lost
  return ended;
}

Status McapWriter::end_chunk() {
  if (Status before = usable(); !before) return before;
  if (chunk_.empty()) return {};
  // Another program that cuts the file must be noticed before the next append: its length does not show it afterwards.
  // While chunks are in flight, the disk looks.
  if (file_.is_settled() || in_flight_.size() >= kMostInFlight)
    if (Status place = check_place(); error_) return place;
  Bytes compressed;
  if (config_.compression != Compression::None)
    if (Status done = compress(config_.compression, chunk_.pieces(), compressed); !done)
      return lose_chunks(done.error());
  const std::uint64_t content = config_.compression == Compression::None ? chunk_.size() : compressed.size();

  Bytes head;
  const std::size_t at = begin_record(head, McapOpcode::Chunk);
  append(head, chunk_.start_time());
  append(head, chunk_.end_time());
  append(head, chunk_.size());
  append(head, chunk_.crc());
  append_string(head, mcap_name(config_.compression));
  append(head, content);
  put<std::uint64_t>(head, at + 1, head.size() - kMcapRecordHead + content);

  ChunkIndex index{
      chunk_.start_time(), chunk_.end_time(), file_.size(), head.size() + content, 0, content, chunk_.size(), {}};
  Bytes tail;  // the message indexes
  for (const auto& [channel, entries] : chunk_.index()) {
    index.index_offsets[channel] = index.offset + index.length + tail.size();
    const std::size_t begun = begin_record(tail, McapOpcode::MessageIndex);
    append(tail, channel);
    append(tail, static_cast<std::uint32_t>(entries.size() * 16));
    for (const auto& [log_time, offset] : entries) append(tail, log_time), append(tail, offset);
    end_record(tail, begun);
  }
  index.index_length = tail.size();

  std::vector<ByteView> pieces{head};
  if (config_.compression == Compression::None)
    pieces.insert(pieces.end(), chunk_.pieces().begin(), chunk_.pieces().end());
  else
    pieces.push_back(compressed);
  pieces.push_back(tail);
  if (Status written = file_.write_behind(pieces); !written) return lose_chunks(written.error());
  InFlight sent;
  sent.data_crc = crc32(in_flight_.empty() ? data_crc_ : in_flight_.back().data_crc, head);
  sent.data_crc = config_.compression == Compression::None ? crc32_combine(sent.data_crc, chunk_.crc(), content)
                                                           : crc32(sent.data_crc, compressed);
  sent.data_crc = crc32(sent.data_crc, tail);
  sent.count = chunk_.count();
  for (const auto& [channel, entries] : chunk_.index()) sent.channel_counts[channel] = entries.size();
  sent.index = std::move(index);
  in_flight_.push_back(std::move(sent));
  chunk_.clear();
  return file_.is_settled() ? settle() : Status();
}

Status McapWriter::settle() {
  if (Status before = usable(); !before) return before;
  if (in_flight_.empty()) return {};
  if (Status written = file_.settle(); !written) return lose_chunks(written.error());
  take_in();
  return {};
}

/// Counts the chunks that are in the file.
void McapWriter::take_in() {
  for (; !in_flight_.empty() && in_flight_.front().end() <= file_.size(); in_flight_.pop_front()) {
    InFlight& chunk = in_flight_.front();
    data_crc_ = chunk.data_crc;
    if (statistics_.message_count == 0) statistics_.message_start_time = chunk.index.start_time;
    statistics_.message_start_time = std::min(statistics_.message_start_time, chunk.index.start_time);
    statistics_.message_end_time = std::max(statistics_.message_end_time, chunk.index.end_time);
    statistics_.message_count += chunk.count;
    for (const auto& [channel, count] : chunk.channel_counts) statistics_.channel_message_counts[channel] += count;
    ++statistics_.chunk_count;
    chunk_indexes_.push_back(std::move(chunk.index));
  }
}

/// Ends the writing behind the last chunk that is in the file whole.
Error McapWriter::lose_chunks(const Error& why) {
  (void)file_.settle();  // its size is then what the disk has
  const std::uint64_t end = in_flight_.empty() ? file_.size() : in_flight_.back().end();
  take_in();
  const std::uint64_t whole = in_flight_.empty() ? end : in_flight_.front().index.offset;
  if (why.code == ErrorCode::Truncated) {
    forget_medium();
  } else {
    (void)file_.cut_back(whole);
  }
  for (const InFlight& lost : in_flight_) lost_messages_ += lost.count;
  in_flight_.clear();
  error_ = why;
  lost_messages_ += chunk_.count();
  chunk_.clear();
  return why;
}

/// Another program has cut the file: nothing is certain any more.
void McapWriter::forget_medium() {
  sync_failed_ = true;
  on_medium_ = 0;
}

Status McapWriter::flush() {
  if (Status ended = end_chunk(); !ended) return ended;
  return settle();
}

Status McapWriter::sync() {
  if (Status flushed = flush(); !flushed) return flushed;
  return synced(file_.sync());
}

Status McapWriter::check_place() {
  if (Status before = settle(); !before) return before;
  Status result = file_.check_place();
  if (!result && result.error().code == ErrorCode::Truncated) return lose_chunks(result.error());
  return result;
}

Status McapWriter::synced(Status result) {
  if (!result) {
    sync_failed_ = true;
    if (!error_) error_ = result.error();
  }
  if (!sync_failed_) on_medium_ = statistics_.message_count;
  return result;
}

Status McapWriter::write_end() {
  Bytes out;
  const std::size_t end = begin_record(out, McapOpcode::DataEnd);
  append(out, data_crc_);
  end_record(out, end);
  const std::size_t summary_at = out.size();
  const std::uint64_t base = file_.size();
  Bytes offsets;
  const auto group = [&](McapOpcode opcode, auto write_all) {
    const std::size_t begun = out.size();
    write_all();
    if (out.size() == begun) return;
    const std::size_t record = begin_record(offsets, McapOpcode::SummaryOffset);
    append(offsets, static_cast<std::uint8_t>(opcode));
    append(offsets, base + begun);
    append(offsets, static_cast<std::uint64_t>(out.size() - begun));
    end_record(offsets, record);
  };
  group(McapOpcode::Schema, [&] {
    for (const auto& schema : schemas_) append_record(out, schema);
  });
  group(McapOpcode::Channel, [&] {
    for (const auto& channel : channels_) append_record(out, channel);
  });
  group(McapOpcode::Statistics, [&] { append_record(out, statistics_); });
  group(McapOpcode::ChunkIndex, [&] {
    for (const auto& index : chunk_indexes_) {
      const std::size_t begun = begin_record(out, McapOpcode::ChunkIndex);
      append(out, index.start_time), append(out, index.end_time);
      append(out, index.offset), append(out, index.length);
      append_map(out, index.index_offsets);
      append(out, index.index_length);
      append_string(out, mcap_name(config_.compression));
      append(out, index.compressed_size), append(out, index.uncompressed_size);
      end_record(out, begun);
    }
  });
  group(McapOpcode::AttachmentIndex, [&] { append(out, attachment_indexes_); });
  group(McapOpcode::MetadataIndex, [&] { append(out, metadata_indexes_); });
  const std::uint64_t offsets_at = base + out.size();
  append(out, offsets);
  const std::size_t footer = begin_record(out, McapOpcode::Footer);
  append(out, static_cast<std::uint64_t>(base + summary_at));
  append(out, offsets_at);
  put<std::uint64_t>(out, footer + 1, 20);
  append(out, crc32(0, ByteView(out).subspan(summary_at)));
  append(out, ByteView(kMcapMagic));
  if (Status written = file_.write(out); !written) {
    (void)file_.cut_back(base);  // a reader scans a file that has no end
    return written;
  }
  return {};
}

Status McapWriter::close() {
  if (!file_.is_open()) return usable();
  (void)flush();  // flush() remembers its error
  // If another program has cut the file, an end written behind the cut could not be read.
  const bool was_cut = error_ && error_->code == ErrorCode::Truncated;
  if (!was_cut)
    if (Status ended = write_end(); !ended && !error_) error_ = ended.error();
  if (error_ && config_.replaces_when_whole) {
    file_.give_up();
    return *error_;
  }
  (void)synced(file_.close());  // the error is remembered
  if (error_) return *error_;
  return {};
}

}  // namespace hueline::storage
