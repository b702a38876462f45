#include "apps/decode/decode_capture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <functional>
#include <memory>
#include <utility>
#include <variant>

#include "apps/inspect/capture_devices.hpp"
#include "core/calendar.hpp"
#include "core/printable.hpp"
#include "drivers/transport/pcap_source.hpp"
#include "storage/scanner_cloud_writer.hpp"
#include "sync/labelled_time.hpp"

namespace hueline::apps {
namespace {

/// A sender of at least so many datagrams that are so large on average may be a scanner.
constexpr std::uint64_t kLeastDatagrams = 20, kLeastMeanBytes = 200;

/// What the first reading of the file tells of one device.
struct Learnt {
  sync::LabelledTime labels{1};
  bool is_scanner = false;
  bool has_counter = false;  // some stamps are readings of a counter
  bool has_own_counter = false;
  bool is_locked = false;  // the scanner said so at least once
  bool has_status = false;
  std::string words;  // what the scanner said of its clock at last
  HostTime first{};
};

/// Decides what the times of a cloud are.
class CloudClock {
 public:
  CloudClock(const Learnt& learnt, const DecodeOptions& options) : learnt_(learnt), options_(options) {
    learnt_.labels.settle();
    is_absolute_ = !learnt.has_own_counter &&
                   (!learnt.has_counter || learnt_.labels.is_settled() || options.near || options.trusts_arrivals);
  }

  bool is_absolute() const { return is_absolute_; }

  /// Returns the time of a batch's first firing: GPS time if it is absolute, otherwise the counter's value as if it
  /// were one.
  GpsTime of(const LaserBatch& batch) const {
    const auto* counter = std::get_if<LaserCounter>(&batch.time);
    if (counter && !is_absolute_) return GpsTime(counter->value);
    const GpsTime near = counter ? near_to(batch.received) : GpsTime{};
    if (const auto* utc = std::get_if<UnixTime>(&batch.time)) return from_unix(*utc);
    return sync::instant_of(batch.time, near, utc_offset_from_table(near)).value_or(GpsTime{});
  }

  std::string words() const {
    std::string said = learnt_.words.empty() ? "" : " (the scanner: " + learnt_.words + ")";
    if (is_absolute_) {
      std::string out = learnt_.has_counter ? "UTC, hour of the scanner's counter by " + hour_by() : "UTC";
      if (!learnt_.is_locked) out += "; the scanner does not say that its clock follows a reference";
      return out + said;
    }
    if (learnt_.has_own_counter) return "seconds of the scanner's own clock, which has no date" + said;
    return "seconds past the hour by the scanner's counter; which hour is not known: --near gives it" + said;
  }

 private:
  std::string hour_by() const {
    return learnt_.labels.is_settled() ? "its receiver's labels" : options_.near ? "--near" : "the file's arrivals";
  }
  GpsTime near_to(HostTime received) const {
    if (const auto near = learnt_.labels.near(received)) return *near;
    if (options_.near) return *options_.near + (received - learnt_.first);
    return from_unix(UnixTime(received.time_since_epoch()));
  }

  Learnt learnt_;
  const DecodeOptions& options_;
  bool is_absolute_;
};

using Take = std::function<void(std::size_t device, std::vector<Measurement>&)>;

/// Reads the file and calls `take` for the measurements of each device, which has the same number in every reading.
Result<DecodedCapture> read_capture(const DecodeOptions& options, CaptureDevices& devices, const Take& take) {
  DecodedCapture out;
  drivers::PcapSource source(
      {.path = options.capture, .ports = {}, .source_address = {}, .protocol = drivers::PcapSource::Protocol::All});
  if (Status opened = source.open(); !opened.ok()) return opened.error();
  std::uint64_t packets = 0;
  std::vector<Measurement> measured;
  std::map<const CaptureDevice*, std::size_t> numbers;
  const auto number_of = [&](const CaptureDevice& device) {
    return numbers.emplace(&device, numbers.size()).first->second;
  };
  for (;;) {
    Result<Packet> packet = source.next({});
    if (!packet.ok()) {
      if (packet.error().code == ErrorCode::EndOfData) break;
      if (out.trouble.ok()) out.trouble = packet.error();
      continue;
    }
    if (packet->kind == PacketKind::Fault) {
      const auto fault = decode_fault(1, packet->received, packet->bytes.bytes());
      const bool is_loss =
          fault.ok() && (fault->kind == FaultKind::Malformed || fault->kind == FaultKind::Disconnected);
      if (is_loss && out.trouble.ok()) out.trouble = Error{ErrorCode::Malformed, fault->detail};
    } else {
      ++packets;
    }
    measured.clear();
    if (const CaptureDevice* device = devices.take(*packet, source, measured)) take(number_of(*device), measured);
  }
  devices.finish([&](const CaptureDevice& device, std::vector<Measurement>& last) { take(number_of(device), last); });
  if (devices.devices().empty()) {
    if (!out.trouble.ok() && packets == 0) return out.trouble.error();
    return Error{ErrorCode::Unsupported,
                 fmt::format("{}: not supported: {}", options.capture, devices.why_undecoded(packets))};
  }
  return out;
}

void learn(Learnt& learnt, const std::vector<Measurement>& measured) {
  for (const Measurement& m : measured) {
    if (const auto* batch = std::get_if<LaserBatch>(&m)) {
      if (!std::exchange(learnt.is_scanner, true)) learnt.first = batch->received;
      const auto* counter = std::get_if<LaserCounter>(&batch->time);
      if (!counter) continue;
      learnt.has_counter = true;
      learnt.has_own_counter |= counter->origin == CounterOrigin::Own;
      if (counter->origin != CounterOrigin::Own) learnt.labels.set_period(counter->period);
    } else if (const auto* label = std::get_if<TimeLabel>(&m)) {
      if (label->is_valid) learnt.labels.add(label->second, label->received);
    } else if (const auto* status = std::get_if<LaserStatus>(&m)) {
      learnt.has_status = true;
      learnt.is_locked |= status->clock == SyncState::Locked;
      learnt.words = printable(status->words);
    }
  }
}

/// The name of a scanner's cloud beside those of other scanners.
std::filesystem::path name_beside(const std::filesystem::path& out, const CaptureDevice& device,
                                  const std::deque<CaptureDevice>& all) {
  std::string tail = "-" + drivers::to_text(device.address);
  std::ranges::replace(tail, ':', '_');
  const auto at_address =
      std::ranges::count_if(all, [&](const CaptureDevice& other) { return other.address == device.address; });
  if (at_address > 1) tail += fmt::format("-{}", device.port);
  const auto same = std::ranges::count_if(all, [&](const CaptureDevice& other) {
    return &other < &device && other.address == device.address && other.port == device.port;
  });
  if (same > 0) tail += fmt::format("-{}", same + 1);
  return std::filesystem::path(out).replace_filename(out.stem().string() + tail + out.extension().string());
}

/// Writes the cloud of one scanner.
class ScannerCloud {
 public:
  ScannerCloud(DecodedScanner scanner, CloudClock clock, storage::ScannerCloudWriter::Format format)
      : scanner_(std::move(scanner)), clock_(std::move(clock)), format_(format) {
    scanner_.clock = clock_.words();
  }

