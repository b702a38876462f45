#include "drivers/velodyne/velodyne_decoder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "drivers/azimuth_directions.hpp"
#include "drivers/velodyne/velodyne_angles.hpp"
#include "drivers/velodyne/velodyne_kernel.hpp"

namespace hueline::drivers {
namespace {

constexpr std::size_t kBlockBytes = 100;
/// Number of packet pairs after which their timing is believed: instead of a factory byte of another model, and against
/// a factory byte that agrees with the rig.
constexpr int kPairsFor = 3, kPairsAgainst = 20;
constexpr std::size_t kMostHeld = 16;
constexpr nanoseconds kHour = std::chrono::hours(1);

/// A copy of a packet made by the network comes at once. (An hour later the counter has the same value again.)
constexpr nanoseconds kAgainWithin = std::chrono::seconds(1);

/// Part of the second in which a label is given, microseconds, so that the latest edge is beyond doubt. Just after the
/// edge the counter may turn a few microseconds off it; late in the second the next edge may come before the packet
/// arrives.
constexpr std::uint32_t kLabelFrom_us = 5'000, kLabelTo_us = 900'000;
constexpr std::int64_t kMaxLag_s = 2;

constexpr int kCircle = kAzimuthsOfCircle;

/// The mirror's rate is measured between packets that are not farther apart, and believed up to the highest rate.
constexpr nanoseconds kTurnMeasured = std::chrono::milliseconds(5);
constexpr double kMostTurnRate = 40.0 * kCircle;

/// A packet continues the blocks before it if it lies one step of the mirror further, within this share of the step and
/// 0.01 degrees.
constexpr double kContinues = 0.4;
constexpr int kContinuesAtLeast = 5;

/// Blocks that lie deeper than this (0.01 degrees) inside the silent part mean that the field of view was changed.
/// Nearer to its edge they come from variations of the motor.
constexpr int kSilentEdge = 100;

/// Relative uncertainty of the time in the silent part: one packet gives the mirror's rate to about 0.01, and the
/// motor's rate varies.
constexpr double kSilentUncertainty = 0.02;

/// Makes the scanner's time, which it counts within the UTC hour.
LaserCounter within_hour(nanoseconds value) { return {CounterOrigin::Utc, kHour, value}; }

/// Returns the equivalent difference in [-30 min, 30 min) within the hour.
nanoseconds within_half_hour(nanoseconds d) {
  d %= kHour;
  if (d >= kHour / 2) return d - kHour;
  return d < -kHour / 2 ? d + kHour : d;
}

}  // namespace

void VelodyneDecoder::Config::visit(Keys& keys) {
  keys.choice(
      required("model", "",
               "The scanner's model. The time between its data packets has to agree with it, or there is fault "
               "WrongDevice: 1.327 ms for a VLP-16 or Puck Hi-Res, 0.553 ms for an HDL-32E, 0.664 ms for a VLP-32C, "
               "0.166 ms for a VLS-128 (Alpha Prime), half of that, of a VLS-128 a third, in dual-return mode. The "
               "factory byte may differ, because old VLP-16s send that of the HDL-32E. A Puck LITE is a VLP-16."),
      model,
      {{"VLP-16", VelodyneModel::Vlp16},
       {"HDL-32E", VelodyneModel::Hdl32e},
       {"Puck Hi-Res", VelodyneModel::PuckHiRes},
       {"VLP-32C", VelodyneModel::Vlp32c},
       {"VLS-128", VelodyneModel::Vls128}});
  keys.choice({"returns", "", "Which returns of a firing are kept if the scanner is in dual-return mode."}, returns,
              {{"all", ReturnChoice::All}, {"strongest", ReturnChoice::Strongest}, {"last", ReturnChoice::Last}});
  keys.number({"min_range_m", "m", "Nearer returns are dropped."}, min_range_m, {0, 131});
  keys.number({"max_range_m", "m", "Farther returns are dropped. It is above `min_range_m`.", "none is dropped"},
              max_range_m, {0, 300});
  keys.angle({"azimuth_begin_deg", "deg", "Azimuths are kept clockwise from here ..."}, azimuth_begin,
             {0, 360, Ends::MinOnly});
  keys.angle({"azimuth_end_deg", "deg", "... to here, through 0 if it is smaller than `azimuth_begin_deg`."},
             azimuth_end, {0, 360});
  keys.flag({"detects_lost", "",
             "Whether gaps between time stamps are reported as lost packets. The part of the circle that the scanner "
             "is set not to send is recognised by the jump of its azimuth and does not count. Set it to false if the "
             "scanner leaves out packets in another way."},
            detects_lost);
  keys.numbers({"elevations_deg", "deg",
                "Elevation of each laser, in the order of the packet: `vert_correction` of the scanner's calibration "
                "file (by `laser_id`), in degrees. Those of another model are refused: each laser has to be within 1.5 "
                "deg of the model's nominal one.",
                "the model's nominal ones"},
               elevations_deg, {-90, 90});
  keys.numbers({"azimuths_deg", "deg",
                "Azimuth of each laser against the block's, clockwise seen from above: `rot_correction` of the "
                "calibration file in degrees, with the other sign. It is given with `elevations_deg`."},
               azimuths_deg, {-180, 180});
}

KeyError VelodyneDecoder::Config::validate() const {
  if (KeyError wrong = check_keys(*this); !wrong.empty()) return wrong;
  if (max_range_m && *max_range_m <= min_range_m)
    return not_allowed("max_range_m", number_text(*max_range_m), "more than min_range_m");
  if (azimuth_begin == azimuth_end)
    return {"azimuth_end_deg", "is equal to azimuth_begin_deg, so no azimuth would be kept; allowed: another one"};
  const VelodyneTable& table = velodyne_table(model);
  const std::string allowed = fmt::format("{} numbers, one for each laser, in both lists or in none", table.count());
  if (!elevations_deg.empty() && elevations_deg.size() != table.lasers.size())
    return not_allowed("elevations_deg", fmt::format("a list of {}", elevations_deg.size()), allowed);
  if (azimuths_deg.size() != elevations_deg.size())
    return not_allowed("azimuths_deg", fmt::format("a list of {}", azimuths_deg.size()), allowed);
  if (elevations_deg.empty()) return {};
  if (const std::string wrong = why_not_of(table, BeamAngles{elevations_deg, azimuths_deg, {}}); !wrong.empty())
    return {"elevations_deg", wrong};
  return {};
}

VelodyneDecoder::VelodyneDecoder(const Config& config)
    : config_(config), table_(velodyne_table(config.model)), kernel_(std::make_unique<VelodyneKernel>(config)) {}

VelodyneDecoder::~VelodyneDecoder() = default;

void VelodyneDecoder::flush(std::vector<Measurement>& out) {
  if (!held_.empty())
    judge_held(timings_[velodyne_product(held_.front().bytes.bytes())].model(1) == config_.model, out);
  refuse_behind(out);
  while (const auto lost = gaps_.drain()) tell_lost(*lost, previous_->received, out);
}

void VelodyneDecoder::reset() {
  previous_.reset();
  arrivals_.reset();
  timings_.clear();
  for (const Packet& packet : std::exchange(held_, {})) counts_.ignored_bytes += packet.bytes.size();
  is_other_byte_ours_.reset();
  silent_part_.reset();
  if (behind_) counts_.ignored_bytes += kBlockBytes * static_cast<std::size_t>(std::exchange(behind_, {})->blocks);
  turn_rate_ = 0;
  gaps_ = GapTrial();
  last_label_.reset();
}

void VelodyneDecoder::decode(const Packet& packet, std::vector<Measurement>& out) {
  sensor_ = packet.sensor;
  while (const auto lost = gaps_.settled(packet.received)) tell_lost(*lost, packet.received, out);
  if (packet.bytes.size() == kVelodyneDataBytes) return decode_data(packet, out);
  if (packet.bytes.size() == kVelodynePositionBytes) return decode_position_packet(packet, out);
  malformed(packet, packet.bytes.size(),
            fmt::format("{}: datagram of {} bytes; data packets have {}, position packets {}", table_.name,
                        packet.bytes.size(), kVelodyneDataBytes, kVelodynePositionBytes),
            out);
}

void VelodyneDecoder::malformed(const Packet& packet, std::size_t bytes, const std::string& what,
                                std::vector<Measurement>& out) {
  counts_.malformed_bytes += bytes;
  ++counts_.malformed_messages;
  const bool begins_well = packet.bytes.size() >= 2 && packet.bytes.bytes()[0] == std::byte{0xFF} &&
                           packet.bytes.bytes()[1] == std::byte{0xEE};
  broken_ += begins_well || packet.bytes.size() == kVelodyneDataBytes ? 1 : 0;
  out.push_back(Fault{sensor_, FaultKind::Malformed, packet.received, 1, what});
}

void VelodyneDecoder::decode_data(const Packet& packet, std::vector<Measurement>& out) {
  const std::span<const std::byte> bytes = packet.bytes.bytes();
  if (is_hdl64e(bytes)) return wrong_device(packet, out);
  const auto mode = static_cast<std::uint8_t>(bytes[kVelodyneModeAt]);
  if (!is_velodyne_mode(mode))
    return malformed(
        packet, bytes.size(),
        fmt::format("{}: return mode 0x{:02X} is not supported: set the scanner to strongest, last or dual",
                    table_.name, mode),
        out);
  timings_[velodyne_product(bytes)].add(bytes);
  if (is_ours(packet, out)) use_data(packet, out);
}

/// Returns whether to decode the packet now. If not, it has been refused or is held.
bool VelodyneDecoder::is_ours(const Packet& packet, std::vector<Measurement>& out) {
  const auto product = velodyne_product(packet.bytes.bytes());
  if (product == table_.product_id) {
    const auto model = timings_[product].model(kPairsAgainst);
    if (model && velodyne_table(*model).packet_period(false) != table_.packet_period(false)) {
      wrong_device(packet, out);
      return false;
    }
    // A scanner has one factory byte: with the model's own, packets with another are another scanner's.
    if (!is_other_byte_ours_ || *is_other_byte_ours_) judge_held(false, out);
    return true;
  }
  if (!is_told_by_timing(product) || (is_other_byte_ours_ && !*is_other_byte_ours_)) {
    wrong_device(packet, out);
    return false;
  }
  if (is_other_byte_ours_) {
    ++counts_
          .messages[fmt::format("product {} taken for {} by its timing", velodyne_product_name(product), table_.name)];
    return true;
  }
  held_.push_back(packet);
  if (const auto model = timings_[product].model(kPairsFor); model || held_.size() >= kMostHeld)
    judge_held(model == config_.model, out);
  return false;
}

void VelodyneDecoder::judge_held(bool are_ours, std::vector<Measurement>& out) {
  is_other_byte_ours_ = are_ours;
  for (const Packet& packet : std::exchange(held_, {}))
    if (is_ours(packet, out)) use_data(packet, out);
}

void VelodyneDecoder::wrong_device(const Packet& packet, std::vector<Measurement>& out) {
  ++counts_.messages["data of another model"];
  counts_.ignored_bytes += packet.bytes.size();
  const auto product = velodyne_product(packet.bytes.bytes());
  const std::string name = velodyne_product_name(product);
  const auto model = timings_[product].model(kPairsFor);
  std::string what = "product " + (name.starts_with("0x") ? name : fmt::format("0x{:02X} ({})", product, name));
  if (model && *model != config_.model) what += fmt::format(", timed as a {}'s", velodyne_table(*model).name);
  if (is_hdl64e(packet.bytes.bytes())) what = "an HDL-64E, which is not supported";
  out.push_back(Fault{sensor_, FaultKind::WrongDevice, packet.received, 1,
                      fmt::format("data packet of {}; the rig names a {} (0x{:02X}): the key model", what, table_.name,
                                  table_.product_id)});
}

void VelodyneDecoder::use_data(const Packet& packet, std::vector<Measurement>& out) {
  const std::span<const std::byte> bytes = packet.bytes.bytes();
  const auto mode = static_cast<std::uint8_t>(bytes[kVelodyneModeAt]);
  std::uint32_t stamp_us = 0;
  for (std::size_t i = 0; i < 4; ++i) stamp_us |= static_cast<std::uint32_t>(bytes[kVelodyneStampAt + i]) << (8 * i);
  // A scanner that learns of the new hour late, or never, counts on beyond its end.
  nanoseconds first_firing = std::chrono::microseconds(stamp_us) % kHour;

  if (previous_ && previous_->stamp == first_firing && packet.received - previous_->received < kAgainWithin &&
      std::equal(bytes.begin(), bytes.end(), newest_bytes_.begin())) {
    ++counts_.messages["data again"];
    counts_.ignored_bytes += bytes.size();
    out.push_back(Fault{sensor_, FaultKind::Spurious, packet.received, 1,
                        fmt::format("{}: the same packet came again", table_.name)});
    return;
  }
  std::copy(bytes.begin(), bytes.end(), newest_bytes_.begin());

  const bool is_dual = mode == kVelodyneDual;
  const nanoseconds duration = table_.packet_period(is_dual);
  first_firing += table_.first_firing;
  if (config_.stamp == PacketStamp::LastFiring)
    first_firing -= duration - table_.sequence_period + table_.firing_time(table_.count() - 1);
  if (first_firing < nanoseconds(0)) first_firing += kHour;
  if (duration == table_.block_period()) learn_turn_rate(bytes, first_firing);

  LaserBatch batch;
  batch.sensor = sensor_;
  batch.received = packet.received;
  batch.packet_sequence = packet.sequence;
  batch.time = within_hour(first_firing);
  date_behind(bytes, first_firing, out);
  const VelodyneBlocks blocks = kernel_->decode(bytes, is_dual, turn_rate_, batch.returns);
  const std::size_t bad_bytes = kBlockBytes * static_cast<std::size_t>(blocks.malformed + blocks.untimed);
  if (blocks.malformed > 0)
    malformed(packet, blocks.decoded ? bad_bytes : bytes.size(),
              fmt::format("{}: {} of {} blocks have a wrong flag, azimuth or partner", table_.name, blocks.malformed,
                          kVelodyneBlocks),
              out);
  else
    counts_.malformed_bytes += bad_bytes;
  if (blocks.decoded == 0) return;

  check_gap(packet, first_firing, duration, blocks, out);
  if (blocks.behind > 0) hold_behind(packet, blocks);
  if (blocks.untimed > 0) {
    out.push_back(Fault{
        sensor_, FaultKind::NoTime, packet.received, static_cast<std::uint64_t>(blocks.untimed),
        fmt::format("{}: the azimuth jumps twice inside a packet; the blocks behind have no known time", table_.name)});
  }
  counts_.decoded_bytes += bytes.size() - bad_bytes - kBlockBytes * static_cast<std::size_t>(blocks.behind);
  data_.add(counts_, is_dual ? "data dual" : mode == kVelodyneLast ? "data last" : "data strongest");
  out.push_back(std::move(batch));
}

void VelodyneDecoder::hold_behind(const Packet& packet, const VelodyneBlocks& blocks) {
  Behind& behind = behind_.emplace();
  behind.batch.sensor = sensor_;
  behind.batch.received = packet.received;
  behind.batch.packet_sequence = packet.sequence;
  behind.batch.returns = kernel_->behind();
  behind.duration = blocks.behind_duration;
  behind.blocks = blocks.behind;
  behind.begin_azimuth = blocks.last_azimuth;
  behind.last_azimuth = blocks.behind_azimuth;
  behind.jump_azimuth = blocks.jump_azimuth;
  behind.turn_rate = blocks.turn_rate > 0 ? blocks.turn_rate : turn_rate_;
}

/// Dates what is held by the packet that follows it, if that packet's azimuth goes on where the held blocks end.
void VelodyneDecoder::date_behind(std::span<const std::byte> next, nanoseconds first_firing,
                                  std::vector<Measurement>& out) {
  if (!behind_) return;
  const double turn = behind_->turn_rate * to_seconds(table_.block_period());
  const int azimuth = static_cast<int>(next[2]) | static_cast<int>(next[3]) << 8;
  const int turned = (azimuth - behind_->last_azimuth + kCircle) % kCircle;
  if (!(turn > 0) || std::abs(turned - turn) > kContinues * turn + kContinuesAtLeast) return refuse_behind(out);
  nanoseconds time = first_firing - behind_->duration;
  if (time < nanoseconds(0)) time += kHour;
  behind_->batch.time = within_hour(time);
  counts_.decoded_bytes += kBlockBytes * static_cast<std::size_t>(behind_->blocks);
  out.push_back(std::move(behind_->batch));
  behind_.reset();
}

void VelodyneDecoder::refuse_behind(std::vector<Measurement>& out) {
  if (!behind_) return;
  counts_.malformed_bytes += kBlockBytes * static_cast<std::size_t>(behind_->blocks);
  out.push_back(Fault{
      sensor_, FaultKind::NoTime, behind_->batch.received, static_cast<std::uint64_t>(behind_->blocks),
      fmt::format("{}: the azimuth jumps from {:.2f} to {:.2f} deg inside a packet, and no packet follows that would "
                  "date the blocks behind",
                  table_.name, behind_->begin_azimuth / 100.0, behind_->jump_azimuth / 100.0)});
  behind_.reset();
}

/// Measures the mirror's rate between packets, for packets of one azimuth.
void VelodyneDecoder::learn_turn_rate(std::span<const std::byte> bytes, nanoseconds stamp) {
  if (!previous_) return;
  const nanoseconds passed = within_half_hour(stamp - previous_->stamp);
  if (passed <= nanoseconds(0) || passed > kTurnMeasured) return;
  const int azimuth = static_cast<int>(bytes[2]) | static_cast<int>(bytes[3]) << 8;
  const double rate = (azimuth - previous_->azimuth + kCircle) % kCircle / to_seconds(passed);
  if (rate < kMostTurnRate) turn_rate_ = rate;
}

void VelodyneDecoder::learn_silent_part(const VelodyneBlocks& blocks) {
  if (silent_part_)
    for (const int azimuth : {blocks.first_azimuth, blocks.last_azimuth}) {
      const int inside = (azimuth - silent_part_->begin + kCircle) % kCircle;
      if (inside > kSilentEdge && inside < silent_part_->width - kSilentEdge) silent_part_.reset();
      if (!silent_part_) break;
    }
  if (blocks.behind == 0) return;
  silent_part_ = SilentPart{blocks.last_azimuth, (blocks.jump_azimuth - blocks.last_azimuth + kCircle) % kCircle};
}

/// Returns which part of the time since the packet `from` passed while the mirror turned through the silent part.
nanoseconds VelodyneDecoder::silent_time(const Previous& from, nanoseconds moved) const {
  if (!silent_part_ || !(from.turn_rate > 0)) return nanoseconds(0);
  // A packet that begins just after the silent part has passed it already; `until` is then nearly a whole circle.
  const int until = (silent_part_->begin + kSilentEdge - from.azimuth + kCircle) % kCircle;
  const double turned = from.turn_rate * to_seconds(moved);
  if (turned < until) return nanoseconds(0);
  const double passes = 1 + std::floor((turned - until) / kCircle);
  return std::min(moved, from_seconds(passes * silent_part_->width / from.turn_rate));
}

void VelodyneDecoder::check_gap(const Packet& packet, nanoseconds stamp, nanoseconds duration,
                                const VelodyneBlocks& blocks, std::vector<Measurement>& out) {
  const std::optional<Previous> before =
      std::exchange(previous_, Previous{stamp, duration, packet.received, nanoseconds(0), blocks.first_azimuth,
                                        blocks.turn_rate > 0 ? blocks.turn_rate : turn_rate_});
  if (!before) return learn_silent_part(blocks);
  const std::uint64_t broken = std::exchange(broken_, 0);
  const nanoseconds waited = packet.received - before->received;
  const nanoseconds difference = within_half_hour(stamp - before->stamp - waited % kHour);
  const nanoseconds moved = waited + difference;  // correct after outages of hours too
  const auto fault = [&](FaultKind kind, std::string detail) {
    out.push_back(Fault{sensor_, kind, packet.received, 1, std::move(detail)});
  };
  previous_->travelled = before->travelled + moved;
  const auto found = arrivals_.add(moved, waited);
  if (found) fault(found->kind, fmt::format("{}: {}", table_.name, found->words("its counter")));
  if (found && found->kind == FaultKind::ClockStep) {
    learn_silent_part(blocks);
    return;
  }
  if (moved < nanoseconds(0)) {
    fault(FaultKind::Late,
          fmt::format("{}: a packet {:.6f} s older than the one before", table_.name, -to_seconds(moved)));
    gaps_.fill(previous_->travelled.count());
    previous_ = before;  // the newest packet stays the reference for the next gap
    broken_ = broken;
  } else if (config_.detects_lost && moved > before->duration * 3 / 2) {
    const nanoseconds silent = silent_time(*before, moved);
    const nanoseconds sending = moved - silent;
    if (to_seconds(sending) > 1.5 * to_seconds(before->duration) + kSilentUncertainty * to_seconds(silent)) {
      const auto missing =
          static_cast<std::uint64_t>(std::llround(to_seconds(sending) / to_seconds(before->duration)) - 1);
      gaps_.open(before->travelled.count(), previous_->travelled.count(), missing - std::min(missing, broken),
                 packet.received);
    }
  }
  learn_silent_part(blocks);
}

void VelodyneDecoder::tell_lost(const GapTrial::Lost& lost, HostTime time, std::vector<Measurement>& out) const {
  out.push_back(Fault{sensor_, FaultKind::Lost, time, lost.missing,
                      fmt::format("{}: no data packets for {:.6f} s of its counter", table_.name,
                                  to_seconds(nanoseconds(lost.width)))});
}

void VelodyneDecoder::decode_position_packet(const Packet& packet, std::vector<Measurement>& out) {
  const Result<VelodynePosition> position = decode_position(packet.bytes.bytes());
  if (!position) return malformed(packet, packet.bytes.size(), position.error().message, out);
  const Result<RmcSentence> rmc =
      position->nmea.empty() ? Result<RmcSentence>(Error{ErrorCode::Unsupported, {}}) : decode_rmc(position->nmea);
  LaserStatus status;
  status.sensor = sensor_;
  status.received = packet.received;
  status.time = within_hour(std::chrono::microseconds(position->hour_us));
  status.clock = position->pps.clock;
  status.words = position->pps.words + (position->nmea.empty()       ? ", no NMEA sentence"
                                        : rmc.ok() && rmc->is_active ? ", RMC valid"
                                                                     : ", RMC not valid");
  out.push_back(std::move(status));
  if (rmc.ok()) {
    label(packet, *position, *rmc, out);
  } else if (rmc.error().code != ErrorCode::Unsupported) {
    // The packet itself is sound, so only its sentence counts as malformed.
    counts_.decoded_bytes += packet.bytes.size() - position->nmea.size();
    return malformed(packet, position->nmea.size(), fmt::format("{}: {}", table_.name, rmc.error().message), out);
  }
  counts_.decoded_bytes += packet.bytes.size();
  ++counts_.messages["position"];
}

void VelodyneDecoder::label(const Packet& packet, const VelodynePosition& position, const RmcSentence& rmc,
                            std::vector<Measurement>& out) {
  const std::uint32_t in_second_us = position.hour_us % 1'000'000;
  if (in_second_us < kLabelFrom_us || in_second_us > kLabelTo_us) return;
  const std::optional<PositionSecond> edge = second_of_latest_edge(rmc.utc, position.hour_us);
  if (!edge) return;
  const bool agrees = edge->lag >= 0 && edge->lag <= kMaxLag_s;
  TimeLabel label;
  label.sensor = sensor_;
  label.received = packet.received;
  label.second = edge->second;
  label.names_hour = agrees && rmc.is_active;
  label.is_valid = label.names_hour && position.pps.clock == SyncState::Locked;
  if (last_label_ && last_label_->second == label.second && last_label_->is_valid == label.is_valid) return;
  last_label_ = label;
  if (!agrees) {
    out.push_back(
        Fault{sensor_, FaultKind::LabelConflict, packet.received, 1,
              fmt::format("{}: its counter is {} s ahead of the RMC sentence that it echoes", table_.name, edge->lag)});
  }
  out.push_back(label);
}

}  // namespace hueline::drivers
