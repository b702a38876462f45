#include "drivers/septentrio/septentrio_decoder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <string_view>
#include <utility>
#include <vector>

#include "core/angle.hpp"
#include "core/calendar.hpp"
#include "core/geodesy.hpp"
#include "core/portable_math.hpp"
#include "drivers/septentrio/sbf_form.hpp"
#include "drivers/stream/line_form.hpp"
#include "drivers/stream/nmea_form.hpp"
#include "drivers/stream/rtcm_form.hpp"

namespace hueline::drivers {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

/// The forms of the stream, in the order in which they are asked.
enum Form : std::size_t { kSbf, kReply, kSentence, kRtcm, kLine };

std::vector<std::unique_ptr<MessageForm>> septentrio_forms() {
  std::vector<std::unique_ptr<MessageForm>> out;
  out.push_back(std::make_unique<SbfForm>());
  out.push_back(std::make_unique<SbfReplyForm>());
  out.push_back(std::make_unique<NmeaForm>());
  out.push_back(std::make_unique<RtcmForm>());
  out.push_back(std::make_unique<LineForm>());
  return out;
}

struct BlockName {
  int id;
  const char* text;
};
/// Septentrio's names of the blocks that receivers send usually, in the order of their numbers.
constexpr auto kBlockNames = std::to_array<BlockName>({{4001, "DOP"},
                                                       {4006, "PVTCartesian"},
                                                       {4007, "PVTGeodetic"},
                                                       {4012, "SatVisibility"},
                                                       {4013, "ChannelStatus"},
                                                       {4014, "ReceiverStatus"},
                                                       {4017, "GPSRawCA"},
                                                       {4018, "GPSRawL2C"},
                                                       {4019, "GPSRawL5"},
                                                       {4020, "GEORawL1"},
                                                       {4022, "GALRawFNAV"},
                                                       {4023, "GALRawINAV"},
                                                       {4026, "GLORawCA"},
                                                       {4027, "MeasEpoch"},
                                                       {4028, "BaseVectorGeod"},
                                                       {4037, "ExtEventPVTCartesian"},
                                                       {4038, "ExtEventPVTGeodetic"},
                                                       {4043, "BaseVectorCart"},
                                                       {4047, "BDSRaw"},
                                                       {4050, "ExtSensorMeas"},
                                                       {4058, "IPStatus"},
                                                       {4059, "DiskStatus"},
                                                       {4082, "QualityInd"},
                                                       {4090, "InputLink"},
                                                       {4091, "OutputLink"},
                                                       {4092, "RFStatus"},
                                                       {4097, "ExtSensorInfo"},
                                                       {4224, "IMUSetup"},
                                                       {4225, "INSNavCart"},
                                                       {4226, "INSNavGeod"},
                                                       {4229, "ExtEventINSNavCart"},
                                                       {4230, "ExtEventINSNavGeod"},
                                                       {4244, "VelSensorSetup"},
                                                       {5891, "GPSNav"},
                                                       {5894, "GPSUtc"},
                                                       {5902, "ReceiverSetup"},
                                                       {5905, "PosCovCartesian"},
                                                       {5906, "PosCovGeodetic"},
                                                       {5907, "VelCovCartesian"},
                                                       {5908, "VelCovGeodetic"},
                                                       {5911, "xPPSOffset"},
                                                       {5914, "ReceiverTime"},
                                                       {5921, "EndOfPVT"},
                                                       {5922, "EndOfMeas"},
                                                       {5924, "ExtEvent"},
                                                       {5938, "AttEuler"},
                                                       {5939, "AttCovEuler"},
                                                       {5943, "EndOfAtt"}});
static_assert(std::ranges::is_sorted(kBlockNames, {}, &BlockName::id));

std::string block_name(int id) {
  const auto found = std::ranges::lower_bound(kBlockNames, id, {}, &BlockName::id);
  return found != kBlockNames.end() && found->id == id ? found->text : fmt::format("SBF {}", id);
}

constexpr double kUnknown = -1e10;  // the receiver writes -2e10 for a number that it does not know

FixType fix_type(int mode) {
  switch (mode & 15) {
    case 1:
    case 3:  // an antenna at a known place
      return FixType::Single;
    case 2:
    case 6:
      return FixType::Dgnss;
    case 4:
    case 7:
      return FixType::RtkFixed;
    case 5:
    case 8:
      return FixType::RtkFloat;
    case 10:
      return FixType::Ppp;
    default:
      return FixType::None;
  }
}

/// Reads a place: latitude, longitude and height, or x, y and z of the Earth's frame.
Geodetic place(std::span<const std::byte> block, std::size_t at, bool is_cartesian) {
  const double a = stream_field<double>(block, at), b = stream_field<double>(block, at + 8),
               c = stream_field<double>(block, at + 16);
  if (!is_cartesian) return {a, b, c};
  constexpr double kDeepest_m = 6.3e6, kHighest_m = 6.5e6;
  const double radius = portable::hypot(a, b, c);
  // No place, as is_on_earth() says.
  if (!(radius > kDeepest_m && radius < kHighest_m)) return {0, 0, kUnknown};
  return to_geodetic({{a, b, c}});
}

/// Reads three floats and returns whether all of them are known.
bool read3(std::span<const std::byte> block, std::size_t at, std::array<double, 3>& out) {
  for (std::size_t i = 0; i < 3; ++i) {
    out[i] = static_cast<double>(stream_field<float>(block, at + 4 * i));
    if (!(out[i] > kUnknown) || !std::isfinite(out[i])) return false;
  }
  return true;
}

/// Returns the sigmas to the east, north and up of variances along x, y and z and covariances of x y, x z and y z.
std::array<double, 3> sigmas_enu(const std::array<double, 3>& variances, const std::array<double, 3>& covariances,
                                 const Geodetic& place) {
  Eigen::Matrix3d C = Eigen::Vector3d(variances[0], variances[1], variances[2]).asDiagonal();
  C(0, 1) = C(1, 0) = covariances[0];
  C(0, 2) = C(2, 0) = covariances[1];
  C(1, 2) = C(2, 1) = covariances[2];
  const Eigen::Matrix3d R = ecef_from_enu(place).rotation.toRotationMatrix();
  const Eigen::Vector3d turned = (R.transpose() * C * R).diagonal().cwiseMax(0).cwiseSqrt();
  return {turned.x(), turned.y(), turned.z()};
}

std::array<double, 3> squared(const std::array<double, 3>& v) { return {v[0] * v[0], v[1] * v[1], v[2] * v[2]}; }

}  // namespace

