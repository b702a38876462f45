#include "sim/wire/timeline.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <tuple>
#include <utility>

#include "sim/wire/can_encode.hpp"
#include "sim/wire/novatel_encode.hpp"
#include "sim/wire/profile_encode.hpp"
#include "sim/wire/seeded_random.hpp"
#include "sim/wire/utc.hpp"

namespace hueline::sim {
namespace {

/// The sequences from which latencies are drawn. Each device has its own, so that another rate of one device does not
/// change the latencies of the others.
enum LatencyStream : std::uint64_t { kOfLaserData, kOfNmea, kOfIns, kOfSeconds, kOfMarks, kOfPps, kOfImages, kOfWheel };

/// Builds the timeline of one drive.
class Builder {
 public:
  Builder(const Drive& drive, const TimelineConfig& config, const DeviceErrors& errors)
      : drive_(drive), config_(config), errors_(errors), begin_ns_(config.before.begin_ns) {
    timeline_.begin_gps_ns = drive.begin_gps_ns - begin_ns_;
    timeline_.end_ns = begin_ns_ + drive.end_gps_ns - drive.begin_gps_ns;
    timeline_.image_folder = drive.cache_dir;
  }

  Status add_laser();
  Status add_laser_positions();
  Status add_profile();
  void add_profile_status();
  void add_pos();
  void add_pps();
  void add_camera();
  void add_wheel();
  Timeline take();

 private:
  std::int64_t drive_time(GpsNs gps_ns) const { return gps_ns - drive_.begin_gps_ns + begin_ns_; }
  GpsNs gps_time(std::int64_t drive_ns) const { return drive_.begin_gps_ns - begin_ns_ + drive_ns; }
  GpsNs first_whole_second() const { return (drive_.begin_gps_ns + kNsPerSecond - 1) / kNsPerSecond * kNsPerSecond; }
  SeededRandom random(std::uint64_t stream) const { return {config_.seed, kStreamWireLatency + stream}; }
  static std::int64_t draw(SeededRandom& random, const Latency& latency) {
    return random.between(latency.least_ns, latency.most_ns);
  }
  void add(std::int64_t at_ns, WireChannel channel, Bytes payload) {
    WireEvent event;
    event.at_ns = at_ns;
    event.channel = channel;
    event.payload = std::move(payload);
    event.laser = config_.laser;
    if (channel == WireChannel::Pos) event.log = peek_novatel(event.payload);
    timeline_.events.push_back(std::move(event));
  }
  const InsSample* sample_at_or_before(GpsNs gps_ns) const;
  InsSample interpolate(GpsNs gps_ns) const;
  /// Returns the header of a log about this time, by the receiver's own clock.
  NovatelHeader header_of(GpsNs gps_ns, std::int64_t error_ns) const {
    NovatelHeader header = novatel_header(gps_ns + error_ns);
    header.time_status = errors_.receiver_time_status(gps_ns);
    return header;
  }
  std::uint16_t profile_scanner() const { return static_cast<std::uint16_t>(kSimulatedProfileScanner + config_.laser); }
  void add_ins_logs();
  void add_second_logs();
  void add_mark_logs();

