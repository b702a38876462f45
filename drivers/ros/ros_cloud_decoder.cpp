#include "drivers/ros/ros_cloud_decoder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <numbers>
#include <utility>

#include "core/portable_math.hpp"

namespace hueline::drivers {
namespace {

using std::chrono::milliseconds;

/// The points of a message are given in batches of this duration, as scanners send them.
constexpr nanoseconds kSlice = milliseconds(1);
/// Stamps from the year 2000 on are dates.
constexpr nanoseconds kYear2000 = std::chrono::seconds(946'684'800);
/// Period of a clock that is not set: 100 years.
constexpr nanoseconds kLongestCounter = std::chrono::hours(876'000);
/// Points that span more than so many periods, or less than this part of one, have times that were misunderstood.
constexpr double kMostPeriods = 1.5, kLeastPeriods = 0.005;

const RosField* first_of(const RosCloud& cloud, std::initializer_list<const char*> names) {
  for (const char* name : names)
    if (const RosField* field = cloud.find(name)) return field;
  return nullptr;
}
const RosField* intensity_of(const RosCloud& cloud, const std::string& name) {
  return name.empty() ? first_of(cloud, {"intensity", "i", "reflectivity", "Intensity"}) : cloud.find(name);
}

LaserTime laser_time(UnixTime time) {
  const nanoseconds since = time.time_since_epoch();
  if (since >= kYear2000) return time;
  return LaserCounter{CounterOrigin::Own, kLongestCounter, std::max(since, nanoseconds(0))};
}

std::uint16_t channel_of(double ring) { return ring > 0 ? static_cast<std::uint16_t>(std::min(ring, 65535.0)) : 0; }

double azimuth_of(double x, double y) {
  const double angle = portable::atan2(y, x);
  return angle < 0 ? angle + 2 * std::numbers::pi : angle;
}

}  // namespace

void RosCloudDecoder::Config::visit(Keys& keys) {
  keys.choice({"message", "",
               "The type of the messages: `sensor_msgs/PointCloud2`, `CustomMsg` of Livox's drivers, "
               "`sensor_msgs/LaserScan`, `point_cloud_interfaces/CompressedPointCloud2`, or `sensor_msgs/PointCloud`, "
               "its older kind."},
              message,
              {{word_of(Message::PointCloud2), Message::PointCloud2},
               {word_of(Message::Livox), Message::Livox},
               {word_of(Message::LaserScan), Message::LaserScan},
               {word_of(Message::PackedPointCloud2), Message::PackedPointCloud2},
               {word_of(Message::PointCloud), Message::PointCloud}});
  keys.choice({"encoding", "", "How the messages are encoded: by ROS 1, or by ROS 2 (CDR)."}, encoding,
              {{"ros1", RosEncoding::Ros1}, {"cdr", RosEncoding::Cdr}});
  keys.flag(
      {"stamp_is_enough", "",
       "header.stamp is the time of all points of a message, within `stamp_sigma_us`: for clouds that their driver "
       "has moved to that moment, and for points without times. Without it, those are not used."},
      stamp_is_enough);
  keys.text({"time_field", "", "The field with the times of the points.", "recognised from the first message"},
            times.field);
  keys.text({"time_seconds_field", "",
             "The field with the whole seconds of the times, if `time_field` has only the rest (timestamp_sec beside "
             "timestamp_nsec).",
             "none; recognised where `time_field` is"},
            times.seconds_field);
  keys.choice({"time_unit", "",
               "The unit of the times. `auto`: the one in which the points of the first message span 2 ms to 2 s."},
              times.unit,
              {{"auto", RosTimeUnit::Auto},
               {"s", RosTimeUnit::Second},
               {"ms", RosTimeUnit::Millisecond},
               {"us", RosTimeUnit::Microsecond},
               {"ns", RosTimeUnit::Nanosecond}});
  keys.choice({"time_zero", "",
               "To what the times count: to header.stamp, to 1970 on the clock of header.stamp (`date`), or to "
               "anything else (`first`: header.stamp is then taken for the first point's). `auto`: up to 2 s they "
               "count to header.stamp; within 10 s of header.stamp they are dates."},
              times.zero,
              {{"auto", RosTimeZero::Auto},
               {"stamp", RosTimeZero::Stamp},
               {"date", RosTimeZero::Date},
               {"first", RosTimeZero::First}});
  keys.choice({"clock", "",
               "The clock of header.stamp. `computer`: that of the computer which ran the driver; the messages of the "
               "POS say how far it is from GPS time, good to a millisecond. `utc`: it follows UTC."},
              is_utc, {{"computer", false}, {"utc", true}});
  keys.duration({"stamp_sigma_us", "us", "One standard deviation of header.stamp on its clock."}, stamp_sigma,
                {0.01, 1'000'000});
  keys.text({"intensity_field", "", "The field with the strength of the returns.", "`intensity`, `i`, `reflectivity`"},
            intensity_field);
  keys.number({"intensity_full", "", "The intensity that becomes 255; higher ones become 255 too."}, intensity_full,
              {0, 1e12, Ends::MaxOnly});
  keys.number({"min_range_m", "m", "Nearer returns are dropped."}, min_range_m, {0, 1000});
  keys.number({"max_range_m", "m", "Farther returns are dropped. It is above `min_range_m`.", "none is dropped"},
              max_range_m, {0, 10'000});
}

KeyError RosCloudDecoder::Config::validate() const {
  if (KeyError wrong = check_keys(*this); !wrong.empty()) return wrong;
  if (max_range_m && *max_range_m <= min_range_m)
    return not_allowed("max_range_m", number_text(*max_range_m), "more than min_range_m");
  if (times.field.empty() && !times.seconds_field.empty())
    return {"time_seconds_field", "is given without time_field; allowed: both, or neither"};
  if (stamp_is_enough && !times.field.empty())
    return {"time_field", "is given, though stamp_is_enough leaves the times of the points out; allowed: one of them"};
  return {};
}

RosCloudDecoder::Config RosCloudDecoder::suited(std::string_view type, RosEncoding encoding, const RosCloud& first,
                                                nanoseconds period) {
  Config out;
  out.message = cloud_kind(type).value_or(Message::PointCloud2);
  out.encoding = encoding;
  out.times = recognise_times(first, {}).value_or(RosTimeRule{});
  out.stamp_is_enough = out.times.field.empty();
  if (out.stamp_is_enough || out.times.zero == RosTimeZero::First) out.stamp_sigma = period / 2;
  const RosField* field = intensity_of(first, {});
  double largest = 0;
  const RosReturns returns(first);
  for (std::size_t i = 0; field && i < first.size(); ++i) {
    const auto point = first.point(i);
    const double value = value_of(first, *field, point);
    if (returns.has(point) && std::isfinite(value)) largest = std::max(largest, value);
  }
  out.intensity_full = largest > 0 ? std::min(largest, 1e12) : 255;
  constexpr std::array<double, 4> kUsual{1, 255, 4095, 65535};
  const auto* usual = std::ranges::find_if(kUsual, [&](double full) { return largest <= full; });
  if (largest > 0 && usual != kUsual.end()) out.intensity_full = *usual;
  return out;
}

void RosCloudDecoder::reset() {
  rule_.reset();
  last_stamp_.reset();
  period_.reset();
  is_zero_told_ = is_span_told_ = false;
}

nanoseconds RosCloudDecoder::end_of(const RosCloud& cloud, const RosTimeRule& rule) {
  const auto points = timed_points(cloud, rule);
  if (!points.ok() || points->empty() || rule.field.empty()) return kSlice;
  return nanoseconds(points->back().offset_ns);
}

void RosCloudDecoder::tell(const Packet& packet, FaultKind kind, std::string what,
                           std::vector<Measurement>& out) const {
  out.push_back(Fault{packet.sensor, kind, packet.received, 1, "cloud of ROS: " + what});
}

void RosCloudDecoder::refuse(const Packet& packet, const std::string& what, std::vector<Measurement>& out) {
  counts_.malformed_bytes += packet.bytes.size();
  ++counts_.malformed_messages;
  tell(packet, FaultKind::Malformed, what, out);
}

void RosCloudDecoder::decode(const Packet& packet, std::vector<Measurement>& out) {
  auto cloud = take_cloud(config_.message, RosReader(packet.bytes.bytes(), config_.encoding));
  if (!cloud.ok()) return refuse(packet, cloud.error().message, out);
  if (count_ns(cloud->header.stamp) == 0) {
    cloud->header.stamp = UnixTime(packet.received.time_since_epoch());
    if (!std::exchange(is_zero_told_, true))
      tell(packet, FaultKind::NoTime, "header.stamp is 0: the time at which the message came is taken", out);
  }
  if (!rule_) rule_ = config_.stamp_is_enough ? RosTimeRule{} : recognise_times(*cloud, config_.times);
  const auto points = timed_points(*cloud, rule_.value_or(RosTimeRule{}));
  if (!points.ok()) return refuse(packet, points.error().message, out);
  if (rule_ && rule_->field.empty() && !config_.stamp_is_enough) {
    counts_.ignored_bytes += packet.bytes.size();
    return tell(packet, FaultKind::NoTime,
                "the points have no times of their own: not used. stamp_is_enough: true takes header.stamp for all of "
                "them; stamp_sigma_us is then to say how far that is off, such as half a turn",
                out);
  }
  follow_stamp(packet, *cloud, out);
  counts_.decoded_bytes += packet.bytes.size();
  ++counts_.messages[type_of(config_.message)];
  if (const std::size_t empty = cloud->size() - points->size(); empty > 0) counts_.messages[kReturnless] += empty;
  out.push_back(LaserStatus{
      packet.sensor,
      packet.received,
      {},
      config_.is_utc ? SyncState::Locked : SyncState::Unlocked,
      config_.is_utc ? "header.stamp of ROS, by the rig on UTC" : "header.stamp of ROS, on the clock of the computer"});
  if (!points->empty()) give(packet, *cloud, *points, out);
}

void RosCloudDecoder::follow_stamp(const Packet& packet, const RosCloud& cloud, std::vector<Measurement>& out) {
  const UnixTime stamp = cloud.header.stamp;
  if (last_stamp_ && stamp > *last_stamp_) {
    const nanoseconds since = stamp - *last_stamp_;
    period_ = period_ ? std::min(*period_, since) : since;
  } else if (last_stamp_ && stamp < *last_stamp_) {
    tell(packet, FaultKind::Late, "header.stamp went back", out);
  }
  last_stamp_ = stamp;
}

/// A guess that was wrong by a unit shows in how long a message lasts.
void RosCloudDecoder::judge_span(const Packet& packet, nanoseconds span, std::vector<Measurement>& out) {
  if (!period_ || is_span_told_) return;
  const double periods = to_seconds(span) / to_seconds(*period_);
  if (periods >= kLeastPeriods && periods <= kMostPeriods) return;
  is_span_told_ = true;
  tell(packet, FaultKind::NoTime,
       fmt::format("its points span {:.6f} s, and the messages come every {:.6f} s: check time_field and time_unit. {}",
                   to_seconds(span), to_seconds(*period_), in_words(*rule_)),
       out);
}

void RosCloudDecoder::give(const Packet& packet, const RosCloud& cloud, const std::vector<RosPoint>& points,
                           std::vector<Measurement>& out) {
  const bool is_timed = rule_ && !rule_->field.empty();
  const nanoseconds first(points.front().offset_ns), last(points.back().offset_ns);
  if (is_timed) judge_span(packet, last - first, out);
  const RosReturns returns(cloud);
  const RosField* ring = first_of(cloud, {"ring", "channel", "line", "laser_id"});
  const RosField* intensity = intensity_of(cloud, config_.intensity_field);
  const double farthest = config_.max_range_m.value_or(std::numeric_limits<double>::infinity());
  // The last slice ends with the last point. So all are as long after their beginning when they count as received.
  const std::int64_t slices = is_timed ? (last - first) / kSlice + 1 : 1;
  const nanoseconds begin = is_timed ? last - slices * kSlice : first;
  LaserBatch batch;
  std::int64_t slice = -1;
  std::uint64_t out_of_range = 0;
  const auto end_slice = [&] {
    if (slice >= 0) out.push_back(std::exchange(batch, LaserBatch{}));
  };
  for (const RosPoint& one : points) {
    const std::int64_t at =
        is_timed ? std::clamp<std::int64_t>((nanoseconds(one.offset_ns) - begin) / kSlice, 0, slices - 1) : 0;
    if (at != slice) {
      end_slice();
      slice = at;
      batch.sensor = packet.sensor;
      batch.received = packet.received - (slices - 1 - at) * kSlice;
      batch.packet_sequence = packet.sequence;
      batch.time = laser_time(cloud.header.stamp + begin + at * kSlice);
    }
    const auto point = cloud.point(one.index);
    const auto place = *returns.place(point);
    const double range = portable::hypot(place.x, place.y, place.z);
    if (range < config_.min_range_m || range > farthest) {
      ++out_of_range;
      continue;
    }
    LaserReturn r;
    r.x = static_cast<float>(place.x);
    r.y = static_cast<float>(place.y);
    r.z = static_cast<float>(place.z);
    r.range_m = static_cast<float>(range);
    r.azimuth = static_cast<float>(azimuth_of(place.x, place.y));
    r.time_offset_ns = static_cast<std::int32_t>(one.offset_ns - (begin + at * kSlice).count());
    if (ring) r.channel = channel_of(value_of(cloud, *ring, point));
    if (intensity) {
      const double full = value_of(cloud, *intensity, point) / config_.intensity_full * 255;
      r.reflectivity = full > 0 ? static_cast<std::uint8_t>(std::lround(std::min(full, 255.0))) : 0;
    }
    batch.returns.push_back(r);
  }
  end_slice();
  if (out_of_range > 0) counts_.messages[kOutOfRange] += out_of_range;
}

}  // namespace hueline::drivers
