#include "runtime/file_merge.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "core/calendar.hpp"

namespace hueline::runtime {
namespace {

using std::chrono::seconds;

// The course of a file is its device's time less the stamps of its capture file.
constexpr nanoseconds kSameCourse = seconds(1);         // smaller changes are the same course
constexpr nanoseconds kFarOff = std::chrono::hours(1);  // largest distance of a stamp from the labels around it
constexpr int kNewCourse = 100;                         // so many packets in a row make a new course believed
constexpr nanoseconds kLongestStep = seconds(10);       // longest step of stamps that is believed by itself

HostTime as_received(GpsTime time) { return HostTime(to_unix(time).time_since_epoch()); }

}  // namespace

struct FileMerge::File {
  File(Input from, int agreeing_labels) : input(std::move(from)), labels(agreeing_labels) {}

  Input input;
  sync::LabelledTime labels;
  std::deque<Ahead> ahead;
  std::size_t ahead_bytes = 0;
  bool is_open = false, is_closed = false;
  std::optional<Error> ended;  // comes after the packets in `ahead`
  HostTime key{};              // time of the first packet in `ahead`
  // The members below are of the packet before it.
  std::optional<HostTime> last_key, last_stamp;
  std::optional<nanoseconds> course;  // device's time less stamp
  nanoseconds strange_course{0};
  int strange = 0;
};

/// One file of the merge, as its reader sees it.
class FileMerge::Source final : public PacketSource {
 public:
  Source(std::shared_ptr<FileMerge> merge, std::size_t index) : merge_(std::move(merge)), index_(index) {}
  Status open() override { return merge_->open(index_); }
  Result<Packet> next(std::stop_token stop) override { return merge_->next(index_, std::move(stop)); }
  void close() override { merge_->close(index_); }

