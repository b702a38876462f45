#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "storage/mcap_writer.hpp"
#include "storage/view_messages.hpp"

namespace hueline::storage {

/// Writes `view.mcap`, an MCAP file with the messages of ViewMessages, for people to look at. It opens in Foxglove
/// Studio and in any other reader of these public schemas. Reads no clock: the same calls give the same bytes.
///
/// The first failed write is remembered and returned by all later calls.
/// Thread safety: none; one thread calls all functions.
class ViewWriter {
 public:
  struct Config {
    ViewMessages::Config messages;
    Compression compression = Compression::Zstd;
    IfExists if_exists = IfExists::Replace;
  };
  using Level = ViewMessages::Level;

  /// Creates the file. `origin` is the origin of the frame enu; the frames of `rig` are shown.
  static Result<ViewWriter> create(const std::filesystem::path& path, const Geodetic& origin, ViewRig rig,
                                   const Config& config);
  ViewWriter(ViewWriter&&) noexcept = default;
  ViewWriter& operator=(ViewWriter&&) = delete;

  /// Adds the points that are shown. A message is written when its points span Config::cloud_interval.
  Status append(const CloudBlock& block) { return write(messages_->make(block)); }
  Status append(const InsSolution& solution) { return write(messages_->make(solution)); }
  Status append(const GnssFix& fix) { return write(messages_->make(fix)); }
  /// `camera` is the rig's name for the camera. Incomplete images are left out.
  Status append(const Exposure& exposure, const std::string& camera);
  /// Adds a line of the log. `who` is the name of its sensor.
  Status append_log(GpsTime time, Level level, const std::string& who, const std::string& text) {
    return write(messages_->make_log(time, level, who, text));
  }
  /// Adds a change of the health of a sensor or of the drive.
  Status append_health(GpsTime time, Level level, const std::string& who, const std::string& text) {
    return write(messages_->make_health(time, level, who, text));
  }
  /// Writes what waits, with summary and indexes, and closes the file.
  Status close();

  std::uint64_t bytes_written() const { return mcap_.bytes_written(); }
  std::uint64_t messages_written() const { return mcap_.statistics().message_count; }

 private:
  ViewWriter(McapWriter mcap, std::unique_ptr<ViewMessages> messages);
  Status add_channels();
  Status write(const std::vector<ViewMessage>& messages);

  McapWriter mcap_;
  std::unique_ptr<ViewMessages> messages_;
  std::vector<std::uint32_t> sequences_;          // by channel; a channel that is here is in the file
  std::map<std::string, std::uint16_t> schemas_;  // ids by name
};

}  // namespace hueline::storage
