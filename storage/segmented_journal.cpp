#include "storage/segmented_journal.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <utility>

#include "core/drive_command.hpp"

namespace hueline::storage {
namespace {

constexpr nanoseconds kTryAgain = std::chrono::seconds(1);
constexpr nanoseconds kLookEvery = std::chrono::seconds(1);  // at the free space of the volume

bool is_mark(const Packet& packet) {
  if (packet.kind != PacketKind::Command) return false;
  const auto command = decode_command(packet.bytes.bytes());
  return command.ok() && command->kind == DriveCommand::Kind::Mark;
}

}  // namespace

std::string SegmentedJournal::Config::validate() const {
  if (splits() && recording.empty()) return "a recording that is split needs a name of its own";
  if ((ring_bytes > 0 || ring_time > nanoseconds(0)) && segment_bytes == 0 && segment_time == nanoseconds(0))
    return "a ring needs segments: say how large or how long they are";
  if (ring_bytes > 0 && ring_bytes < 2 * segment_bytes) return "a ring must hold two segments at least";
  if (segment_time < nanoseconds(0) || ring_time < nanoseconds(0) || mark_before < nanoseconds(0) ||
      mark_after < nanoseconds(0))
    return "times of segments, ring and marks must not be below 0";
  return segment.validate();
}

SegmentedJournal::SegmentedJournal(std::filesystem::path first, JournalHeader header, Config config, Disk& disk)
    : first_(std::move(first)), header_(std::move(header)), config_(std::move(config)), disk_(&disk) {
  place_.recording = config_.recording;
}

JournalHeader SegmentedJournal::header_of(std::uint32_t number) const {
  JournalHeader out = header_;
  if (!config_.splits()) return out;
  SegmentPlace place = place_;
  place.number = number;
  place.put_into(out);
  return out;
}

Result<SegmentedJournal> SegmentedJournal::create(const std::filesystem::path& path, const JournalHeader& header,
                                                  const Config& config, Disk& disk) {
  if (std::string wrong = config.validate(); !wrong.empty()) return Error{ErrorCode::Invalid, wrong};
  SegmentedJournal out(path, header, config, disk);
  auto writer = JournalWriter::create(path, out.header_of(1), config.segment, disk);
  if (!writer.ok()) return writer.error();
  if (const auto there = find_segments(path); config.splits() && there.ok() && there->back().number > 1) {
    (void)writer->close();
    (void)disk.remove(path);
    return Error{ErrorCode::Io, there->back().path.string() + " is a segment of another recording, whose " +
                                    path.filename().string() + " is not there: record into another folder"};
  }
  out.writer_ = std::make_unique<JournalWriter>(std::move(*writer));
  return out;
}

/// Returns whether the packet belongs into the next segment.
bool SegmentedJournal::is_due(const Packet& packet, nanoseconds now) {
  if (!config_.splits() || is_empty_ || number_ == kMostSegments) return false;
  if (tried_ && now - *tried_ < kTryAgain) return false;
  constexpr std::uint64_t kHead = 64;  // of the message
  const std::uint64_t size = writer_->bytes_written() + writer_->bytes_waiting() + packet.bytes.size() + kHead;
  if (config_.segment_bytes > 0 && size > config_.segment_bytes) return true;
  if (config_.segment_time > nanoseconds(0) && now - *begun_ >= config_.segment_time) return true;
  if (volume_ >= config_.volumes.size() || (looked_ && now - *looked_ < kLookEvery)) return false;
  looked_ = now;
  return disk_->free_bytes(writer_->path()) < static_cast<std::int64_t>(config_.volume_reserve);
}

Status SegmentedJournal::append(const Packet& packet, nanoseconds now) {
  if (is_due(packet, now)) {
    // What waits must be in this segment before it ends, or it is for the next volume.
    if (Status flushed = writer_->flush(); !flushed.ok()) {
      if (config_.volumes.empty()) return flushed;
      trim_waiting();
      if (Status left = leave_failed_volume(now, flushed); !left.ok()) return left;
    } else {
      trim_waiting();
    }
    const bool is_full = volume_ < config_.volumes.size() &&
                         disk_->free_bytes(writer_->path()) < static_cast<std::int64_t>(config_.volume_reserve);
    // If there can be no next segment, this one goes on.
    const Status done = split(now, volume_ + is_full);
    tried_ = done.ok() ? std::nullopt : std::optional(now);
    if (!done.ok()) {
      ++failed_splits_;
      tell_once(told_split_, fmt::format("the recording goes on in {}, because its next segment cannot be begun: {}",
                                         writer_->path().string(), done.error().message));
    }
  }
  if (!begun_) begun_ = now;
  if (config_.volumes.empty()) {
    if (Status done = writer_->append(packet, now); !done.ok()) return done;
    note(packet);
    return {};
  }
  waiting_.push_back(packet);
  Status done = writer_->append(packet, now);
  if (!done.ok() && done.error().code == ErrorCode::Invalid) {
    waiting_.pop_back();
    return done;
  }
  trim_waiting();
  note(packet);
  return done.ok() ? done : leave_failed_volume(now, done);
}

Status SegmentedJournal::write_due(nanoseconds now) {
  const Status done = writer_->write_due(now);
  if (config_.volumes.empty()) return done;
  trim_waiting();
  return done.ok() ? done : leave_failed_volume(now, done);
}

/// Goes on, on the next volume, with the packets that this one did not take.
Status SegmentedJournal::leave_failed_volume(nanoseconds now, const Status& why) {
  Status last = why;
  while (volume_ < config_.volumes.size()) {
    const std::deque<Packet> rest = std::exchange(waiting_, {});
    place_.follows = last_in_file_;
    if (Status done = split(now, volume_ + 1, true); !done.ok()) return why;
    last = {};
    for (const Packet& packet : rest) {
      waiting_.push_back(packet);
      if (last.ok()) last = writer_->append(packet, now);
      note(packet);
    }
    trim_waiting();
    if (last.ok()) return {};
  }
  return last;
}

void SegmentedJournal::trim_waiting() {
  for (; waiting_first_ < writer_->packets_written() && !waiting_.empty(); ++waiting_first_) {
    last_in_file_ = waiting_.front().sequence;
    waiting_.pop_front();
  }
}

void SegmentedJournal::tell_once(bool& is_told, std::string text) {
  if (!std::exchange(is_told, true)) news_.push_back({true, std::move(text)});
}

/// Remembers what the ring and the next header must know of the packet.
void SegmentedJournal::note(const Packet& packet) {
  if (!config_.splits()) return;
  begin_ = is_empty_ ? packet.received : std::min(begin_, packet.received);
  end_ = is_empty_ ? packet.received : std::max(end_, packet.received);
  is_empty_ = false;
  place_.follows = packet.sequence;
  if (is_mark(packet)) {
    is_protected_ = true;
    protects_until_ = std::max(protects_until_.value_or(packet.received), packet.received + config_.mark_after);
    for (Closed& one : closed_) one.is_protected |= one.end >= packet.received - config_.mark_before;
  }
  is_protected_ |= protects_until_ && packet.received <= *protects_until_;
}

Result<std::unique_ptr<JournalWriter>> SegmentedJournal::create_on(std::size_t volume, const JournalHeader& header) {
  const std::filesystem::path in_folder = segment_path(first_, number_ + 1);
  std::filesystem::path file = in_folder;
  link_.clear();
  if (volume > 0) {
    const auto folder =
        std::filesystem::absolute(config_.volumes[volume - 1]) /
        (std::filesystem::absolute(first_).parent_path().filename().string() + "-" + config_.recording.substr(0, 8));
    std::error_code failed;
    // The volume's own folder is not created: without its disk it would be a folder of the system's disk.
    std::filesystem::create_directory(folder, failed);
    if (failed) return output_error("create " + folder.string(), failed.value());
    file = folder / in_folder.filename();
  }
  if (std::error_code unknown; std::filesystem::exists(file, unknown))
    return Error{ErrorCode::Io, file.string() + " exists already"};
  auto writer = JournalWriter::create(file, header, config_.segment, *disk_);
  if (!writer.ok()) {
    (void)disk_->remove(file);  // what is left of it would be in the way of the next attempt
    return writer.error();
  }
  if (volume > 0) {
    link_ = in_folder;
    if (const int result = disk_->link(file, in_folder); result != 0) {
      (void)writer->close();
      (void)disk_->remove(file);
      return output_error("link " + in_folder.string() + " to " + file.string(), -result);
    }
  }
  return std::make_unique<JournalWriter>(std::move(*writer));
}

/// Begins the next segment on the first volume from `least_volume` on that takes it, and closes the present one.
/// `is_rest_kept`: what the present one did not take is kept for the next one.
Status SegmentedJournal::split(nanoseconds now, std::size_t least_volume, bool is_rest_kept) {
  const std::filesystem::path present_link = link_;
  const std::vector<std::uint32_t> old = too_old();
  const SegmentPlace before = place_;
  for (const std::uint32_t number : old) {
    const auto one = std::ranges::find(closed_, number, &Closed::number);
    if (place_.removed.size() <= number) place_.removed.resize(number + std::size_t{1});
    place_.removed[number] = true;
    place_.removed_packets += one->packets;
    place_.removed_bytes += one->bytes;
  }
  Status why;
  for (std::size_t volume = least_volume; volume <= config_.volumes.size(); ++volume) {
    auto next = create_on(volume, header_of(number_ + 1));
    if (!next.ok()) {
      if (why.ok()) why = next.error();
      continue;
    }
    const std::filesystem::path next_link = std::exchange(link_, present_link);
    close_segment(is_rest_kept);
    writer_ = std::move(*next);
    link_ = next_link;
    ++number_;
    if (std::exchange(volume_, volume) != volume)
      news_.push_back({true, fmt::format("the recording goes on in {}: {}", writer_->path().string(),
                                         !why.ok()      ? why.error().message
                                         : is_rest_kept ? "the disk before it refused to write"
                                                        : "the disk before it is full")});
    begun_ = now;
    looked_.reset();
    is_empty_ = true;
    is_protected_ = false;
    waiting_.clear();
    waiting_first_ = 0;
    if (before.removed.empty() && !old.empty())
      news_.push_back(
          {false, "the ring is full: from now on it removes the oldest segments, but not what is around marks"});
    let_go(old);
    return {};
  }
  link_ = present_link;
  place_ = before;
  return why.ok() ? Status(Error{ErrorCode::Exhausted, "no volume is left"}) : why;
}

void SegmentedJournal::close_segment(bool is_rest_kept) {
  const Status closed = writer_->close();
  const bool is_safe = is_rest_kept && writer_->packets_on_medium() == writer_->packets_written();
  if (!closed.ok() && !is_safe) {
    if (first_error_.ok()) first_error_ = closed;
    tell_once(told_close_, fmt::format("a segment of the recording is not whole: {}", closed.error().message));
  }
  bytes_before_ += writer_->bytes_written();
  packets_before_ += writer_->packets_written();
  on_medium_before_ += writer_->packets_on_medium();
  closed_.push_back({number_, writer_->path(), link_, writer_->packets_written(), writer_->bytes_written(), begin_,
                     end_, is_protected_});
}

/// Returns the segments that the ring has no room for.
std::vector<std::uint32_t> SegmentedJournal::too_old() const {
  std::vector<std::uint32_t> out;
  std::uint64_t bytes =
      writer_->bytes_written() + writer_->bytes_waiting() + config_.segment_bytes;  // with the next one
  for (const Closed& one : closed_) bytes += one.is_protected ? 0 : one.bytes;
  for (const Closed& one : closed_) {
    const bool has_no_room = config_.ring_bytes > 0 && bytes > config_.ring_bytes;
    const bool is_past = config_.ring_time > nanoseconds(0) && one.end < end_ - config_.ring_time;
    if (one.number == 1 || one.is_protected || (!has_no_room && !is_past)) continue;
    out.push_back(one.number);
    bytes -= one.bytes;
  }
  return out;
}

void SegmentedJournal::let_go(const std::vector<std::uint32_t>& numbers) {
  for (const std::uint32_t number : numbers) {
    const auto one = std::ranges::find(closed_, number, &Closed::number);
    leaving_.push_back(std::move(*one));
    closed_.erase(one);
  }
  remove_leaving();
}

/// Removes what the ring has let go. What the disk refuses is tried again at the next split and at the end.
void SegmentedJournal::remove_leaving() {
  std::erase_if(leaving_, [&](const Closed& one) {
    int result = disk_->remove(one.file);
    if ((result == 0 || result == -ENOENT) && !one.link.empty()) result = disk_->remove(one.link);
    if (result == 0 || result == -ENOENT) return true;
    tell_once(told_removal_, output_error("remove the ring's " + one.file.string(), -result).message);
    return false;
  });
}

Status SegmentedJournal::close() {
  const Status closed = writer_->close();
  remove_leaving();
  return first_error_.ok() ? closed : first_error_;
}

}  // namespace hueline::storage
