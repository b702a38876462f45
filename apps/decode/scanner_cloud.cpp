#include "apps/decode/scanner_cloud.hpp"

#include <algorithm>
#include <utility>
#include <variant>

#include "core/calendar.hpp"
#include "core/printable.hpp"

namespace hueline::apps {

void Learnt::learn(const std::vector<Measurement>& measured) {
  for (const Measurement& m : measured) {
    if (const auto* batch = std::get_if<LaserBatch>(&m)) {
      if (!std::exchange(is_scanner, true)) first = batch->received;
      const auto* counter = std::get_if<LaserCounter>(&batch->time);
      if (!counter) continue;
      has_counter = true;
      has_own_counter |= counter->origin == CounterOrigin::Own;
      if (counter->origin == CounterOrigin::Own) continue;
      labels.set_period(counter->period);
      hours.set_period(counter->period);
    } else if (const auto* label = std::get_if<TimeLabel>(&m)) {
      if (label->is_valid) labels.add(label->second, label->received);
      if (label->names_hour) hours.add(label->second, label->received);
    } else if (const auto* status = std::get_if<LaserStatus>(&m)) {
      has_status = true;
      is_locked |= status->clock == SyncState::Locked;
      words = printable(status->words);
    }
  }
}

CloudClock::CloudClock(Learnt learnt, const DecodeOptions& options)
    : learnt_(std::move(learnt)), near_(options.near), trusts_arrivals_(options.trusts_arrivals) {
  learnt_.labels.settle();
  learnt_.hours.settle();
  is_absolute_ = !learnt_.has_own_counter && (!learnt_.has_counter || learnt_.labels.is_settled() ||
                                              learnt_.hours.is_settled() || near_ || trusts_arrivals_);
}

GpsTime CloudClock::of(const LaserBatch& batch) const {
  const auto* counter = std::get_if<LaserCounter>(&batch.time);
  if (counter && !is_absolute_) return GpsTime(counter->value);
  const GpsTime near = counter ? near_to(batch.received) : GpsTime{};
  if (const auto* utc = std::get_if<UnixTime>(&batch.time)) return from_unix(*utc);
  return sync::instant_of(batch.time, near, utc_offset_from_table(near)).value_or(GpsTime{});
}

std::string CloudClock::words() const {
  std::string said = learnt_.words.empty() ? "" : " (the scanner: " + learnt_.words + ")";
  if (is_absolute_) {
    std::string out = learnt_.has_counter ? "UTC, hour of the scanner's counter by " + hour_by() : "UTC";
    if (!learnt_.is_locked) out += "; the scanner does not say that its clock follows a reference";
    return out + said;
  }
  if (learnt_.has_own_counter) return "seconds of the scanner's own clock, which has no date" + said;
  return "seconds past the hour by the scanner's counter; which hour is not known: --near gives it" + said;
}

std::string CloudClock::hour_by() const {
  return learnt_.labels.is_settled() ? "its receiver's labels"
         : near_                     ? "--near"
         : learnt_.hours.is_settled()
             ? "the valid RMC sentences of its receiver (without a pulse the seconds are those of the counter alone)"
             : "the file's arrivals";
}

GpsTime CloudClock::near_to(HostTime received) const {
  if (const auto near = learnt_.labels.near(received)) return *near;
  if (near_) return *near_ + (received - learnt_.first);
  if (const auto near = learnt_.hours.near(received)) return *near;
  return from_unix(UnixTime(received.time_since_epoch()));
}

ScannerCloud::ScannerCloud(DecodedScanner scanner, CloudClock clock)
    : scanner_(std::move(scanner)),
      clock_(std::move(clock)),
      format_(scanner_.cloud.extension() == ".pcd" ? storage::ScannerCloudWriter::Format::Pcd
                                                   : storage::ScannerCloudWriter::Format::Las) {
  scanner_.clock = clock_.words();
}

void ScannerCloud::take(const std::vector<Measurement>& measured) {
  for (const Measurement& m : measured) {
    if (const auto* batch = std::get_if<LaserBatch>(&m)) {
      take_batch(*batch);
    } else if (const auto* fault = std::get_if<Fault>(&m)) {
      scanner_.faults[name(fault->kind)] += fault->count;
      scanner_.fault_details[name(fault->kind)] = printable(fault->detail);
    }
  }
}

Status ScannerCloud::close() {
  if (writer_ && done_.ok()) done_ = writer_->close();
  return done_;
}

void ScannerCloud::take_batch(const LaserBatch& batch) {
  if (batch.returns.empty() || !done_.ok()) return;
  const GpsTime first = clock_.of(batch);
  if (!writer_) create(first, batch);
  points_.clear();
  for (const LaserReturn& one : batch.returns) {
    const GpsTime time = first + nanoseconds(one.time_offset_ns);
    points_.push_back({one, seconds_of(time)});
    ++scanner_.points_by_return[one.return_number];
    if (!clock_.is_absolute()) continue;
    scanner_.begin = scanner_.begin ? std::min(*scanner_.begin, time) : time;
    scanner_.end = scanner_.end ? std::max(*scanner_.end, time) : time;
  }
  scanner_.points += points_.size();
  if (done_.ok()) done_ = writer_->append(points_);
}

void ScannerCloud::create(GpsTime first, const LaserBatch& batch) {
  storage::ScannerCloudWriter::Config config;
  config.format = format_;
  config.has_gps_time = clock_.is_absolute();
  config.scanner = scanner_.name;
  config.clock = scanner_.clock;
  config.created = to_utc(clock_.is_absolute() ? first : from_unix(UnixTime(batch.received.time_since_epoch())));
  auto writer = storage::ScannerCloudWriter::create(scanner_.cloud, config);
  if (writer.ok())
    writer_ = std::make_unique<storage::ScannerCloudWriter>(std::move(writer).value());
  else
    done_ = writer.error();
}

/// Returns the number for the file: adjusted GPS time in LAS, Unix time in PCD, or the counter's seconds.
double ScannerCloud::seconds_of(GpsTime time) const {
  if (!clock_.is_absolute()) return to_seconds(time.time_since_epoch());
  if (format_ == storage::ScannerCloudWriter::Format::Las) return storage::to_las_time(time);
  return to_seconds(to_unix(time).time_since_epoch());
}

}  // namespace hueline::apps
