#include "drivers/robosense/robosense_decoder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string_view>
#include <utility>

#include "core/calendar.hpp"
#include "drivers/azimuth_directions.hpp"
#include "drivers/label_limit.hpp"

namespace hueline::drivers {
namespace {

using std::chrono::seconds;

constexpr double kTurn = 2 * std::numbers::pi;
/// A gap of the stamps up to this long is told in packets.
constexpr nanoseconds kLongestGap = seconds(10);
/// Period of the scanner's own counter: 100 years.
constexpr nanoseconds kLongest = std::chrono::hours(876'000);
/// A larger step between two blocks is the part of the revolution that is not sent.
constexpr double kLargestStep = 1.0 / 180 * std::numbers::pi;
constexpr std::size_t kHeadBytes = 42, kBlockBytes = 100;

bool has_flag(std::span<const std::byte> bytes, std::size_t block) {
  return robosense_u16(bytes, kHeadBytes + block * kBlockBytes) == 0xFFEE;
}

double in_turn(double angle) {
  const double out = std::abs(angle) < kTurn ? angle : std::fmod(angle, kTurn);
  return out < 0 ? out + kTurn : out;
}

}  // namespace

void RobosenseDecoder::Config::visit(Keys& keys) {
  keys.choice({"clock", "",
               "What the scanner's clock follows. `told`: what its description says; of PTP that does not say the time "
               "scale, so whole seconds come from the POS. `ptp_utc` and `ptp_tai` state it; then packets are not used "
               "while the scanner does not follow PTP."},
              reference, {{"told", Reference::Told}, {"ptp_utc", Reference::PtpUtc}, {"ptp_tai", Reference::PtpTai}});
  keys.number({"range_unit_m", "m",
               "What one unit of the ranges in the packets is. Old firmware of the RS-LiDAR-16 and -32 counts in 0.01 "
               "m, and the packets do not say it.",
               "0.005, of Helios and Bpearl 4 0.0025"},
              range_unit_m, {0.001, 0.02});
  keys.number({"min_range_m", "m", "Nearer returns are dropped."}, min_range_m, {0, 100});
  keys.number({"max_range_m", "m", "Farther returns are dropped. It is above `min_range_m`.", "none is dropped"},
              max_range_m, {0, 700});
  keys.numbers({"elevations_deg", "deg",
                "Elevation of each beam, in the order of the channels, in place of those of the scanner's description.",
                "the description's"},
               elevations_deg, {-90, 90});
  keys.numbers({"azimuths_deg", "deg", "Azimuth of each beam against the block's. It is given with `elevations_deg`."},
               azimuths_deg, {-180, 180});
}

KeyError RobosenseDecoder::Config::validate() const {
  if (KeyError wrong = check_keys(*this); !wrong.empty()) return wrong;
  if (max_range_m && *max_range_m <= min_range_m)
    return not_allowed("max_range_m", number_text(*max_range_m), "more than min_range_m");
  if (!elevations_deg.empty() && elevations_deg.size() != 16 && elevations_deg.size() != 32)
    return not_allowed("elevations_deg", fmt::format("a list of {}", elevations_deg.size()), "16 or 32 numbers");
  if (azimuths_deg.size() != elevations_deg.size())
    return not_allowed("azimuths_deg", fmt::format("a list of {}", azimuths_deg.size()),
                       "as many numbers as elevations_deg has");
  return {};
}

void RobosenseDecoder::reset() {
  sequence_.reset();
  previous_.reset();
  arrivals_.reset();
  told_second_.reset();
  told_state_.reset();
}

void RobosenseDecoder::tell(const Packet& packet, FaultKind kind, std::uint64_t count, std::string what,
                            std::vector<Measurement>& out) const {
  const char* name = table_ ? table_->name : solid_ ? solid_ : "RoboSense";
  out.push_back(Fault{sensor_, kind, packet.received, count, std::string(name) + ": " + what});
}

void RobosenseDecoder::refuse(const Packet& packet, FaultKind kind, const std::string& what,
                              std::vector<Measurement>& out) {
  if (kind == FaultKind::Malformed) {
    counts_.malformed_bytes += packet.bytes.size();
    ++counts_.malformed_messages;
  } else {
    counts_.ignored_bytes += packet.bytes.size();
  }
  tell(packet, kind, 1, what, out);
}

void RobosenseDecoder::decode(const Packet& packet, std::vector<Measurement>& out) {
  sensor_ = packet.sensor;
  const auto bytes = packet.bytes.bytes();
  if (const auto solid = decode_robosense_solid(bytes)) return decode_solid(packet, *solid, out);
  if (is_robosense_description(bytes)) return decode_description(packet, out);
  if (!is_robosense_points(bytes))
    return refuse(packet, FaultKind::Malformed,
                  fmt::format("datagram of {} bytes that is no packet of it", bytes.size()), out);
  if (!is_known(packet, out)) return;
  const auto stamp = decode_robosense_time(bytes, table_->model);
  if (!stamp) return refuse(packet, FaultKind::Malformed, "a time that cannot be", out);
  const auto time = time_of(*stamp);
  if (!time) return refuse(packet, FaultKind::NoTime, "it does not follow PTP, though the rig says so: not used", out);
  if (!follow(packet, *stamp, out)) return;
  tell_clock(packet, *stamp, *time, out);

  LaserBatch batch;
  batch.sensor = sensor_;
  batch.received = packet.received;
  batch.packet_sequence = packet.sequence;
  batch.time = *time;
  const std::size_t bad_bytes = decode_points(bytes, batch.returns) * kBlockBytes;
  if (bad_bytes > 0) {
    counts_.malformed_bytes += bad_bytes;
    ++counts_.malformed_messages;
    tell(packet, FaultKind::Malformed, 1,
         fmt::format("{} of {} blocks have a wrong flag or azimuth", bad_bytes / kBlockBytes, kRobosenseBlocks), out);
  }
  counts_.decoded_bytes += bytes.size() - bad_bytes;
  points_.add(counts_, is_dual(bytes) ? "points dual" : "points");
  out.push_back(std::move(batch));
}

void RobosenseDecoder::decode_solid(const Packet& packet, const RobosenseSolidPacket& data,
                                    std::vector<Measurement>& out) {
  if (table_ || heard_ || (solid_ && std::string_view(solid_) != data.name))
    return refuse(packet, FaultKind::WrongDevice, "points of another model than before: two scanners at one port?",
                  out);
  solid_ = data.name;
  const RobosenseDescription::Clock clock =
      data.follows_ptp ? RobosenseDescription::Clock::Ptp : RobosenseDescription::Clock::Free;
  if (previous_ && clock != description_.clock) {
    previous_.reset();
    arrivals_.reset();
    told_state_.reset();
    tell(packet, FaultKind::ClockStep, 1, "it follows another clock from now on, or none", out);
  }
  description_.clock = clock;
  if (!data.time) return refuse(packet, FaultKind::Malformed, "a time that cannot be", out);
  const auto time = time_of(*data.time);
  if (!time) return refuse(packet, FaultKind::NoTime, "it does not follow PTP, though the rig says so: not used", out);
  if (!follow(packet, *data.time, out)) return;
  // Numbers begin again with each frame, whose length is not known.
  if (sequence_ && data.sequence > *sequence_ + 1) {
    const unsigned missing = data.sequence - *sequence_ - 1u;
    tell(packet, FaultKind::Lost, missing, fmt::format("{} packets missing", missing), out);
  }
  sequence_ = data.sequence;
  tell_clock(packet, *data.time, *time, out);
  LaserBatch batch;
  batch.sensor = sensor_;
  batch.received = packet.received;
  batch.packet_sequence = packet.sequence;
  batch.time = *time;
  decode_robosense_solid_points(packet.bytes.bytes(), data, config_.min_range_m, config_.max_range_m.value_or(1e9),
                                batch.returns);
  counts_.decoded_bytes += packet.bytes.size();
  points_.add(counts_, data.is_dual ? "points dual" : "points");
  out.push_back(std::move(batch));
}

void RobosenseDecoder::decode_description(const Packet& packet, std::vector<Measurement>& out) {
  const auto bytes = packet.bytes.bytes();
  const RobosenseDescription::Clock before = description_.clock;
  description_bytes_.assign(bytes.begin(), bytes.end());
  const bool was_known = table_ != nullptr;
  if (heard_ && !use_description(*heard_))
    return refuse(packet, FaultKind::Implausible, "its description has no angles of the beams: not used", out);
  counts_.decoded_bytes += bytes.size();
  ++counts_.messages["description"];
  if (!was_known || description_.clock == before) return;
  previous_.reset();
  arrivals_.reset();
  told_state_.reset();
  tell(packet, FaultKind::ClockStep, 1, "it follows another clock from now on, or none", out);
}

/// Reads the newest description as that of a scanner of this model. Keeps the one before if this one has no angles.
bool RobosenseDecoder::use_description(RobosenseModel model) {
  auto read = decode_robosense_description(description_bytes_, model);
  if (read) description_ = std::move(*read);
  if (!use_given_angles(model) && !read) return false;
  table_ = &robosense_table(model);
  kernel_.emplace(*table_, description_, config_.range_unit_m.value_or(table_->range_unit_m), config_.min_range_m,
                  config_.max_range_m.value_or(1e9));
  return true;
}

/// Takes the angles of the Config, if it has those of a scanner of this model.
bool RobosenseDecoder::use_given_angles(RobosenseModel& model) {
  if (config_.elevations_deg.empty()) return false;
  if (model == RobosenseModel::Helios && config_.elevations_deg.size() == 16) model = RobosenseModel::Helios16;
  if (config_.elevations_deg.size() != static_cast<std::size_t>(robosense_table(model).beams)) return false;
  const auto radians = [](const std::vector<double>& deg) {
    std::vector<double> out;
    for (const double one : deg) out.push_back(one / 180 * std::numbers::pi);
    return out;
  };
  description_.elevations = radians(config_.elevations_deg);
  description_.azimuths = radians(config_.azimuths_deg);
  return true;
}

/// Returns whether the packet of points can be decoded: its model and its angles are known.
bool RobosenseDecoder::is_known(const Packet& packet, std::vector<Measurement>& out) {
  const auto model = robosense_model(packet.bytes.bytes());
  if (!model) {
    refuse(packet, FaultKind::WrongDevice, "points of a model that is not known", out);
    return false;
  }
  if (heard_ && *heard_ != *model) {
    refuse(packet, FaultKind::WrongDevice, "points of another model than before: two scanners at one port?", out);
    return false;
  }
  if (table_) return true;
  heard_ = *model;
  if (use_description(*model)) return true;
  counts_.ignored_bytes += packet.bytes.size();
  ++counts_.messages["points before the description"];
  if (!std::exchange(is_waiting_told_, true))
    tell(
        packet, FaultKind::Implausible, 1,
        "points before the scanner's description, which has the angles of its beams: not used. It comes once a second, "
        "usually to port 7788: read that port too",
        out);
  return false;
}

/// Returns the time of the first firing; nothing if the rig says that it is a date, and it is none.
std::optional<LaserTime> RobosenseDecoder::time_of(UnixTime stamp) const {
  const nanoseconds since_1970 = stamp.time_since_epoch();
  switch (config_.reference) {
    case Reference::Told:
      break;
    case Reference::PtpUtc:
      if (description_.clock != RobosenseDescription::Clock::Ptp) return {};
      return stamp;
    case Reference::PtpTai:
      if (description_.clock != RobosenseDescription::Clock::Ptp) return {};
      return unix_of_tai(since_1970);
  }
  if (description_.clock == RobosenseDescription::Clock::Receiver) return stamp;
  // The date of a scanner that follows nothing is whatever it was switched on with.
  return LaserCounter{CounterOrigin::Own, kLongest, since_1970};
}

/// Returns whether the packet has both returns of its firings. Without a description 32 beams tell it by their blocks,
/// of which two have the same azimuth.
bool RobosenseDecoder::is_dual(std::span<const std::byte> bytes) const {
  if (!description_bytes_.empty()) return description_.is_dual;
  constexpr std::size_t kAzimuthAt = kHeadBytes + 2;
  return table_->beams == 32 && robosense_u16(bytes, kAzimuthAt) == robosense_u16(bytes, kAzimuthAt + kBlockBytes) &&
         robosense_u16(bytes, kAzimuthAt) != robosense_u16(bytes, kAzimuthAt + 2 * kBlockBytes);
}

double RobosenseDecoder::packet_us(std::span<const std::byte> bytes) const {
  const bool is_twice = table_->beams == 16;  // two firings in a block, or two returns of one
  const double firings = (is_twice ? 2.0 : 1.0) * (is_dual(bytes) ? 0.5 : 1.0) * kRobosenseBlocks;
  return firings * table_->firing_period_us;
}

/// Compares the packet with the one before. Returns whether to use it.
bool RobosenseDecoder::follow(const Packet& packet, UnixTime stamp, std::vector<Measurement>& out) {
  if (!previous_) {
    previous_ = Previous{stamp, packet.received};
    return true;
  }
  const nanoseconds since = stamp - previous_->time;
  if (since == nanoseconds(0)) {
    ++counts_.messages["points again"];
    refuse(packet, FaultKind::Spurious, "a packet with the same time came again", out);
    return false;
  }
  if (const auto found = arrivals_.add(since, packet.received - previous_->received)) {
    tell(packet, found->kind, 1, found->words("its clock"), out);
    if (found->kind == FaultKind::ClockStep) {
      previous_ = Previous{stamp, packet.received};
      return true;
    }
  }
  if (since < nanoseconds(0)) {
    tell(packet, FaultKind::Late, 1, "a packet came after newer ones", out);
    return true;
  }
  previous_ = Previous{stamp, packet.received};
  if (table_) tell_gap(packet, since, out);
  return true;
}

/// Tells packets that are missing by the stamps.
void RobosenseDecoder::tell_gap(const Packet& packet, nanoseconds since, std::vector<Measurement>& out) {
  const double span_us = packet_us(packet.bytes.bytes()), packets = static_cast<double>(since.count()) * 1e-3 / span_us;
  const double blind = description_.blind_rad / kTurn / description_.revolutions_hz * 1e6 / span_us;
  if (packets > 1.5 + blind && since < kLongestGap) {
    const auto missing = static_cast<std::uint64_t>(std::max(1LL, std::llround(packets - blind) - 1));
    tell(packet, FaultKind::Lost, missing, fmt::format("{} packets missing", missing), out);
  }
}

/// Says once a second what the stamps are worth, and which second it is.
void RobosenseDecoder::tell_clock(const Packet& packet, UnixTime stamp, const LaserTime& time,
                                  std::vector<Measurement>& out) {
  const SyncState state =
      description_.clock == RobosenseDescription::Clock::Free ? SyncState::Unlocked : SyncState::Locked;
  const std::int64_t second = std::chrono::floor<seconds>(stamp).time_since_epoch().count();
  if (told_second_ == second && told_state_ == state) return;
  told_second_ = second;
  told_state_ = state;
  const auto* utc = std::get_if<UnixTime>(&time);
  const char* words = description_.clock == RobosenseDescription::Clock::Receiver ? "time of a receiver"
                      : description_.clock == RobosenseDescription::Clock::Free   ? "follows no reference"
                      : utc                                                       ? "PTP, time scale as the rig says"
                            : "PTP; whether it counts TAI or UTC is the master's choice";
  out.push_back(LaserStatus{sensor_, packet.received, time, state, words});
  if (!utc || *utc - std::chrono::floor<seconds>(*utc) > kLabelTo) return;
  TimeLabel label;
  label.sensor = sensor_;
  label.received = packet.received;
  label.second = from_unix(std::chrono::floor<seconds>(*utc));
  label.is_valid = state == SyncState::Locked;
  out.push_back(label);
}

/// Returns azimuth, step and time of each block. A block without its flag or azimuth has those of the block before.
std::array<RobosenseBlock, kRobosenseBlocks> RobosenseDecoder::blocks_of(std::span<const std::byte> bytes) const {
  const bool is_twice = table_->beams == 16, has_both = is_dual(bytes);
  const std::size_t together = has_both && !is_twice ? 2 : 1;  // blocks of one firing
  const double firings = is_twice && !has_both ? 2 : 1;        // in a block
  const double nominal = kTurn * description_.revolutions_hz * table_->firing_period_us * 1e-6;
  const auto& directions = azimuth_directions();
  std::array<RobosenseBlock, kRobosenseBlocks> out;
  std::array<double, kRobosenseBlocks> azimuths;
  for (std::size_t block = 0; block < kRobosenseBlocks; ++block) {
    const unsigned hundredths = robosense_u16(bytes, kHeadBytes + block * kBlockBytes + 2);
    azimuths[block] = hundredths * 0.01 / 180 * std::numbers::pi;
    out[block].direction = directions[hundredths % kAzimuthsOfCircle];
  }
  double time_us = 0, last_step = nominal * firings;
  bool has_gap = false;
  for (std::size_t block = 0; block < kRobosenseBlocks; block += together) {
    double step = last_step, period_us = table_->firing_period_us * firings;
    if (block + together < kRobosenseBlocks) {
      const double turned = in_turn(azimuths[block + together] - azimuths[block]);
      if (turned <= kLargestStep) {
        step = last_step = turned;
      } else if (!std::exchange(has_gap, true)) {  // the window ended, and began again: once in a packet at most
        period_us = turned / (kTurn * description_.revolutions_hz) * 1e6;
      }
    }
    for (std::size_t i = block; i < block + together; ++i) {
      out[i].azimuth = azimuths[block];
      out[i].step = step / firings;
      out[i].time_us = time_us;
    }
    time_us += period_us;
  }
  return out;
}

/// Replaces the returns by those of the packet. Returns the number of blocks that cannot be used.
std::size_t RobosenseDecoder::decode_points(std::span<const std::byte> bytes, std::vector<LaserReturn>& out) {
  const auto blocks = blocks_of(bytes);
  const bool is_twice = table_->beams == 16, has_both = is_dual(bytes);
  const std::size_t together = has_both && !is_twice ? 2 : 1;
  const auto is_usable = [&](std::size_t block) {
    return has_flag(bytes, block) && robosense_u16(bytes, kHeadBytes + block * kBlockBytes + 2) < kAzimuthsOfCircle;
  };
  std::array<RobosenseKernel::Firings, kRobosenseBlocks> firings;
  std::size_t bad = 0, count = 0;
  for (std::size_t block = 0; block < kRobosenseBlocks; block += together) {
    bool is_good = true;
    for (std::size_t i = block; i < block + together; ++i)
      if (!is_usable(i)) {
        is_good = false;
        ++bad;
      }
    if (!is_good) continue;
    // Both returns of a firing are in two blocks or, of 16 beams, in one.
    const std::byte* units = bytes.data() + kHeadBytes + block * kBlockBytes + 4;
    const std::byte* second = !has_both ? nullptr : units + (is_twice ? 16 * 3 : kBlockBytes);
    firings[count++] = {blocks[block], units, second, has_both && is_twice ? 16 : kRobosenseChannels};
  }
  kernel_->decode({firings.data(), count}, out);
  return bad;
}

}  // namespace hueline::drivers
