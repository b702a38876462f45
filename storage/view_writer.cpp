#include "storage/view_writer.hpp"

#include <string>
#include <utility>

#include "core/angle.hpp"
#include "core/calendar.hpp"

namespace hueline::storage {

ViewWriter::ViewWriter(McapWriter mcap, std::unique_ptr<ViewMessages> messages)
    : mcap_(std::move(mcap)), messages_(std::move(messages)) {}

Result<ViewWriter> ViewWriter::create(const std::filesystem::path& path, const Geodetic& origin, ViewRig rig,
                                      const Config& config) {
  if (std::string wrong = config.messages.validate(); !wrong.empty()) return Error{ErrorCode::Invalid, wrong};
  McapWriter::Config mcap;
  mcap.compression = config.compression;
  mcap.if_exists = config.if_exists;
  Result<McapWriter> writer = McapWriter::create(path, mcap);
  if (!writer) return writer.error();
  McapMetadata metadata{"hueline.origin", {}};
  metadata.values["latitude_deg"] = std::to_string(origin.latitude * kDegPerRad);
  metadata.values["longitude_deg"] = std::to_string(origin.longitude * kDegPerRad);
  metadata.values["ellipsoidal_height_m"] = std::to_string(origin.ellipsoidal_height);
  if (Status done = writer->add_metadata(metadata); !done) return done.error();
  ViewWriter view(std::move(*writer), std::make_unique<ViewMessages>(origin, std::move(rig), config.messages));
  if (Status added = view.add_channels(); !added) return added.error();
  return view;
}

/// Adds the channels that are not in the file yet.
Status ViewWriter::add_channels() {
  const std::vector<ViewChannel>& channels = messages_->channels();
  for (std::size_t i = sequences_.size(); i < channels.size(); ++i) {
    const ViewChannel& channel = channels[i];
    auto schema = schemas_.find(channel.schema_name);
    if (schema == schemas_.end()) {
      const auto id = mcap_.add_schema({0, channel.schema_name, "protobuf", channel.schema});
      if (!id) return id.error();
      schema = schemas_.emplace(channel.schema_name, *id).first;
    }
    if (Status added =
            mcap_.add_channel({static_cast<std::uint16_t>(i + 1), schema->second, channel.topic, "protobuf", {}});
        !added)
      return added;
    sequences_.push_back(0);
  }
  return {};
}

Status ViewWriter::write(const std::vector<ViewMessage>& messages) {
  if (Status added = add_channels(); !added) return added;
  for (const ViewMessage& message : messages) {
    const auto log_time = static_cast<std::uint64_t>(count_ns(to_unix(message.time)));
    const auto channel = static_cast<std::uint16_t>(message.channel + 1);
    if (Status done =
            mcap_.write({channel, sequences_[message.channel]++, log_time, log_time}, as_bytes(message.bytes));
        !done)
      return done;
  }
  return {};
}

Status ViewWriter::append(const Exposure& exposure, const std::string& camera) {
  const auto made = messages_->make(exposure, camera);
  return made ? write(*made) : Status(made.error());
}

Status ViewWriter::close() {
  const Status written = write(messages_->make_rest_of_cloud());
  const Status closed = mcap_.close();
  return written ? closed : written;
}

}  // namespace hueline::storage
