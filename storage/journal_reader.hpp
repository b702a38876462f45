#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/packet.hpp"
#include "storage/journal_header.hpp"
#include "storage/journal_segments.hpp"
#include "storage/mcap_reader.hpp"

namespace hueline::storage {

/// A recording as a packet source, in one file or in segments, which are read one after the other. It returns the
/// packets in their recorded order with their recorded sequence, kind and shed mark. It reads finished recordings and
/// recordings that were cut. It never waits. Thread safety: none; one thread calls all functions.
class JournalReader final : public PacketSource {
 public:
  /// Opens the file and reads its header. If the file is a segment, those that follow it are read too; of `drive.mcap`
  /// that is the whole drive. Errors: Io; Malformed or Truncated if the file is no recording; Unsupported
  /// if the MCAP file holds no raw packets.
  static Result<std::unique_ptr<JournalReader>> open(const std::filesystem::path& path);

  const JournalHeader& header() const { return header_; }

  /// Starts again at the first packet.
  Status open() override;
  /// Returns the next packet. Its bytes are a part of the memory of its chunk. Errors:
  /// - EndOfData: everything was read and the recording is whole.
  /// - Truncated: the recording was cut (program killed, power lost, disk full). All whole packets were returned
  ///   before, and the message names the byte.
  /// - Malformed: a chunk is damaged and was skipped; or a segment is missing, is no part of this recording, or does
  /// not
  ///   begin where the one before ended. Call again to continue. Segments that a ring has removed are no error.
  /// - Io.
  ///
  /// EndOfData, Truncated and Io are repeated by later calls.
  Result<Packet> next(std::stop_token stop) override;
  /// Returns what the next call of next() will return, which stays the next.
  const Result<Packet>& peek();
  void close() override;

  /// For a recording that another program is writing: looks whether more of it is there now. If so, next() goes on
  /// after the EndOfData or Truncated that it returned, in this segment or in one that was begun since, and this
  /// returns true.
  bool look_again();
  /// Returns whether next() has come to the end of a segment that was closed, and that no other follows.
  bool is_closed() const { return mcap_ && mcap_->is_whole() && !is_other_segment_left(); }

  /// Passes over chunks of which every packet came before `time`, until the first packet that did not: whoever seeks
  /// needs not read what lies before. Packets before `time` may still be returned.
  void skip_before(HostTime time);
  /// Passes over chunks without a packet of these sensors: whoever needs the POS alone needs not read the images. Other
  /// sensors' packets may still be returned, and what is damaged in what is passed over is not told. Empty: reads all
  /// again.
  void read_only(const std::vector<SensorId>& sensors);
  /// Returns whether the present file has an index, without which skip_before() reads a part of every chunk.
  bool has_index() { return mcap_ && mcap_->has_index(); }
  /// Returns when the newest packet came, without reading the packets; empty if that is not possible. It reads the end
  /// of a whole recording, and the heads of the chunks of one that was cut.
  std::optional<HostTime> newest() const;

  /// The position of the reader in the files, to show progress.
  std::uint64_t position() const { return bytes_before_ + (mcap_ ? mcap_->position() : 0); }
  std::uint64_t file_size() const { return file_size_; }
  /// The files, in their order.
  const std::vector<Segment>& segments() const { return segments_; }
  /// What a ring has removed of the recording, as its last segment says.
  RemovedSegments removed() const { return newest_.removed_so_far(); }
  /// Segments that the ring had removed before this reader came to them.
  std::uint64_t segments_missed() const { return segments_missed_; }

 private:
  explicit JournalReader(std::filesystem::path path) : path_(std::move(path)) {}
  Status open_first();
  Result<Packet> read_next();
  Result<Packet> next_of_segment();
  bool is_other_segment_left() const { return at_ + 1 < segments_.size(); }
  Status go_on(const Error& end);
  std::optional<Segment> segment_begun_since() const;
  Status check_place(const JournalHeader& header, const Segment& before, const Error& end);

  const std::filesystem::path path_;
  std::vector<Segment> segments_;
  std::size_t at_ = 0;              // the segment that mcap_ reads
  std::optional<McapReader> mcap_;  // empty: it could not be opened
  JournalHeader header_;            // of the first segment
  std::string recording_;           // SegmentPlace::recording of the first segment
  SegmentPlace newest_;             // of the last segment: it knows what the ring has removed
  std::optional<std::uint64_t> last_sequence_;
  std::optional<Result<Packet>> peeked_;
  std::optional<Error> end_;       // how the last segment ended, if it could not be opened
  std::uint64_t skip_before_ = 0;  // received, ns; 0: nothing is skipped
  std::vector<SensorId> only_;     // empty: all
  std::uint64_t bytes_before_ = 0, file_size_ = 0, segments_missed_ = 0;
  bool untouched_ = true;  // open() right after the static open() does not read the header again
};

}  // namespace hueline::storage