SeptentrioDecoder::SeptentrioDecoder(const Config&) : StreamDecoder(septentrio_forms()) {}

void SeptentrioDecoder::forget() {
  fix_.reset();
  last_fix_.reset();
  last_solution_.reset();
  seconds_.forget();
  is_fine_.reset();
}

bool SeptentrioDecoder::take(const Message& message) {
  switch (message.form) {
    case kSbf: {
      const int id = stream_field<std::uint16_t>(message.bytes, 4) & 0x1FFF;
      name(block_name(id));
      return take_block(id, message);
    }
    case kReply: {
      name("reply");
      const std::string_view text(reinterpret_cast<const char*>(message.bytes.data()), message.bytes.size());
      if (text.starts_with("$R?"))
        fault(FaultKind::Refused, message.received, 1,
              fmt::format("the receiver answered {}", text.substr(0, text.find_last_not_of("\r\n") + 1)));
      return false;
    }
    case kSentence: {
      const NmeaSentence sentence(message.bytes);
      name(std::string(sentence.talker()) + std::string(sentence.type()));
      return false;
    }
    case kRtcm:
      name(fmt::format("RTCM {}", rtcm_number(message.bytes)));
      return false;
    default:
      name("text");
      return false;
  }
}

bool SeptentrioDecoder::take_block(int id, const Message& message) {
  const Block block = message.bytes;
  const auto ms = stream_field<std::uint32_t>(block, 8);
  const auto week = stream_field<std::uint16_t>(block, 12);
  const bool has_time = ms < kSecondsPerWeek * 1000 && week != 0 && week < 10000;
  const GpsTime time = has_time ? from_gps_week(week, milliseconds(ms)) : GpsTime{};
  const HostTime received = message.received;
  const std::size_t size = block.size();
  switch (id) {
    case 4225:
    case 4226:
      if (size < (id == 4225 ? 52 : 56) || !has_time) return false;
      watch(block_name(id), time, message);
      return take_solution(block, id == 4225, time, received);
    case 4006:
    case 4007:
      if (size < 85 || !has_time) return false;
      watch(block_name(id), time, message);
      return take_fix(block, id == 4006, time, received);
    case 5905:
    case 5906:
      return size >= 28 && has_time && take_covariance(block, id == 5905, time);
    case 5914: {
      if (size < 22 || !has_time) return false;
      const auto offset = stream_field<std::int8_t>(block, 20);
      if (offset != -128) utc_offset_ = seconds(offset);
      const bool is_fine = (stream_field<std::uint8_t>(block, 21) & 7) == 7;  // week, time of week, fine time
      fault_once(!is_fine, has_no_time_, FaultKind::NoTime, received,
                 "the receiver's clock is not set, or only coarsely: no second is named and no mark is trusted");
      is_fine_ = is_fine;
      if (is_fine) label(time, received);
      return is_fine;
    }
    case 5924:
      return size >= 28 && take_mark(block, time, received);
    default:
      return false;
  }
}

