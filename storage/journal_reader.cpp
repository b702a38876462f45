#include "storage/journal_reader.hpp"

#include <string>
#include <utility>

#include "storage/raw_packet.hpp"

namespace hueline::storage {

Result<std::unique_ptr<JournalReader>> JournalReader::open(const std::filesystem::path& path) {
  Result<McapReader> mcap = McapReader::open(path);
  if (!mcap) return mcap.error();
  std::unique_ptr<JournalReader> reader(new JournalReader(path, std::move(*mcap)));
  if (Status read = reader->read_header(); !read) return read.error();
  return reader;
}

Status JournalReader::read_header() {
  header_ = {};
  bool described = false;
  for (const McapMetadata& metadata : mcap_->metadata())
    if (metadata.name == kJournalMetadata) {
      header_.about = metadata.values;
      const std::string format = header_.about["format"];
      header_.about.erase("format");
      if (format != kJournalFormat)
        return Error{ErrorCode::Unsupported, path_.string() + " has recording format \"" + format +
                                                 "\", this program reads " + kJournalFormat + ": use a newer one"};
      described = true;
    }
  for (const auto& [id, channel] : mcap_->channels()) {
    const auto schema = mcap_->schemas().find(channel.schema_id);
    if (schema == mcap_->schemas().end() || schema->second.name != kRawPacketSchema) continue;
    const auto value = [&facts = channel.metadata](const char* key) {
      const auto found = facts.find(key);
      return found == facts.end() ? std::string() : found->second;
    };
    if (header_.sensors.size() <= id) header_.sensors.resize(id + std::size_t{1});
    header_.sensors[id] = {value("name"), value("device")};
  }
  for (const McapAttachment& file : mcap_->attachments())
    header_.files.push_back({file.name, file.media_type, file.data});
  if (described && !header_.sensors.empty()) return {};
  // A file that was cut inside its header returns that error instead.
  Result<McapMessage> first = mcap_->next();
  if (!first && first.error().code != ErrorCode::EndOfData) return first.error();
  return Error{ErrorCode::Unsupported, path_.string() + " is an MCAP file, but not a recording of raw packets"};
}

Status JournalReader::open() {
  if (mcap_ && untouched_) return {};
  Result<McapReader> mcap = McapReader::open(path_);
  if (!mcap) return mcap.error();
  mcap_ = std::move(*mcap);
  untouched_ = true;
  return read_header();
}

Result<Packet> JournalReader::next(std::stop_token stop) {
  if (stop.stop_requested()) return Error{ErrorCode::Stopped, "stopped while reading " + path_.string()};
  if (!mcap_) return Error{ErrorCode::Invalid, path_.string() + " is not open"};
  untouched_ = false;
  while (true) {
    Result<McapMessage> message = mcap_->next();
    if (!message) return message.error();
    const auto& channel = mcap_->channels().at(message->channel);
    const auto schema = mcap_->schemas().find(channel.schema_id);
    // Messages that other programs have added.
    if (schema == mcap_->schemas().end() || schema->second.name != kRawPacketSchema) continue;
    Result<Packet> packet = decode_raw_packet(message->data);
    if (packet && packet->sensor != message->channel)
      return Error{ErrorCode::Malformed,
                   path_.string() + ": a packet of sensor " + std::to_string(packet->sensor) + " on " + channel.topic};
    return packet;
  }
}

void JournalReader::close() { mcap_.reset(); }

}  // namespace hueline::storage
