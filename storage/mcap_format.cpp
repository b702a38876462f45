#include "storage/mcap_format.hpp"

#include <utility>

#include "storage/crc32.hpp"

namespace hueline::storage {
namespace {

/// Appends a map: the u32 length of its entries in bytes, then the entries.
template <class Append>
void append_sized(Bytes& out, Append entries) {
  const std::size_t at = out.size();
  append(out, std::uint32_t{0});
  entries();
  put<std::uint32_t>(out, at, static_cast<std::uint32_t>(out.size() - at - sizeof(std::uint32_t)));
}

}  // namespace

std::size_t begin_record(Bytes& out, McapOpcode opcode) {
  const std::size_t at = out.size();
  append(out, static_cast<std::uint8_t>(opcode));
  append(out, std::uint64_t{0});
  return at;
}

void end_record(Bytes& out, std::size_t begun_at) {
  put<std::uint64_t>(out, begun_at + 1, out.size() - begun_at - kMcapRecordHead);
}

void append_string(Bytes& out, const std::string& text) {
  append(out, static_cast<std::uint32_t>(text.size()));
  append(out, as_bytes(text));
}

void append_map(Bytes& out, const std::map<std::string, std::string>& map) {
  append_sized(out, [&] {
    for (const auto& [key, value] : map) append_string(out, key), append_string(out, value);
  });
}

void append_map(Bytes& out, const std::map<std::uint16_t, std::uint64_t>& map) {
  append_sized(out, [&] {
    for (const auto& [key, value] : map) append(out, key), append(out, value);
  });
}

void append_record(Bytes& out, const McapSchema& schema) {
  const std::size_t at = begin_record(out, McapOpcode::Schema);
  append(out, schema.id);
  append_string(out, schema.name);
  append_string(out, schema.encoding);
  append_string(out, schema.data);
  end_record(out, at);
}

void append_record(Bytes& out, const McapChannel& channel) {
  const std::size_t at = begin_record(out, McapOpcode::Channel);
  append(out, channel.id);
  append(out, channel.schema_id);
  append_string(out, channel.topic);
  append_string(out, channel.message_encoding);
  append_map(out, channel.metadata);
  end_record(out, at);
}

void append_record(Bytes& out, const McapMetadata& metadata) {
  const std::size_t at = begin_record(out, McapOpcode::Metadata);
  append_string(out, metadata.name);
  append_map(out, metadata.values);
  end_record(out, at);
}

void append_record(Bytes& out, const McapAttachment& attachment) {
  const std::size_t at = begin_record(out, McapOpcode::Attachment);
  append(out, attachment.log_time);
  append(out, attachment.create_time);
  append_string(out, attachment.name);
  append_string(out, attachment.media_type);
  append(out, static_cast<std::uint64_t>(attachment.data.size()));
  append(out, as_bytes(attachment.data));
  append(out, crc32(0, ByteView(out).subspan(at + kMcapRecordHead)));
  end_record(out, at);
}

void append_record(Bytes& out, const McapStatistics& statistics) {
  const std::size_t at = begin_record(out, McapOpcode::Statistics);
  append(out, statistics.message_count);
  append(out, statistics.schema_count);
  append(out, statistics.channel_count);
  append(out, statistics.attachment_count);
  append(out, statistics.metadata_count);
  append(out, statistics.chunk_count);
  append(out, statistics.message_start_time);
  append(out, statistics.message_end_time);
  append_map(out, statistics.channel_message_counts);
  end_record(out, at);
}

namespace {

bool take_map(ByteReader& in, std::map<std::string, std::string>& map) {
  ByteReader entries(in.take_bytes(in.take<std::uint32_t>()));
  map.clear();
  while (entries.ok() && entries.remaining() > 0) {
    std::string key = entries.take_string();
    map[std::move(key)] = entries.take_string();
  }
  return in.ok() && entries.ok();
}

}  // namespace

bool decode_record(ByteView content, McapSchema& schema) {
  ByteReader in(content);
  schema.id = in.take<std::uint16_t>();
  schema.name = in.take_string();
  schema.encoding = in.take_string();
  schema.data = in.take_string();
  return in.ok();
}

bool decode_record(ByteView content, McapChannel& channel) {
  ByteReader in(content);
  channel.id = in.take<std::uint16_t>();
  channel.schema_id = in.take<std::uint16_t>();
  channel.topic = in.take_string();
  channel.message_encoding = in.take_string();
  return take_map(in, channel.metadata);
}

bool decode_record(ByteView content, McapMetadata& metadata) {
  ByteReader in(content);
  metadata.name = in.take_string();
  return take_map(in, metadata.values);
}

bool decode_record(ByteView content, McapAttachment& attachment) {
  ByteReader in(content);
  attachment.log_time = in.take<std::uint64_t>();
  attachment.create_time = in.take<std::uint64_t>();
  attachment.name = in.take_string();
  attachment.media_type = in.take_string();
  const ByteView data = in.take_bytes(in.take<std::uint64_t>());
  attachment.data.assign(reinterpret_cast<const char*>(data.data()), data.size());
  const std::size_t checked = in.position();
  const auto crc = in.take<std::uint32_t>();
  return in.ok() && (crc == 0 || crc == crc32(0, content.first(checked)));
}

bool decode_record(ByteView content, McapStatistics& statistics) {
  ByteReader in(content);
  statistics.message_count = in.take<std::uint64_t>();
  statistics.schema_count = in.take<std::uint16_t>();
  statistics.channel_count = in.take<std::uint32_t>();
  statistics.attachment_count = in.take<std::uint32_t>();
  statistics.metadata_count = in.take<std::uint32_t>();
  statistics.chunk_count = in.take<std::uint32_t>();
  statistics.message_start_time = in.take<std::uint64_t>();
  statistics.message_end_time = in.take<std::uint64_t>();
  ByteReader counts(in.take_bytes(in.take<std::uint32_t>()));
  statistics.channel_message_counts.clear();
  while (counts.ok() && counts.remaining() > 0) {
    const auto channel = counts.take<std::uint16_t>();
    statistics.channel_message_counts[channel] = counts.take<std::uint64_t>();
  }
  return in.ok() && counts.ok();
}

}  // namespace hueline::storage