void SeptentrioDecoder::label(GpsTime time, HostTime received) {
  if (auto second = seconds_.take(time, utc_offset_)) emit(*second, received);
}

/// The sub-blocks of INSNavGeod and INSNavCart follow each other as the bits of a list say, each of three floats.
bool SeptentrioDecoder::take_solution(Block block, bool is_cartesian, GpsTime time, HostTime received) {
  enum Sub : unsigned {
    kPositionSigma,
    kAttitude,
    kAttitudeSigma,
    kVelocity,
    kVelocitySigma,
    kPositionCovariance,
    kAttitudeCovariance,
    kVelocityCovariance,
    kSubs
  };
  if (last_solution_ == time) return false;
  const std::size_t list_at = is_cartesian ? 50 : 54;
  const auto list = stream_field<std::uint16_t>(block, list_at);
  const auto error = stream_field<std::uint8_t>(block, 15);
  std::array<std::array<double, 3>, kSubs> subs{};
  std::array<bool, kSubs> has{};
  std::size_t at = list_at + 2;
  for (unsigned bit = 0; bit < kSubs; ++bit) {
    if ((list >> bit & 1) == 0) continue;
    if (at + 12 > block.size()) return false;
    has[bit] = read3(block, at, subs[bit]);
    at += 12;
  }
  InsSolution solution;
  solution.time = time;
  solution.position = place(block, 20, is_cartesian);
  if (!is_on_earth(solution.position) || !has[kAttitude]) return false;
  solution.attitude = {subs[kAttitude][2] * kRadPerDeg, subs[kAttitude][1] * kRadPerDeg,
                       subs[kAttitude][0] * kRadPerDeg};
  const auto& v = subs[kVelocity];
  if (has[kVelocity]) solution.velocity_enu = {v[0], v[1], v[2]};
  if (has[kVelocity] && is_cartesian)
    solution.velocity_enu = ecef_from_enu(solution.position).rotation.conjugate() * Eigen::Vector3d(v[0], v[1], v[2]);
  solution.status = std::uint32_t{error} << 8 | stream_field<std::uint8_t>(block, 14);
  solution.is_good = error == 0 && has[kVelocity];
  if (has[kPositionSigma] && has[kAttitudeSigma] && has[kVelocitySigma]) {
    const auto& a = subs[kAttitudeSigma];  // heading, pitch, roll
    std::array<double, 3> p{subs[kPositionSigma][1], subs[kPositionSigma][0], subs[kPositionSigma][2]};
    std::array<double, 3> w = subs[kVelocitySigma];
    if (is_cartesian) {
      p = sigmas_enu(squared(subs[kPositionSigma]), subs[kPositionCovariance], solution.position);
      w = sigmas_enu(squared(subs[kVelocitySigma]), subs[kVelocityCovariance], solution.position);
    }
    solution.sigma = {{p[0], p[1], p[2], w[0], w[1], w[2], a[2] * kRadPerDeg, a[1] * kRadPerDeg, a[0] * kRadPerDeg}};
  }
  last_solution_ = time;
  if (error == 0) label(time, received);
  emit(std::move(solution), received);
  return true;
}

