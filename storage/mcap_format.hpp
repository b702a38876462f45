#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>

#include "storage/byte_order.hpp"

/// The MCAP container (https://mcap.dev/spec): magic, header, data section, summary, footer, magic. Every record is a
/// u8 opcode, a u64 length and its content.
namespace hueline::storage {

constexpr std::array<std::byte, 8> kMcapMagic{std::byte{0x89}, std::byte{'M'}, std::byte{'C'},  std::byte{'A'},
                                              std::byte{'P'},  std::byte{'0'}, std::byte{'\r'}, std::byte{'\n'}};
constexpr std::size_t kMcapRecordHead = 9;  // opcode and length

enum class McapOpcode : std::uint8_t {
  Header = 0x01,
  Footer = 0x02,
  Schema = 0x03,
  Channel = 0x04,
  Message = 0x05,
  Chunk = 0x06,
  MessageIndex = 0x07,
  ChunkIndex = 0x08,
  Attachment = 0x09,
  AttachmentIndex = 0x0A,
  Statistics = 0x0B,
  Metadata = 0x0C,
  MetadataIndex = 0x0D,
  SummaryOffset = 0x0E,
  DataEnd = 0x0F,
};

/// The description of a message's bytes. Id 0 means "no schema" and is not used here.
struct McapSchema {
  std::uint16_t id = 0;
  std::string name;      ///< e.g. "foxglove.PointCloud"
  std::string encoding;  ///< e.g. "protobuf", for which data is a FileDescriptorSet
  std::string data;
};

/// One stream of messages.
struct McapChannel {
  std::uint16_t id = 0;
  std::uint16_t schema_id = 0;
  std::string topic;
  std::string message_encoding;
  std::map<std::string, std::string> metadata;
};

/// A named map of texts.
struct McapMetadata {
  std::string name;
  std::map<std::string, std::string> values;
};

/// A file inside the file.
struct McapAttachment {
  std::uint64_t log_time = 0, create_time = 0;  ///< ns; 0 if no clock was read
  std::string name, media_type;
  std::string data;
};

/// Counts and times of what a file holds.
struct McapStatistics {
  std::uint64_t message_count = 0;
  std::uint16_t schema_count = 0;
  std::uint32_t channel_count = 0, attachment_count = 0, metadata_count = 0, chunk_count = 0;
  std::uint64_t message_start_time = 0, message_end_time = 0;  ///< 0 if there are no messages
  std::map<std::uint16_t, std::uint64_t> channel_message_counts;
};

/// Begins a record and returns its position in `out`. Append the content, then call end_record(), which fills in the
/// length.
std::size_t begin_record(Bytes& out, McapOpcode opcode);
void end_record(Bytes& out, std::size_t begun_at);
/// Appends a string with its u32 length before it.
void append_string(Bytes& out, const std::string& text);
/// Appends a map, preceded by its u32 length in bytes.
void append_map(Bytes& out, const std::map<std::string, std::string>& map);
void append_map(Bytes& out, const std::map<std::uint16_t, std::uint64_t>& map);

/// Appends the whole record.
void append_record(Bytes& out, const McapSchema& schema);
void append_record(Bytes& out, const McapChannel& channel);
void append_record(Bytes& out, const McapMetadata& metadata);
void append_record(Bytes& out, const McapAttachment& attachment);
void append_record(Bytes& out, const McapStatistics& statistics);

/// Reads a record's content. Returns false if it is broken.
bool decode_record(ByteView content, McapSchema& schema);
bool decode_record(ByteView content, McapChannel& channel);
bool decode_record(ByteView content, McapMetadata& metadata);
/// Checks the attachment's own CRC as well.
bool decode_record(ByteView content, McapAttachment& attachment);
bool decode_record(ByteView content, McapStatistics& statistics);

}  // namespace hueline::storage
