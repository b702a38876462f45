#include "storage/journal_writer.hpp"

#include <algorithm>
#include <set>
#include <string>
#include <utility>

#include "storage/descriptor_set.hpp"
#include "storage/packed_rows.hpp"
#include "storage/raw_packet.hpp"
#include "storage_proto/hueline/RawPacket.pb.h"

namespace hueline::storage {
namespace {

std::string check(const JournalHeader& header) {
  if (header.sensors.empty()) return "a recording needs at least sensor 0, hueline itself";
  if (header.sensors.size() > 0xFFFF) return "a recording holds at most 65535 sensors";
  std::set<std::string> names;
  for (const JournalSensor& sensor : header.sensors) {
    if (sensor.name.empty()) return "a sensor has no name";
    if (!names.insert(sensor.name).second) return "two sensors are named \"" + sensor.name + "\"";
  }
  return {};
}

}  // namespace

std::string JournalWriter::Config::validate() const {
  if (sync_interval < nanoseconds(0)) return "sync_interval must be 0 (only on close) or above";
  McapWriter::Config mcap;
  mcap.chunk_bytes = chunk_bytes;
  mcap.chunk_time = chunk_time;
  return mcap.validate();
}

Result<JournalWriter> JournalWriter::create(const std::filesystem::path& path, const JournalHeader& header,
                                            const Config& config, Disk& disk) {
  std::string wrong = config.validate();
  if (wrong.empty()) wrong = check(header);
  if (!wrong.empty()) return Error{ErrorCode::Invalid, wrong};
  McapWriter::Config mcap;
  mcap.profile = kJournalProfile;
  mcap.compression = config.compression;
  mcap.chunk_bytes = config.chunk_bytes;
  mcap.chunk_time = nanoseconds::max();  // append() ends chunks by another clock than that of the messages
  mcap.if_exists = config.if_exists;
  mcap.replaces_when_whole = config.replaces_when_whole;
  Result<McapWriter> writer = McapWriter::create(path, mcap, disk);
  if (!writer) return writer.error();

  // Everything that describes the packets is written before the first packet, so that the recording of a killed program
  // has it too.
  McapMetadata about{kJournalMetadata, header.about};
  about.values["format"] = header.has_packed_images ? kPackedJournalFormat : kJournalFormat;
  if (Status done = writer->add_metadata(about); !done) return done.error();
  for (const JournalFile& file : header.files)
    if (Status done = writer->add_attachment({0, 0, file.name, file.media_type, file.text}); !done) return done.error();
  const auto schema =
      writer->add_schema({0, kRawPacketSchema, "protobuf", descriptor_set(*::hueline::RawPacket::descriptor())});
  if (!schema) return schema.error();
  for (std::size_t i = 0; i < header.sensors.size(); ++i) {
    const JournalSensor& sensor = header.sensors[i];
    const McapChannel channel{static_cast<std::uint16_t>(i),
                              *schema,
                              raw_topic(sensor.name),
                              "protobuf",
                              {{"sensor", std::to_string(i)}, {"name", sensor.name}, {"device", sensor.device}}};
    if (Status done = writer->add_channel(channel); !done) return done.error();
  }
  if (Status done = writer->sync(); !done) return done.error();
  return JournalWriter(std::move(*writer), header, config);
}

Status JournalWriter::append(const Packet& packet, nanoseconds now) {
  if (packet.sensor >= counts_.size())
    return Error{ErrorCode::Invalid, "sensor " + std::to_string(packet.sensor) + " is not in the recording's header"};
  Counts& counts = counts_[packet.sensor];
  if (writer_.bytes_waiting() == 0) chunk_begun_ = now;
  if (is_chunk_old(now)) {
    if (Status ended = writer_.end_chunk(); !ended) {
      ++counts.refused;
      return ended;
    }
    chunk_begun_ = now;
  }
  const Buffer packed = pack(packet);
  const Buffer& payload = packed.empty() ? packet.bytes : packed;
  head_.clear();
  append_raw_packet_head(head_, packet, payload.size(), !packed.empty());
  const auto log_time = static_cast<std::uint64_t>(std::max<std::int64_t>(0, count_ns(packet.received)));
  const McapChunk::Message message{packet.sensor, static_cast<std::uint32_t>(packet.sequence), log_time, log_time};
  if (Status written = writer_.write(message, head_, payload); !written) {
    ++counts.refused;
    return written;
  }
  ++counts.packets;
  counts.payload_bytes += packet.bytes.size();
  if (!last_sync_) last_sync_ = now;
  return is_sync_due(now) ? sync_at(now) : Status();
}

/// Returns a packet's image packed; nothing if it is none, does not get smaller, or too many wait for the disk.
Buffer JournalWriter::pack(const Packet& packet) {
  if (!has_packed_images_ || packet.rows.rows == 0) return {};
  const std::size_t bound = packed_rows_bound(packet.bytes.size(), packet.rows);
  MutableBuffer out = bound > 0 ? packed_.acquire(bound) : MutableBuffer();
  if (!out) return {};
  const std::size_t size = pack_rows(packet.bytes.bytes(), packet.rows, out.bytes());
  out.resize(size);
  return std::move(out).share();
}

JournalWriter::Config JournalWriter::Config::of_copy() {
  Config out;
  out.chunk_time = std::chrono::seconds(1);
  out.sync_interval = nanoseconds(0);
  out.replaces_when_whole = true;
  return out;
}

bool JournalWriter::is_chunk_old(nanoseconds now) const { return now - *chunk_begun_ >= config_.chunk_time; }

bool JournalWriter::is_sync_due(nanoseconds now) const {
  return config_.sync_interval > nanoseconds(0) && now - *last_sync_ >= config_.sync_interval;
}

Status JournalWriter::sync_at(nanoseconds now) {
  last_sync_ = now;
  return writer_.sync();
}

Status JournalWriter::write_due(nanoseconds now) {
  if (Status settled = writer_.settle(); !settled) return settled;
  const bool waits = writer_.bytes_waiting() > 0;
  if (last_sync_ && is_sync_due(now) && (waits || packets_on_medium() < packets_written())) return sync_at(now);
  return waits && is_chunk_old(now) ? writer_.flush() : Status();
}

}  // namespace hueline::storage