  void take(const std::vector<Measurement>& measured) {
    for (const Measurement& m : measured) {
      if (const auto* batch = std::get_if<LaserBatch>(&m)) {
        take_batch(*batch);
      } else if (const auto* fault = std::get_if<Fault>(&m)) {
        scanner_.faults[name(fault->kind)] += fault->count;
        scanner_.fault_details[name(fault->kind)] = printable(fault->detail);
      }
    }
  }
  Status close() {
    if (writer_ && done_.ok()) done_ = writer_->close();
    return done_;
  }
  const DecodedScanner& scanner() const { return scanner_; }

 private:
  void take_batch(const LaserBatch& batch) {
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
  void create(GpsTime first, const LaserBatch& batch) {
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
  double seconds_of(GpsTime time) const {
    if (!clock_.is_absolute()) return to_seconds(time.time_since_epoch());
    if (format_ == storage::ScannerCloudWriter::Format::Las) return storage::to_las_time(time);
    return to_seconds(to_unix(time).time_since_epoch());
  }

  DecodedScanner scanner_;
  CloudClock clock_;
  storage::ScannerCloudWriter::Format format_;
  std::unique_ptr<storage::ScannerCloudWriter> writer_;
  std::vector<storage::ScannerPoint> points_;
  Status done_;
};

std::vector<std::string> not_supported(const CaptureDevices& devices) {
  std::vector<std::string> out;
  if (const std::string unknown = devices.unknown_models(); !unknown.empty()) out.push_back(unknown);
  for (const auto& [from, sent] : devices.strangers()) {
    const auto& [address, port] = from;
    if (sent.datagrams >= kLeastDatagrams && sent.bytes / sent.datagrams >= kLeastMeanBytes)
      out.push_back(fmt::format("{} packets of {} bytes on average from {}, port {}: of no device that is known",
                                sent.datagrams, sent.bytes / sent.datagrams, drivers::to_text(address), port));
  }
  return out;
}

}  // namespace

Result<DecodedCapture> decode_capture(const DecodeOptions& options, drivers::DeviceTypes types) {
  CaptureDevices first(options.capture, types);
  for (const std::string& file : options.descriptions)
    if (Status used = first.use_description(file); !used.ok()) return used.error();
  std::map<std::size_t, Learnt> learnt;
  const auto seen = read_capture(options, first, [&](std::size_t device, const std::vector<Measurement>& measured) {
    learn(learnt[device], measured);
  });
  if (!seen.ok()) return seen.error();

  const auto format = options.out.extension() == ".pcd" ? storage::ScannerCloudWriter::Format::Pcd
                                                        : storage::ScannerCloudWriter::Format::Las;
  const auto scanners = std::ranges::count_if(learnt, [](const auto& one) { return one.second.is_scanner; });
  std::map<std::size_t, ScannerCloud> clouds;
  for (const auto& [number, known] : learnt) {
    if (!known.is_scanner) continue;
    const CaptureDevice& device = first.devices()[number];
    DecodedScanner scanner;
    scanner.name = device.name;
    scanner.note = device.note;
    scanner.address = drivers::to_text(device.address);
    scanner.cloud = scanners == 1 ? options.out : name_beside(options.out, device, first.devices());
    clouds.emplace(number, ScannerCloud(std::move(scanner), CloudClock(known, options), format));
  }
  CaptureDevices second(options.capture, types);
  for (const std::string& file : options.descriptions)
    if (Status used = second.use_description(file); !used.ok()) return used.error();
  auto out = read_capture(options, second, [&](std::size_t device, const std::vector<Measurement>& measured) {
    if (const auto cloud = clouds.find(device); cloud != clouds.end()) cloud->second.take(measured);
  });
  if (!out.ok()) return out.error();
  for (auto& [number, cloud] : clouds) {
    if (Status closed = cloud.close(); !closed.ok() && out->written.ok()) out->written = closed;
    out->scanners.push_back(cloud.scanner());
  }
  out->not_supported = not_supported(second);
  return out;
}

}  // namespace hueline::apps