  const Drive& drive_;
  const TimelineConfig& config_;
  const DeviceErrors& errors_;
  const std::int64_t begin_ns_;  ///< drive time at which this lap begins
  Timeline timeline_;
};

const InsSample* Builder::sample_at_or_before(GpsNs gps_ns) const {
  const auto after = std::upper_bound(drive_.ins.begin(), drive_.ins.end(), gps_ns,
                                      [](GpsNs t, const InsSample& s) { return t < s.gps_ns; });
  if (drive_.ins.empty()) return nullptr;
  return after == drive_.ins.begin() ? &drive_.ins.front() : &*(after - 1);
}

/// Returns the linear interpolation between neighbouring samples; outside the samples, the nearest one.
InsSample Builder::interpolate(GpsNs gps_ns) const {
  const InsSample* a = sample_at_or_before(gps_ns);
  if (a == nullptr) return {};
  InsSample out = *a;
  out.gps_ns = gps_ns;
  if (a == &drive_.ins.back() || gps_ns <= a->gps_ns) return out;
  const InsSample& b = a[1];
  const double part = static_cast<double>(gps_ns - a->gps_ns) / static_cast<double>(b.gps_ns - a->gps_ns);
  constexpr double InsSample::*kFields[] = {
      &InsSample::latitude_rad,  &InsSample::longitude_rad,  &InsSample::ellipsoidal_height_m,
      &InsSample::velocity_east, &InsSample::velocity_north, &InsSample::velocity_up,
      &InsSample::roll_rad,      &InsSample::pitch_rad};
  for (const auto field : kFields) out.*field += part * (b.*field - a->*field);
  out.heading_rad += part * std::remainder(b.heading_rad - a->heading_rad, 2 * std::numbers::pi);
  return out;
}

Status Builder::add_laser() {
  SeededRandom draws = random(kOfLaserData);
  const std::int64_t span_ns = last_firing_offset_ns(config_.laser_model, config_.laser_return_mode);
  for (const LaserPacket& packet : drive_.laser) {
    LaserPacket stamped;
    const std::int64_t error = errors_.scanner_clock_ns(packet.first_firing_gps_ns);
    if (error != 0) stamped = packet;
    stamped.first_firing_gps_ns += error;
    Result<Bytes> bytes =
        encode_laser_data(error != 0 ? stamped : packet, config_.laser_model, config_.laser_return_mode);
    if (!bytes) return bytes.error();
    add(drive_time(packet.first_firing_gps_ns) + span_ns + draw(draws, config_.laser_data), WireChannel::LaserData,
        std::move(bytes).value());
    timeline_.events.back().number = static_cast<std::uint32_t>(&packet - drive_.laser.data());
  }
  return {};
}

Status Builder::add_laser_positions() {
  if (drive_.laser.empty()) return {};
  SeededRandom draws = random(kOfNmea);
  // A scanner that has run before still has its last sentence.
  GpsNs next_second = first_whole_second() - (begin_ns_ > 0 ? 2 * kNsPerSecond : 0);
  std::int64_t next_nmea_ns = drive_time(next_second) + draw(draws, config_.nmea) + errors_.nmea_delay_ns(next_second);
  std::string sentence;
  for (std::int64_t at = begin_ns_; at < timeline_.end_ns; at += config_.laser_position_period_ns) {
    while (next_nmea_ns <= at) {
      const InsSample sample = interpolate(next_second);
      RmcReport report;
      report.gps_ns =
          next_second + (errors_.nmea_seconds(next_second) - errors_.leap_seconds(next_second)) * kNsPerSecond;
      report.latitude_rad = sample.latitude_rad;
      report.longitude_rad = sample.longitude_rad;
      report.speed_m_s = std::hypot(sample.velocity_east, sample.velocity_north);
      report.course_rad = std::atan2(sample.velocity_east, sample.velocity_north);
      if (errors_.has_nmea(next_second)) sentence = encode_gprmc(report);
      next_second += kNsPerSecond;
      next_nmea_ns = drive_time(next_second) + draw(draws, config_.nmea) + errors_.nmea_delay_ns(next_second);
    }
    const GpsNs sent = gps_time(at);
    Result<Bytes> bytes =
        encode_laser_position({sent + errors_.scanner_clock_ns(sent), errors_.scanner_pps_status(sent), sentence});
    if (!bytes) return bytes.error();
    add(at, WireChannel::LaserPosition, std::move(bytes).value());
  }
  return {};
}

Status Builder::add_profile() {
  SeededRandom draws = random(kOfLaserData);
  std::uint32_t counter = config_.before.profile_datagrams;
  for (const ProfilePacket& packet : drive_.profile) {
    ProfilePacket stamped = packet;
    stamped.first_pulse_gps_ns += errors_.scanner_clock_ns(packet.first_pulse_gps_ns);
    Result<Bytes> bytes = encode_profile_data(stamped, counter++, profile_scanner());
    if (!bytes) return bytes.error();
    const auto span_ns = static_cast<std::int64_t>(packet.counts.size()) * packet.period_ps / 1000;
    add(drive_time(packet.first_pulse_gps_ns) + span_ns + draw(draws, config_.laser_data), WireChannel::LaserData,
        std::move(bytes).value());
    timeline_.events.back().number = static_cast<std::uint32_t>(&packet - drive_.profile.data());
  }
  return {};
}

void Builder::add_profile_status() {
  if (drive_.profile.empty()) return;
  auto counter = static_cast<std::uint32_t>(begin_ns_ / config_.laser_position_period_ns);
  for (std::int64_t at = begin_ns_; at < timeline_.end_ns; at += config_.laser_position_period_ns) {
    const GpsNs sent = gps_time(at);
    // Without a sentence the scanner counts on from the pulses that it still gets.
    const bool has_label = errors_.has_nmea(sent / kNsPerSecond * kNsPerSecond - kNsPerSecond);
    add(at, WireChannel::LaserPosition,
        encode_profile_status({sent + errors_.scanner_clock_ns(sent), counter++, errors_.scanner_pps_status(sent),
                               has_label, has_label, profile_scanner()}));
  }
}

void Builder::add_ins_logs() {
  SeededRandom draws = random(kOfIns);
  std::int64_t earliest = std::numeric_limits<std::int64_t>::min();
  for (const InsSample& solved : drive_.ins) {
    // The receiver sends all solutions through one port, so a solution never overtakes the one before it.
    const std::int64_t at = std::max(drive_time(solved.gps_ns) + draw(draws, config_.ins), earliest);
    earliest = at;
    InsSample sample = solved;
    sample.gps_ns += errors_.receiver_clock_ns(solved.gps_ns) + errors_.ins_stamp_ns(solved.gps_ns);
    const NovatelHeader header = header_of(solved.gps_ns, sample.gps_ns - solved.gps_ns);
    PvaFields pva = pva_fields(sample);
    if (const auto status = errors_.ins_status(solved.gps_ns); status != 3) pva.status = status;
    PvaxFields pvax = pvax_fields(sample, config_.undulation_m);
    pvax.status = pva.status;
    const StdevFields sigma = stdev_fields(sample);
    add(at, WireChannel::Pos, encode_pva(NovatelId::Inspva, header, pva));
    add(at, WireChannel::Pos, encode_pva(NovatelId::Inspvas, header, pva));
    add(at, WireChannel::Pos, encode_pvax(header, pvax));
    add(at, WireChannel::Pos, encode_stdev(NovatelId::Insstdev, header, sigma));
    add(at, WireChannel::Pos, encode_stdev(NovatelId::Insstdevs, header, sigma));
  }
}

void Builder::add_second_logs() {
  SeededRandom draws = random(kOfSeconds);
  for (GpsNs second = first_whole_second(); second < drive_.end_gps_ns; second += kNsPerSecond) {
    const std::int64_t error = errors_.receiver_clock_ns(second);
    const std::int64_t bestpos_at = drive_time(second) + draw(draws, config_.bestpos);
    const std::int64_t time_at = drive_time(second) + draw(draws, config_.time_message);
    if (!drive_.ins.empty()) {
      add(bestpos_at, WireChannel::Pos,
          encode_bestpos(header_of(second, error), bestpos_fields(interpolate(second), config_.undulation_m)));
    }
    const std::int64_t label_error = error + errors_.time_label_ns(second);
    const int leap = errors_.leap_seconds(second);
    TimeFields fields = time_fields(second + label_error - leap * kNsPerSecond);
    fields.utc_offset_s -= leap;
    add(time_at, WireChannel::Pos, encode_time(header_of(second, label_error), fields));
  }
}

void Builder::add_mark_logs() {
  SeededRandom draws = random(kOfMarks);
  std::int64_t earliest = std::numeric_limits<std::int64_t>::min();
  for (const CameraExposure& exposure : drive_.exposures) {
    const double jitter = config_.strobe_jitter_ns * gaussian(config_.seed, kStreamStrobe, exposure.number);
    const GpsNs strobe = exposure.exposure_start_gps_ns + std::llround(jitter);
    const std::int64_t at = std::max(drive_time(strobe) + draw(draws, config_.mark), earliest);
    earliest = at;
    const std::int64_t error = errors_.receiver_clock_ns(strobe);
    const NovatelHeader header = header_of(strobe, error);
    add(at, WireChannel::Pos, encode_mark1_time(header, mark_time_fields(strobe + error)));
    if (!drive_.ins.empty()) {
      PvaFields pva = pva_fields(interpolate(strobe));
      const PvaFields stamped = pva_fields({.gps_ns = strobe + error});
      pva.week = stamped.week;
      pva.seconds = stamped.seconds;
      add(at, WireChannel::Pos, encode_pva(NovatelId::Mark1Pva, header, pva));
    }
  }
}

void Builder::add_pos() {
  add_ins_logs();
  add_second_logs();
  add_mark_logs();
}

void Builder::add_pps() {
  SeededRandom draws = random(kOfPps);
  std::uint64_t sequence = 0;
  const std::int64_t seconds_before = begin_ns_ / kNsPerSecond;
  for (GpsNs second = first_whole_second(); second < drive_.end_gps_ns; second += kNsPerSecond) {
    const std::int64_t error =
        sequence < drive_.pps_edge_error_ns.size() ? drive_.pps_edge_error_ns[static_cast<std::size_t>(sequence)] : 0;
    WireEvent event;
    event.channel = WireChannel::Pps;
    event.edge_ns = drive_time(second) + error;
    event.at_ns = event.edge_ns + draw(draws, config_.pps);
    event.sequence = static_cast<std::uint64_t>(seconds_before) + ++sequence;
    timeline_.events.push_back(std::move(event));
  }
}

void Builder::add_camera() {
  SeededRandom draws = random(kOfImages);
  std::uint64_t sequence = config_.before.exposures;
  std::int64_t earliest = std::numeric_limits<std::int64_t>::min();
  for (const CameraExposure& exposure : drive_.exposures) {
    const std::int64_t end =
        drive_time(exposure.exposure_start_gps_ns) + std::max(exposure.exposure_ns, exposure.longest_ns);
    const std::int64_t latched =
        end + config_.camera_latch_ns + draws.between(-config_.camera_latch_spread_ns, config_.camera_latch_spread_ns);
    WireEvent event;
    event.channel = WireChannel::Camera;
    event.at_ns = std::max(end + draw(draws, config_.image), earliest);
    earliest = event.at_ns;
    event.sequence = sequence++;
    event.latched_ns = latched;
    event.camera_counter_ns = config_.camera_counter_origin_ns + latched +
                              std::llround(static_cast<double>(latched) * config_.camera_drift_ppb * 1e-9);
    event.width = exposure.width;
    event.height = exposure.height;
    event.image_file = exposure.image_file;
    event.number = exposure.number;
    if (exposure.reports.size() == 1) {
      event.reported_exposure_ns = exposure.reports[0].exposure_ns;
      event.reported_gain = exposure.reports[0].gain;
    }
    timeline_.events.push_back(std::move(event));
  }
}

void Builder::add_wheel() {
  // 8 bytes at 500 kbit/s, including stuffed bits and the gap between frames
  constexpr std::int64_t kFrameNs = 260'000;
  SeededRandom draws = random(kOfWheel);
  std::uint32_t counter = config_.before.wheel_samples;
  for (const WheelSample& sample : drive_.wheel) {
    const std::int64_t at = drive_time(sample.gps_ns) + draw(draws, config_.wheel);
    const auto number = static_cast<std::uint32_t>(&sample - drive_.wheel.data());
    add(at, WireChannel::Wheel, encode_wheel_speeds(sample));
    timeline_.events.back().number = number;
    add(at + kFrameNs, WireChannel::Wheel, encode_wheel_pulses(sample, counter++));
    timeline_.events.back().number = number;
  }
}

Timeline Builder::take() {
  sort_events(timeline_.events);
  return std::move(timeline_);
}

template <class Items, class Time>
bool in_time_order(const Items& items, Time time) {
  return std::is_sorted(items.begin(), items.end(), [&](const auto& a, const auto& b) { return time(a) < time(b); });
}

}  // namespace

const char* name(WireChannel channel) {
  switch (channel) {
    case WireChannel::LaserData:
      return "LaserData";
    case WireChannel::LaserPosition:
      return "LaserPosition";
    case WireChannel::Pos:
      return "Pos";
    case WireChannel::Pps:
      return "Pps";
    case WireChannel::Camera:
      return "Camera";
    case WireChannel::Wheel:
      return "Wheel";
  }
  return "?";
}

std::string TimelineConfig::validate() const {
  const std::pair<const char*, Latency> latencies[] = {{"laser_data", laser_data},
                                                       {"nmea", nmea},
                                                       {"ins", ins},
                                                       {"bestpos", bestpos},
                                                       {"time_message", time_message},
                                                       {"mark", mark},
                                                       {"pps", pps},
                                                       {"image", image},
                                                       {"wheel", wheel}};
  for (const auto& [key, latency] : latencies) {
    if (latency.least_ns < 0 || latency.most_ns < latency.least_ns || latency.most_ns > 10 * kNsPerSecond) {
      return fmt::format("{}: {} .. {} ns is not a span within 0 .. 10 s", key, latency.least_ns, latency.most_ns);
    }
  }
  if (laser_position_period_ns < 1'000'000) {
    return fmt::format("laser_position_period_ns: {} is below 1 ms", laser_position_period_ns);
  }
  if (!(strobe_jitter_ns >= 0 && strobe_jitter_ns <= 1e6)) {
    return fmt::format("strobe_jitter_ns: {} is not within 0 .. 1000000", strobe_jitter_ns);
  }
  if (camera_latch_spread_ns < 0) return fmt::format("camera_latch_spread_ns: {} is negative", camera_latch_spread_ns);
  if (!(std::abs(camera_drift_ppb) <= 1e6)) {
    return fmt::format("camera_drift_ppb: {} is not within +- 1000000", camera_drift_ppb);
  }
  return {};
}

Result<Timeline> build_timeline(const Drive& drive, const TimelineConfig& config, const DeviceErrors& errors) {
  if (std::string problem = config.validate(); !problem.empty()) return Error{ErrorCode::Invalid, std::move(problem)};
  if (drive.end_gps_ns <= drive.begin_gps_ns)
    return Error{ErrorCode::Invalid, "the drive does not end after it begins"};
  if (!in_time_order(drive.ins, [](const InsSample& s) { return s.gps_ns; }) ||
      !in_time_order(drive.laser, [](const LaserPacket& p) { return p.first_firing_gps_ns; }) ||
      !in_time_order(drive.profile, [](const ProfilePacket& p) { return p.first_pulse_gps_ns; }) ||
      !in_time_order(drive.wheel, [](const WheelSample& s) { return s.gps_ns; }) ||
      !in_time_order(drive.exposures, [](const CameraExposure& e) { return e.exposure_start_gps_ns; })) {
    return Error{ErrorCode::Invalid, "the drive's samples, packets and exposures are not all in the order of time"};
  }
  Builder builder(drive, config, errors);
  if (Status added = builder.add_laser(); !added) return added.error();
  if (Status added = builder.add_laser_positions(); !added) return added.error();
  if (Status added = builder.add_profile(); !added) return added.error();
  builder.add_profile_status();
  builder.add_pos();
  builder.add_pps();
  builder.add_camera();
  builder.add_wheel();
  return builder.take();
}

void sort_events(std::vector<WireEvent>& events) {
  std::stable_sort(events.begin(), events.end(), [](const WireEvent& a, const WireEvent& b) {
    return std::tie(a.at_ns, a.channel) < std::tie(b.at_ns, b.channel);
  });
}

void add_laser_of(Timeline& timeline, Timeline other) {
  for (WireEvent& event : other.events)
    if (event.channel == WireChannel::LaserData || event.channel == WireChannel::LaserPosition)
      timeline.events.push_back(std::move(event));
  sort_events(timeline.events);
}

}  // namespace hueline::sim