 private:
  const std::shared_ptr<FileMerge> merge_;
  const std::size_t index_;
};

FileMerge::FileMerge(std::vector<Input> inputs, Config config) : config_(config) {
  for (Input& input : inputs) files_.push_back(std::make_unique<File>(std::move(input), config.agreeing_labels));
}

FileMerge::~FileMerge() = default;

std::vector<std::unique_ptr<PacketSource>> FileMerge::sources(const std::shared_ptr<FileMerge>& merge) {
  std::vector<std::unique_ptr<PacketSource>> out;
  for (std::size_t i = 0; i < merge->files_.size(); ++i) out.push_back(std::make_unique<Source>(merge, i));
  return out;
}

HostTime FileMerge::position() const {
  Lock lock(mutex_);
  return position_;
}

Status FileMerge::open(std::size_t index) {
  Lock lock(mutex_);
  changed_.wait(lock, [&]() HUELINE_REQUIRES(mutex_) { return opening_ == index; });
  File& file = *files_[index];
  const Status opened = file.input.source->open();
  file.is_open = opened.ok();
  return opened;
}

/// Ends a file's turn to open: its reader has already submitted the faults of opening it. The next file may open.
void FileMerge::opened(std::size_t index) {
  if (opening_ != index) return;
  ++opening_;
  changed_.notify_all();
}

void FileMerge::close(std::size_t index) {
  Lock lock(mutex_);
  File& file = *files_[index];
  if (file.is_open) file.input.source->close();
  file.is_open = false;
  file.is_closed = true;
  file.ahead.clear();
  if (turn_ == index) turn_.reset();
  // A reader that was stopped before it opened its file closes it out of turn.
  while (opening_ < files_.size() && (opening_ == index || files_[opening_]->is_closed)) ++opening_;
  changed_.notify_all();
}

Result<Packet> FileMerge::next(std::size_t index, std::stop_token stop) {
  Lock lock(mutex_);
  opened(index);
  if (turn_ == index) turn_.reset();
  File& file = *files_[index];
  if (!file.is_open) return Error{ErrorCode::Disconnected, "the file is not open"};
  const auto is_my_turn = [&]() HUELINE_REQUIRES(mutex_) {
    if (turn_ || opening_ < files_.size()) return false;
    if (!has_begun_) {
      for (const auto& each : files_)
        if (!each->is_closed) look_ahead(*each, stop);
      if (stop.stop_requested()) return false;
      begin();
    }
    return first() == index;
  };
  if (!is_my_turn()) {
    changed_.notify_all();
    changed_.wait_for(lock, stop, std::chrono::milliseconds(100), is_my_turn);
    if (stop.stop_requested()) return Error{ErrorCode::Stopped, "stop was asked for"};
    if (!is_my_turn()) return Error{ErrorCode::TimedOut, "the turn of another file"};
  }
  turn_ = index;
  if (file.ahead.empty()) return *file.ended;
  Packet packet = std::move(file.ahead.front().packet);
  file.last_key = file.key;
  file.last_stamp = packet.received;
  file.ahead_bytes -= packet.bytes.size();
  file.ahead.pop_front();
  position_ = std::max(position_, file.key);
  packet.received = position_;
  // The time of the packet behind it decides when it is this file's turn again.
  if (file.ahead.empty() && !file.ended) read(file, stop);
  set_key(file);
  return packet;
}

void FileMerge::read(File& file, std::stop_token stop) {
  Result<Packet> packet = file.input.source->next(std::move(stop));
  if (!packet.ok()) {
    file.ended = packet.error();
    return;
  }
  Ahead ahead{std::move(*packet), {}, {}};
  if (ahead.packet.kind == PacketKind::Wire && file.input.decoder) {
    std::vector<Measurement> measured;
    file.input.decoder->decode(ahead.packet, measured);
    for (const Measurement& m : measured) {
      if (const auto* batch = std::get_if<LaserBatch>(&m)) {
        ahead.stamp = batch->time;
        if (const auto* counter = std::get_if<LaserCounter>(&batch->time)) file.labels.set_period(counter->period);
      }
      if (const auto* status = std::get_if<LaserStatus>(&m); status && status->clock == SyncState::Locked)
        ahead.stamp = status->time;
      if (const auto* label = std::get_if<TimeLabel>(&m); label && label->is_valid)
        file.labels.add(label->second, label->received);
      // Only times that the receiver itself calls fine become TimedArrivals.
      if (const auto* arrival = std::get_if<TimedArrival>(&m))
        ahead.time = ahead.time ? std::max(*ahead.time, arrival->time) : arrival->time;
    }
  }
  file.ahead_bytes += ahead.packet.bytes.size();
  file.ahead.push_back(std::move(ahead));
}

/// Reads ahead until a file's times are known. A scanner's packets have a time only after a label, which comes once a
/// second. A receiver's log may begin before its time is fine.
void FileMerge::look_ahead(File& file, std::stop_token stop) {
  const auto has_time = [&] {
    return file.input.has_stamps ? file.labels.is_settled() : !file.ahead.empty() && file.ahead.back().time.has_value();
  };
  while (!file.ended && !stop.stop_requested() && file.ahead.size() < config_.ahead_packets &&
         file.ahead_bytes < config_.ahead_bytes && (file.ahead.empty() || !has_time()))
    read(file, stop);
  file.labels.settle();
}

std::optional<HostTime> FileMerge::own_time(const File& file, const Ahead& ahead) const {
  if (ahead.time) return as_received(*ahead.time);
  if (!ahead.stamp || !file.labels.is_settled()) return {};
  const GpsTime near = *file.labels.near(ahead.packet.received);
  const auto instant = sync::instant_of(*ahead.stamp, near, utc_offset_from_table(near));
  // The stamp of a damaged packet may be any time.
  if (!instant || std::chrono::abs(*instant - near) > kFarOff) return {};
  return as_received(*instant);
}

/// Finds where the times of the files begin, once every file stands at its first packet.
void FileMerge::begin() {
  has_begun_ = true;
  std::optional<HostTime> earliest, earliest_stamp;
  const auto lower = [](std::optional<HostTime>& least, HostTime time) {
    least = least ? std::min(*least, time) : time;
  };
  for (const auto& file : files_) {
    // The first packets may name no time, because a log may begin anywhere.
    for (const Ahead& ahead : file->ahead)
      if (const auto own = own_time(*file, ahead)) {
        lower(earliest, *own);
        break;
      }
    if (file->input.has_stamps && !file->ahead.empty()) lower(earliest_stamp, file->ahead.front().packet.received);
  }
  is_self_timed_ = earliest.has_value();
  position_ = earliest ? *earliest : earliest_stamp.value_or(HostTime{});
  for (const auto& file : files_) set_key(*file);
}

void FileMerge::set_key(File& file) {
  if (file.ahead.empty()) {
    file.key = file.last_key.value_or(position_);
    return;
  }
  const Ahead& ahead = file.ahead.front();
  const HostTime stamp = ahead.packet.received;
  if (!is_self_timed_ && file.input.has_stamps) {
    file.key = stamp;
    return;
  }
  const nanoseconds step =
      file.last_stamp ? std::clamp(stamp - *file.last_stamp, nanoseconds(0), kLongestStep) : nanoseconds(0);
  const HostTime followed = file.last_key.value_or(position_) + (file.input.has_stamps ? step : nanoseconds(0));
  const auto own = own_time(file, ahead);
  if (!own) {
    file.key = followed;
    return;
  }
  if (!file.input.has_stamps) {
    file.key = *own;
    return;
  }
  // If the counter of one scanner leaps for some packets, the other files must not wait for it, nor it for them.
  const nanoseconds course = *own - stamp;
  if (file.course && std::chrono::abs(course - *file.course) > kSameCourse) {
    file.strange =
        file.strange > 0 && std::chrono::abs(course - file.strange_course) <= kSameCourse ? file.strange + 1 : 1;
    file.strange_course = course;
    if (file.strange < kNewCourse) {
      file.key = followed;
      return;
    }
  }
  file.strange = 0;
  file.course = course;
  file.key = *own;
}

std::optional<std::size_t> FileMerge::first() const {
  std::optional<std::size_t> out;
  for (std::size_t i = 0; i < files_.size(); ++i)
    if (!files_[i]->is_closed && (!out || files_[i]->key < files_[*out]->key)) out = i;
  return out;
}

}  // namespace hueline::runtime