bool SeptentrioDecoder::take_fix(Block block, bool is_cartesian, GpsTime time, HostTime received) {
  if (last_fix_ == time) return false;
  give_fix();
  const auto u16 = [&](std::size_t at) { return stream_field<std::uint16_t>(block, at); };
  GnssFix fix;
  fix.received = received;
  fix.time = time;
  fix.position = place(block, 16, is_cartesian);
  // Without a solution the receiver's time may be anything.
  if (stream_field<std::uint8_t>(block, 15) != 0 || !is_on_earth(fix.position)) return false;
  fix.type = fix_type(stream_field<std::uint8_t>(block, 14));
  const auto satellites = stream_field<std::uint8_t>(block, 74);
  fix.satellites = satellites == 255 ? 0 : satellites;
  // Accuracies in cm: twice the distance root mean square in the plane, and twice the sigma upwards.
  const bool has_accuracy = block.size() >= 95 && u16(90) != 0xFFFF && u16(92) != 0xFFFF;
  const double plane = has_accuracy ? u16(90) * 0.01 / 2 / std::numbers::sqrt2 : 100;
  fix.sigma_enu = {{plane, plane, has_accuracy ? u16(92) * 0.01 / 2 : 100}};
  label(time, received);
  last_fix_ = time;
  fix_ = fix;
  if (!has_covariance_) give_fix();
  return true;
}

bool SeptentrioDecoder::take_covariance(Block block, bool is_cartesian, GpsTime time) {
  has_covariance_ = true;
  std::array<double, 3> variance{}, covariance{};  // north, east, up; or x, y, z
  if (!fix_ || fix_->time != time || !read3(block, 16, variance)) return false;
  const bool is_known = std::ranges::all_of(variance, [](double v) { return v >= 0; });
  if (is_known && !is_cartesian) {
    fix_->sigma_enu = {{std::sqrt(variance[1]), std::sqrt(variance[0]), std::sqrt(variance[2])}};
  } else if (is_known && block.size() >= 48) {
    // Behind those of x y and x z lies the covariance with the clock.
    for (const auto& [i, at] : {std::pair<std::size_t, std::size_t>{0, 32}, {1, 36}, {2, 44}})
      if (const double v = static_cast<double>(stream_field<float>(block, at)); v > kUnknown && std::isfinite(v))
        covariance[i] = v;
    fix_->sigma_enu = {sigmas_enu(variance, covariance, fix_->position)};
  }
  give_fix();
  return true;
}

void SeptentrioDecoder::give_fix() {
  if (const auto fix = std::exchange(fix_, {})) emit(*fix, fix->received);
}

bool SeptentrioDecoder::take_mark(Block block, GpsTime time, HostTime received) {
  if (time == GpsTime{}) {
    fault(FaultKind::NoTime, received, 1, "ExtEvent without a time: the receiver's clock is not set");
    return false;
  }
  const double offset = static_cast<double>(stream_field<float>(block, 16));
  const double bias = stream_field<double>(block, 20);
  if (!(std::abs(offset) < 1)) return false;
  EventMark mark;
  mark.input = stream_field<std::uint8_t>(block, 14);
  mark.time = time + from_seconds(offset);
  const bool has_bias = bias > kUnknown && std::abs(bias) < 1;
  if (has_bias) mark.time -= from_seconds(bias);  // from the receiver's clock to GNSS time
  mark.is_valid = has_bias && is_fine_.value_or(true);
  if (!mark.is_valid)
    fault(FaultKind::NoTime, received, 1,
          has_bias ? "ExtEvent while the receiver's clock is not fine: the mark is not trusted"
                   : "ExtEvent without a bias of the receiver's clock: it has no solution, the mark is not trusted");
  emit(mark, received);
  return true;
}

}  // namespace hueline::drivers
