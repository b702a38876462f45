#include "storage/mcap_reader.hpp"

#include <algorithm>
#include <limits>
#include <span>
#include <string>
#include <utility>

#include "storage/compression.hpp"
#include "storage/crc32.hpp"

namespace hueline::storage {
namespace {

constexpr std::uint64_t kLargestChunk = 512u << 20;  // uncompressed; a file that states more is damaged or hostile
// Some bytes of a compressed chunk may expand to a thousand times as many. So the bytes that a reader unpacks in all
// are limited to this number, or to this many times the size of the file.
constexpr std::uint64_t kUnpackedAnyway = std::uint64_t{8} << 30;
constexpr std::uint64_t kUnpackedShare = 64;
constexpr std::size_t kFooterContent = 8 + 8 + 4;
constexpr std::size_t kFileTail = kMcapRecordHead + kFooterContent + kMcapMagic.size();
constexpr std::size_t kChunkTimes = 8 + 8;  // a chunk begins with the times of its oldest and newest message

/// What a footer says of the summary.
struct Footer {
  std::uint64_t summary_at = 0;
  std::uint32_t crc = 0;
};

/// Reads the last bytes of a file; nothing if they are no footer.
std::optional<Footer> footer_of(std::span<const std::byte, kFileTail> tail) {
  ByteReader in(tail);
  const auto opcode = static_cast<McapOpcode>(in.take<std::uint8_t>());
  const auto length = in.take<std::uint64_t>();
  Footer out;
  out.summary_at = in.take<std::uint64_t>();
  in.take<std::uint64_t>();
  out.crc = in.take<std::uint32_t>();
  if (opcode != McapOpcode::Footer || length != kFooterContent ||
      !std::equal(kMcapMagic.begin(), kMcapMagic.end(), tail.data() + kMcapRecordHead + kFooterContent))
    return {};
  return out;
}

std::uint64_t newest_of_chunk(ByteView times) {
  ByteReader in(times);
  in.take<std::uint64_t>();
  return in.take<std::uint64_t>();
}

}  // namespace

McapReader::McapReader(InputFile file) : file_(std::move(file)), pool_(std::numeric_limits<std::size_t>::max() / 2) {}

Error McapReader::truncated(std::uint64_t at, const std::string& inside) const {
  return {ErrorCode::Truncated, file_.path().string() + " ends at byte " + std::to_string(file_.size()) + " " + inside +
                                    "; whole up to byte " + std::to_string(at) + ", " + std::to_string(messages_read_) +
                                    " messages"};
}

Error McapReader::damaged(std::uint64_t at, const std::string& what) const {
  return {ErrorCode::Malformed, file_.path().string() + " at byte " + std::to_string(at) + ": " + what};
}

Result<Buffer> McapReader::read(std::uint64_t offset, std::uint64_t size) {
  if (size > file_.size() || offset > file_.size() - size) return truncated(at_, "inside a record");
  MutableBuffer memory = pool_.acquire(static_cast<std::size_t>(size));
  if (Status done = file_.read(offset, memory.bytes()); !done) return done.error();
  return std::move(memory).share();
}

Result<McapReader> McapReader::open(const std::filesystem::path& path) {
  Result<InputFile> file = InputFile::open(path);
  if (!file) return file.error();
  McapReader reader(std::move(*file));
  std::byte magic[kMcapMagic.size()];
  const auto begin = std::span(magic).first(std::min<std::uint64_t>(reader.file_.size(), sizeof magic));
  if (Status done = reader.file_.read(0, begin); !done) return done.error();
  if (!std::equal(begin.begin(), begin.end(), kMcapMagic.begin()))
    return reader.damaged(0, "not an MCAP file (its first bytes are not the MCAP magic)");
  if (begin.size() < sizeof magic) return reader.truncated(0, "before an MCAP header");
  reader.data_crc_ = crc32(0, magic);
  reader.at_ = sizeof magic;
  while (!reader.end_ && !reader.pending_ && reader.chunk_.empty()) reader.pending_ = reader.read_record();
  return reader;
}

Result<McapMessage> McapReader::next() {
  while (true) {
    if (pending_) return *std::exchange(pending_, std::nullopt);
    if (!chunk_.empty()) {
      std::optional<McapMessage> message;
      if (auto error = take_from_chunk(message)) return *error;
      if (message) return std::move(*message);
      continue;
    }
    if (end_) return *end_;
    if (auto error = read_record()) return *error;
  }
}

bool McapReader::look_again() {
  const bool was_cut = end_ && end_->code == ErrorCode::Truncated;
  if (!file_.look_again() || !was_cut) return false;
  end_.reset();
  return true;
}

std::optional<Error> McapReader::take_from_chunk(std::optional<McapMessage>& message) {
  const auto give_up = [&](const char* what) {
    chunk_ = Buffer();
    damage_reported_ = true;
    return damaged(chunk_file_at_, what);
  };
  if (chunk_at_ == chunk_.size()) {
    chunk_ = Buffer();
    return {};
  }
  ByteReader in(chunk_.bytes().subspan(chunk_at_));
  const auto opcode = static_cast<McapOpcode>(in.take<std::uint8_t>());
  const auto length = in.take<std::uint64_t>();
  const ByteView content = in.take_bytes(length);
  if (!in.ok()) return give_up("a record inside the chunk reaches beyond it; the rest of the chunk is skipped");
  const std::size_t content_at = chunk_at_ + kMcapRecordHead;
  chunk_at_ = content_at + content.size();
  if (opcode != McapOpcode::Message) return take_description(opcode, content, chunk_file_at_);
  ByteReader head(content);
  message.emplace();
  message->channel = head.take<std::uint16_t>();
  message->sequence = head.take<std::uint32_t>();
  message->log_time = head.take<std::uint64_t>();
  message->publish_time = head.take<std::uint64_t>();
  if (!head.ok() || !channels_.contains(message->channel)) {
    message.reset();
    return give_up(head.ok()
                       ? "a message of a channel that the file does not describe; the rest of the chunk is skipped"
                       : "a message is too short; the rest of the chunk is skipped");
  }
  message->data = chunk_.part(content_at + head.position(), head.remaining());
  ++messages_read_;
  return {};
}

std::optional<Error> McapReader::take_description(McapOpcode opcode, ByteView content, std::uint64_t record_at) {
  const auto keep = [&](auto record, auto store) -> std::optional<Error> {
    if (decode_record(content, record)) return store(std::move(record)), std::nullopt;
    damage_reported_ = true;
    return damaged(record_at,
                   "a record (opcode " + std::to_string(static_cast<int>(opcode)) + ") is damaged; it is skipped");
  };
  switch (opcode) {
    case McapOpcode::Header: {
      ByteReader in(content);
      profile_ = in.take_string();
      library_ = in.take_string();
      return {};
    }
    case McapOpcode::Schema:
      return keep(McapSchema{}, [&](McapSchema s) { schemas_[s.id] = std::move(s); });
    case McapOpcode::Channel:
      return keep(McapChannel{}, [&](McapChannel c) { channels_[c.id] = std::move(c); });
    case McapOpcode::Metadata:
      return keep(McapMetadata{}, [&](McapMetadata m) { metadata_.push_back(std::move(m)); });
    case McapOpcode::Attachment:
      return keep(McapAttachment{}, [&](McapAttachment a) { attachments_.push_back(std::move(a)); });
    default:
      return {};  // indexes are not needed, and unknown opcodes are to be skipped
  }
}

/// Reads one record of the data section. Returns an error that must be reported. If the error is final, end_ is set
/// too.
std::optional<Error> McapReader::read_record() {
  const auto finish = [&](Error error) {
    end_ = error;
    return error;
  };
  if ((skip_before_ > 0 || !only_.empty()) && pass_over_by_index()) return {};
  const std::uint64_t left = file_.size() - at_;
  if (left == 0) return finish(truncated(at_, "without the end mark: the recording was cut off"));
  if (left < kMcapRecordHead) return finish(truncated(at_, "inside a record"));
  std::byte head[kMcapRecordHead];
  if (Status done = file_.read(at_, head); !done) return finish(done.error());
  ByteReader in(head);
  const auto opcode = static_cast<McapOpcode>(in.take<std::uint8_t>());
  const auto length = in.take<std::uint64_t>();
  if (opcode == McapOpcode{0}) return finish(truncated(at_, "after bytes that were never written (zeros)"));
  if (length > left - kMcapRecordHead)
    return finish(truncated(at_, "inside a record of " + std::to_string(length) + " bytes"));
  if (opcode == McapOpcode::Chunk && skip_before_ > 0 && length >= kChunkTimes) {
    std::byte times[kChunkTimes];
    if (Status done = file_.read(at_ + kMcapRecordHead, times); !done) return finish(done.error());
    if (newest_of_chunk(times) < skip_before_) {
      at_ += kMcapRecordHead + length;
      ++chunks_skipped_;
      return {};
    }
  }
  Result<Buffer> record = read(at_ + kMcapRecordHead, length);
  if (!record) return finish(record.error());
  const std::uint64_t record_at = at_;
  at_ += kMcapRecordHead + length;
  if (opcode == McapOpcode::DataEnd) {
    ByteReader content(record->bytes());
    Error error = check_end(content.take<std::uint32_t>());
    // Damage found at the end is reported once. A caller that continues after Malformed must come to an end.
    end_ = error.code == ErrorCode::Malformed ? Error{ErrorCode::EndOfData, "end of " + file_.path().string()} : error;
    if (error.code == ErrorCode::Truncated) at_ = record_at;  // look_again() reads it again
    return error;
  }
  data_crc_ = crc32(data_crc_, head);
  if (opcode == McapOpcode::Chunk) return load_chunk(*record, record_at, data_crc_);
  data_crc_ = crc32(data_crc_, record->bytes());
  if (opcode != McapOpcode::Message) return take_description(opcode, record->bytes(), record_at);
  // A message outside of any chunk is read as a chunk of one message.
  Result<Buffer> whole = read(record_at, kMcapRecordHead + length);
  if (!whole) return finish(whole.error());
  chunk_ = std::move(*whole);
  chunk_at_ = 0;
  chunk_file_at_ = record_at;
  return {};
}

std::optional<Error> McapReader::load_chunk(const Buffer& record, std::uint64_t record_at, std::uint32_t& data_crc) {
  ByteReader in(record.bytes());
  in.take<std::uint64_t>();  // start
  in.take<std::uint64_t>();  // end
  const auto size = in.take<std::uint64_t>();
  const auto crc = in.take<std::uint32_t>();
  const std::string compression = in.take_string();
  const ByteView content = in.take_bytes(in.take<std::uint64_t>());
  const std::size_t content_at = in.position() - content.size();
  const auto skip = [&](const std::string& what) {
    damage_reported_ = true;
    return damaged(record_at, what + "; the chunk of " + std::to_string(record.size()) + " bytes is skipped");
  };
  if (!in.ok() || in.remaining() != 0) return skip("a chunk's head contradicts its length");
  data_crc = crc32(data_crc, record.bytes().first(content_at));
  std::uint32_t found = crc32(0, content);
  data_crc = crc32_combine(data_crc, found, content.size());
  Buffer messages;
  if (compression.empty()) {
    if (size != content.size()) return skip("a chunk's head contradicts its length");
    messages = record.part(content_at, content.size());
  } else {
    if (size > kLargestChunk)
      return skip("a chunk claims " + std::to_string(size) + " bytes when uncompressed, at most " +
                  std::to_string(kLargestChunk) + " are read");
    if ((unpacked_ += size) > std::max(kUnpackedAnyway, kUnpackedShare * file_.size())) {
      end_ = {ErrorCode::Unsupported, file_.path().string() + " at byte " + std::to_string(record_at) +
                                          ": its chunks unpack to more than " + std::to_string(kUnpackedAnyway >> 30) +
                                          " GiB and " + std::to_string(kUnpackedShare) +
                                          " times the file's size: it is not read further"};
      return *end_;
    }
    MutableBuffer memory = pool_.acquire(static_cast<std::size_t>(size));
    if (Status done = decompress(compression, content, memory.bytes()); !done) return skip(done.error().message);
    messages = std::move(memory).share();
    found = crc32(0, messages.bytes());
  }
  if (crc != 0 && crc != found) return skip("wrong CRC");
  chunk_ = std::move(messages);
  chunk_at_ = 0;
  chunk_file_at_ = record_at;
  return {};
}

Error McapReader::check_end(std::uint32_t stated_data_crc) {
  const bool is_read_whole = !damage_reported_ && chunks_skipped_ == 0;
  if (is_read_whole && stated_data_crc != 0 && stated_data_crc != data_crc_)
    return damaged(at_, "the CRC over the data section is wrong; each chunk's own CRC was right");
  if (file_.size() - at_ < kFileTail) return truncated(at_, "inside the summary; all messages are whole");
  std::byte tail[kFileTail];
  if (Status done = file_.read(file_.size() - kFileTail, tail); !done) return done.error();
  const auto footer = footer_of(tail);
  if (!footer) return truncated(at_, "inside the summary; all messages are whole");
  const auto [summary_at, crc] = *footer;
  const std::uint64_t footer_at = file_.size() - kFileTail;
  const std::uint64_t summary_end = footer_at + kMcapRecordHead + kFooterContent - sizeof crc;
  if (summary_at == 0) return {ErrorCode::EndOfData, "end of " + file_.path().string()};
  if (summary_at < at_ || summary_at > footer_at)
    return damaged(footer_at, "the footer is wrong; all messages are whole");
  Result<Buffer> summary = read(summary_at, summary_end - summary_at);
  if (!summary) return summary.error();
  if (crc != 0 && crc != crc32(0, summary->bytes()))
    return damaged(summary_at, "the summary has a wrong CRC; all messages are whole");
  for (ByteReader records(summary->bytes()); records.ok() && records.remaining() > kFooterContent;) {
    const auto kind = static_cast<McapOpcode>(records.take<std::uint8_t>());
    const ByteView content = records.take_bytes(records.take<std::uint64_t>());
    McapStatistics statistics;
    if (kind == McapOpcode::Statistics && decode_record(content, statistics)) statistics_ = std::move(statistics);
    // Writers describe a channel that has no message nowhere else.
    McapSchema schema;
    if (kind == McapOpcode::Schema && decode_record(content, schema)) schemas_.try_emplace(schema.id, schema);
    McapChannel channel;
    if (kind == McapOpcode::Channel && decode_record(content, channel)) channels_.try_emplace(channel.id, channel);
  }
  if (statistics_ && is_read_whole && statistics_->message_count != messages_read_)
    return damaged(summary_at, "the summary counts " + std::to_string(statistics_->message_count) +
                                   " messages, the file holds " + std::to_string(messages_read_));
  return {ErrorCode::EndOfData, "end of " + file_.path().string()};
}

/// Returns the index of a whole summary; nothing if there is none, or if it contradicts itself.
const std::vector<McapReader::IndexedChunk>& McapReader::index() {
  if (index_) return *index_;
  index_.emplace();
  std::byte tail[kFileTail];
  if (file_.size() < kMcapMagic.size() + kFileTail || !file_.read(file_.size() - kFileTail, tail).ok()) return *index_;
  const auto footer = footer_of(tail);
  if (!footer || footer->summary_at == 0 || footer->summary_at > file_.size() - kFileTail) return *index_;
  const std::uint64_t end = file_.size() - kFileTail + kMcapRecordHead + kFooterContent - sizeof footer->crc;
  const Result<Buffer> summary = read(footer->summary_at, end - footer->summary_at);
  if (!summary.ok() || (footer->crc != 0 && footer->crc != crc32(0, summary->bytes()))) return *index_;
  std::vector<IndexedChunk> chunks;
  for (ByteReader records(summary->bytes()); records.ok() && records.remaining() > kFooterContent;) {
    const auto kind = static_cast<McapOpcode>(records.take<std::uint8_t>());
    const ByteView content = records.take_bytes(records.take<std::uint64_t>());
    if (kind != McapOpcode::ChunkIndex) continue;
    ByteReader in(content);
    IndexedChunk chunk;
    in.take<std::uint64_t>();  // the oldest message
    chunk.newest = in.take<std::uint64_t>();
    chunk.begin = in.take<std::uint64_t>();
    const auto length = in.take<std::uint64_t>();
    ByteReader of_messages(in.take_bytes(in.take<std::uint32_t>()));  // where the index of each channel is
    while (of_messages.ok() && of_messages.remaining() > 0) {
      chunk.channels.push_back(of_messages.take<std::uint16_t>());
      of_messages.take<std::uint64_t>();
    }
    const auto indexes = in.take<std::uint64_t>();
    const std::uint64_t left = footer->summary_at - std::min(chunk.begin, footer->summary_at);
    if (!in.ok() || !of_messages.ok() || length > left || indexes > left - length) return *index_;
    chunk.end = chunk.begin + length + indexes;
    if (!chunks.empty() && chunk.begin < chunks.back().end) return *index_;
    chunks.push_back(std::move(chunk));
  }
  index_ = std::move(chunks);
  return *index_;
}

bool McapReader::is_passed_over(const IndexedChunk& chunk) const {
  if (chunk.newest < skip_before_) return true;
  return !only_.empty() && !chunk.channels.empty() &&
         std::ranges::find_first_of(chunk.channels, only_) == chunk.channels.end();
}

/// Passes over the chunks at this place that are not wanted, and over what follows each. Returns whether there were
/// some.
bool McapReader::pass_over_by_index() {
  auto chunk = std::ranges::lower_bound(index(), at_, {}, &IndexedChunk::begin);
  const std::uint64_t before = at_;
  for (; chunk != index().end() && chunk->begin == at_ && is_passed_over(*chunk); ++chunk, ++chunks_skipped_)
    at_ = chunk->end;
  return at_ > before;
}

std::optional<std::uint64_t> newest_log_time(const std::filesystem::path& path) {
  const auto file = InputFile::open(path);
  if (!file) return {};
  std::uint64_t end = file->size();
  std::optional<std::uint64_t> newest;
  const auto note = [&newest](std::uint64_t time) { newest = std::max(newest.value_or(0), time); };
  // The records of the summary stand at the end, those of the data before it.
  std::uint64_t at = kMcapMagic.size();
  if (std::byte tail[kFileTail]; end >= kFileTail + at && file->read(end - kFileTail, tail)) {
    const auto footer = footer_of(tail);
    if (footer && footer->summary_at > 0 && footer->summary_at < end) at = footer->summary_at;
  }
  while (end - at >= kMcapRecordHead) {
    std::byte head[kMcapRecordHead];
    if (!file->read(at, head)) break;
    ByteReader in(head);
    const auto opcode = static_cast<McapOpcode>(in.take<std::uint8_t>());
    const auto length = in.take<std::uint64_t>();
    const std::uint64_t content_at = at + kMcapRecordHead;
    if (opcode == McapOpcode{0} || length > end - content_at) break;
    at = content_at + length;
    constexpr std::uint64_t kMostStatistics = 1 << 20;
    if (opcode == McapOpcode::Chunk && length >= kChunkTimes) {
      std::byte times[kChunkTimes];
      if (file->read(content_at, times)) note(newest_of_chunk(times));
    } else if (opcode == McapOpcode::Statistics && length <= kMostStatistics) {
      std::vector<std::byte> content(static_cast<std::size_t>(length));
      McapStatistics statistics;
      if (file->read(content_at, content) && decode_record(ByteView(content), statistics) &&
          statistics.message_count > 0)
        note(statistics.message_end_time);
    }
  }
  return newest;
}

}  // namespace hueline::storage
