#pragma once

#include <deque>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "storage/journal_segments.hpp"
#include "storage/journal_writer.hpp"

namespace hueline::storage {

/// Writes the raw recording as one file or as several, its segments (storage/journal_segments.hpp). Each packet is in
/// exactly one segment, and the segments read one after the other are the recording that one file would be.
///
/// A segment ends before it becomes larger or longer than it may be. The next one is created first, so a recording that
/// cannot be split goes on in the file that it has, and the split is tried again a second later. When the space of a
/// volume ends, the next segment is created on the next volume, and its file in the drive's folder is a symbolic link.
/// Packets that a failing volume did not take are written to the next one.
///
/// A ring removes its oldest segments, but not the first one (its file has the recording's name, and it holds the
/// beginning of the clocks), and none that holds a packet from `mark_before` before an operator's mark to `mark_after`
/// after it. What marks protect is kept beside the ring and takes no room of it, so a later mark finds as much before
/// it as an earlier one. A segment is named as removed in the header of a later one before it is removed. Thread
/// safety: none; the recorder's thread calls all functions.
class SegmentedJournal {
 public:
  struct Config {
    JournalWriter::Config segment;
    std::uint64_t segment_bytes = 0;  ///< most bytes of a segment, one packet or more; 0: any
    nanoseconds segment_time{0};      ///< longest time of a segment by the clock of append(); 0: any
    std::uint64_t ring_bytes = 0;     ///< bytes that the segments without protection may have; 0: no ring
    nanoseconds ring_time{0};         ///< how old the packets of a segment may be, by their stamps; 0: any age
    nanoseconds mark_before{std::chrono::minutes(5)}, mark_after{std::chrono::minutes(5)};
    std::vector<std::filesystem::path> volumes;  ///< folders that are used when the drive's own volume is full
    std::uint64_t volume_reserve = 64'000'000;   ///< bytes that are left free on a volume if there is a next one
    /// Names the recording among others, in the header of each segment. Required if the recording is ever split.
    std::string recording;
    bool splits() const { return segment_bytes > 0 || segment_time > nanoseconds(0) || !volumes.empty(); }
    /// Returns an empty text if the settings are valid, else a sentence.
    std::string validate() const;
  };
  /// Something about the files that the people in the vehicle must know, though no packet is lost.
  struct News {
    bool is_trouble;
    std::string text;
  };

  /// Creates the first segment. `disk` must outlive the journal. Errors: those of JournalWriter::create().
  static Result<SegmentedJournal> create(const std::filesystem::path& path, const JournalHeader& header,
                                         const Config& config, Disk& disk = Disk::kernel());
  static Result<SegmentedJournal> create(const std::filesystem::path& path, const JournalHeader& header) {
    return create(path, header, Config());
  }

  /// See JournalWriter. An error means that no volume takes the packet.
  Status append(const Packet& packet, nanoseconds now);
  Status write_due(nanoseconds now);
  Status check_place() { return writer_->check_place(); }
  /// Closes the last segment. Returns the first error of any segment.
  Status close();

  // Of all segments, also of those that the ring has removed.
  std::uint64_t bytes_written() const { return bytes_before_ + writer_->bytes_written(); }
  std::uint64_t packets_written() const { return packets_before_ + writer_->packets_written(); }
  std::uint64_t packets_on_medium() const { return on_medium_before_ + writer_->packets_on_medium(); }

  std::uint32_t segment() const { return number_; }  ///< number of the present segment
  /// What the ring has removed.
  RemovedSegments removed() const { return place_.removed_so_far(); }
  /// Bytes of all segments that are there.
  std::uint64_t bytes_kept() const { return bytes_written() - place_.removed_bytes; }
  /// How often the recording could not go on in a new file, and went on in the one that it had.
  std::uint64_t failed_splits() const { return failed_splits_; }
  /// Returns what happened since the last call: the ring removes for the first time, another volume is used, the first
  /// time that a segment cannot be begun, closed or removed.
  std::vector<News> take_news() { return std::exchange(news_, {}); }
  std::size_t volume() const { return volume_; }  ///< 0: that of the drive's folder; else counted from 1
  /// The file of the present segment, on its volume.
  const std::filesystem::path& path() const { return writer_->path(); }

 private:
  struct Closed {
    std::uint32_t number;
    std::filesystem::path file, link;  // link: in the drive's folder, if the file is on another volume
    std::uint64_t packets, bytes;
    HostTime begin, end;
    bool is_protected;
  };
  SegmentedJournal(std::filesystem::path first, JournalHeader header, Config config, Disk& disk);
  JournalHeader header_of(std::uint32_t number) const;
  bool is_due(const Packet& packet, nanoseconds now);
  Status split(nanoseconds now, std::size_t least_volume, bool is_rest_kept = false);
  Result<std::unique_ptr<JournalWriter>> create_on(std::size_t volume, const JournalHeader& header);
  Status leave_failed_volume(nanoseconds now, const Status& why);
  void close_segment(bool is_rest_kept);
  std::vector<std::uint32_t> too_old() const;
  void let_go(const std::vector<std::uint32_t>& numbers);
  void remove_leaving();
  void note(const Packet& packet);
  void trim_waiting();
  void tell_once(bool& is_told, std::string text);

  std::filesystem::path first_;
  JournalHeader header_;
  Config config_;
  Disk* disk_;
  std::unique_ptr<JournalWriter> writer_;
  std::uint32_t number_ = 1;
  std::size_t volume_ = 0;
  SegmentPlace place_;
  std::uint64_t bytes_before_ = 0, packets_before_ = 0, on_medium_before_ = 0;  // of the segments before this one
  std::deque<Closed> closed_;
  std::vector<Closed> leaving_;  // that the disk did not let go yet
  std::uint64_t failed_splits_ = 0;
  bool told_split_ = false, told_close_ = false, told_removal_ = false;
  std::vector<News> news_;
  // The present segment.
  std::filesystem::path link_;
  std::optional<nanoseconds> begun_, looked_, tried_;  // by the clock of append()
  bool is_empty_ = true, is_protected_ = false;
  HostTime begin_{}, end_{};
  std::optional<HostTime> protects_until_;
  /// Packets that may not be in the file yet, to be written to the next volume if this one fails.
  std::deque<Packet> waiting_;
  std::uint64_t waiting_first_ = 0;            // number of the first of them among the packets of the segment
  std::optional<std::uint64_t> last_in_file_;  // sequence; known if there is another volume
  Status first_error_;
};

}  // namespace hueline::storage
