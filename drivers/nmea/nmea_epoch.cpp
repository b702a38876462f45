#include "drivers/nmea/nmea_epoch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/angle.hpp"
#include "core/calendar.hpp"
#include "core/portable_math.hpp"

namespace hueline::drivers {
namespace {

using std::chrono::hours;
using std::chrono::milliseconds;
using std::chrono::seconds;

/// The sentences that make an epoch, as bits of Epoch::seen.
/// kGga is the receiver's own solution, of the talker GN; kSystemGga that of another talker.
enum Part : unsigned { kGga = 1, kGns = 2, kRmc = 4, kZda = 8, kGst = 16, kVtg = 32, kPashr = 64, kSystemGga = 128 };
constexpr unsigned kAnyGga = kGga | kSystemGga;

constexpr double kMetresPerSecondPerKnot = 1852.0 / 3600;
/// GPS began in January 1980, and years have two digits: the smaller ones are of the next century.
constexpr int kFirstYear = 80;
/// Receivers send positions of several kinds at several rates: so many without a GGA or GNS say that none will come.
constexpr int kManyLonePositions = 20;
constexpr double kUnknownHeightSigma = 100;  // m, of a height above the geoid whose geoid is not named

std::optional<int> two_digits(std::string_view text, std::size_t at) {
  if (text.size() < at + 2) return {};
  const char a = text[at], b = text[at + 1];
  if (a < '0' || a > '9' || b < '0' || b > '9') return {};
  return (a - '0') * 10 + (b - '0');
}

/// Returns the year that two digits mean; a year of four digits is itself.
int full_year(int year) { return year >= 100 ? year : year < kFirstYear ? 2000 + year : 1900 + year; }

/// Returns the time since midnight of "hhmmss.sss", with any number of decimals up to nanoseconds. A leap second is 60.
std::optional<nanoseconds> time_of_day(std::string_view text) {
  const auto hour = two_digits(text, 0), minute = two_digits(text, 2), second = two_digits(text, 4);
  if (!hour || !minute || !second || *hour > 23 || *minute > 59 || *second > 60) return {};
  nanoseconds out = hours(*hour) + std::chrono::minutes(*minute) + seconds(*second);
  if (text.size() == 6) return out;
  if (text[6] != '.') return {};
  std::int64_t unit = 100'000'000;
  for (const char c : text.substr(7)) {
    if (c < '0' || c > '9') return {};
    out += nanoseconds((c - '0') * unit);
    unit /= 10;
  }
  return out;
}

/// Returns the angle of "ddmm.mmmm" or "dddmm.mmmm" and its hemisphere in rad.
std::optional<double> angle(const NmeaSentence& s, std::size_t at, char positive, char negative, double most_deg) {
  const std::optional<double> value = s.number(at);
  const std::string_view side = s.field(at + 1);
  if (!value || *value < 0 || side.size() != 1 || (side[0] != positive && side[0] != negative)) return {};
  const double degrees = std::floor(*value / 100), minutes = *value - 100 * degrees;
  const double out = degrees + minutes / 60;
  if (minutes >= 60 || out > most_deg) return {};
  return (side[0] == positive ? out : -out) * kRadPerDeg;
}

std::optional<Geodetic> place(const NmeaSentence& s, std::size_t at) {
  const auto latitude = angle(s, at, 'N', 'S', 90), longitude = angle(s, at + 2, 'E', 'W', 180);
  if (!latitude || !longitude) return {};
  return Geodetic{*latitude, *longitude, 0};
}

FixType fix_type(int quality) {
  switch (quality) {
    case 1:
    case 3:
      return FixType::Single;
    case 2:
    case 9:  // some makers: corrections of a satellite
      return FixType::Dgnss;
    case 4:
      return FixType::RtkFixed;
    case 5:
      return FixType::RtkFloat;
    default:
      return FixType::None;  // 0 none, 6 dead reckoning, 7 put in by hand, 8 simulated
  }
}

/// Returns the error of a position per unit of its dilution of precision, m. The sentences without GST say no more.
double range_error(FixType type) {
  switch (type) {
    case FixType::RtkFixed:
      return 0.02;
    case FixType::RtkFloat:
      return 0.3;
    case FixType::Dgnss:
    case FixType::Ppp:
      return 1.5;
    default:
      return 5;
  }
}

/// Returns the order of GGA's qualities: fixed ambiguities are the best.
int rank_of_quality(int quality) { return quality == 4 ? 9 : quality == 5 ? 8 : quality; }

/// Returns the quality of GGA for the mode indicators of GNS, one letter a constellation.
int quality_of(std::string_view modes) {
  int best = 0;
  for (const char mode : modes) {
    const int quality = mode == 'A' || mode == 'P' ? 1 : mode == 'D' ? 2 : mode == 'R' ? 4 : mode == 'F' ? 5 : 0;
    if (rank_of_quality(quality) > rank_of_quality(best)) best = quality;
  }
  return best;
}

bool has_position(unsigned seen) { return (seen & (kAnyGga | kGns)) != 0; }

}  // namespace

bool NmeaEpoch::take(const NmeaSentence& s, HostTime received, std::vector<Measurement>& out) {
  const std::string_view type = s.type();
  const unsigned part = type == "GGA"     ? s.talker() == "GN" ? kGga : kSystemGga
                        : type == "GNS"   ? kGns
                        : type == "RMC"   ? kRmc
                        : type == "ZDA"   ? kZda
                        : type == "GST"   ? kGst
                        : type == "VTG"   ? kVtg
                        : type == "PASHR" ? kPashr
                                          : 0u;
  if ((type == "RMC" && s.field(2) == "A" && place(s, 3)) || (type == "GLL" && s.field(6) == "A" && place(s, 1)))
    note_lone_position(received, out);
  if (part == 0) return false;
  if (part == kVtg) {  // it has no time: it belongs to the epoch that is open
    if (!epoch_) return false;
    epoch_->track = s.number(1);
    if (const auto knots = s.number(5)) epoch_->speed = *knots * kMetresPerSecondPerKnot;
  } else {
    const auto time = time_of_day(s.field(1));
    if (!time) return false;
    open(*time, part, out);
  }
  Epoch& epoch = *epoch_;
  epoch.seen |= part;
  epoch.latest = received;
  switch (part) {
    case kGga:
    case kSystemGga:
    case kGns: {
      knows_quality_ = true;
      const auto found = place(s, 2);
      const int quality = part == kGns ? quality_of(s.field(6)) : s.whole(6).value_or(0);
      const auto height = s.number(9), undulation = s.number(part == kGns ? 10 : 11);
      // GGA knows the kind of a fix better than GNS, and GN knows more satellites than the single systems.
      if (!found || (part == kGns && epoch.place_from != 0 && epoch.place_from != kGns)) break;
      if (part == kSystemGga &&
          (epoch.place_from == kGga ||
           (epoch.place_from == kSystemGga && rank_of_quality(quality) <= rank_of_quality(epoch.quality))))
        break;
      epoch.place = *found;
      epoch.place_from = part;
      epoch.place->ellipsoidal_height = height.value_or(0) + undulation.value_or(0);
      epoch.has_height = height && undulation;
      epoch.quality = quality;
      epoch.satellites = std::clamp(s.whole(7).value_or(0), 0, 999);
      epoch.hdop = s.number(8);
      epoch.received = received;
      break;
    }
    case kRmc: {
      const std::string_view date = s.field(9);
      const auto day = two_digits(date, 0), month = two_digits(date, 2), year = two_digits(date, 4);
      epoch.is_valid |= s.field(2) == "A";
      if (const auto knots = s.number(7); knots && !epoch.speed) epoch.speed = *knots * kMetresPerSecondPerKnot;
      if (const auto track = s.number(8); track && !epoch.track) epoch.track = track;
      if (day && month && year) take_date({full_year(*year), *month, *day}, received, out);
      break;
    }
    case kZda:  // the standard wants four digits of the year; a plotter (Navico GoFree) writes two
      if (const auto day = s.whole(2), month = s.whole(3), year = s.whole(4); day && month && year && *year >= 0)
        take_date({full_year(*year), *month, *day}, received, out);
      break;
    case kGst:
      if (const auto north = s.number(6), east = s.number(7), up = s.number(8);
          north && east && up && *north >= 0 && *east >= 0 && *up >= 0)
        epoch.sigma_enu = {{*east, *north, *up}};
      break;
    case kPashr:
      if (const auto heading = s.number(2), roll = s.number(4), pitch = s.number(5); heading && roll && pitch) {
        epoch.attitude = Attitude{*roll * kRadPerDeg, *pitch * kRadPerDeg, *heading * kRadPerDeg};
        epoch.is_aligned = s.whole(10).value_or(0) > 0 && s.whole(11).value_or(1) == 1;
        const auto sigma_roll = s.number(7), sigma_pitch = s.number(8), sigma_heading = s.number(9);
        if (sigma_roll && sigma_pitch && sigma_heading)
          epoch.attitude_sigma = {{*sigma_roll * kRadPerDeg, *sigma_pitch * kRadPerDeg, *sigma_heading * kRadPerDeg}};
      }
      break;
    default:
      break;
  }
  if (usual_ != 0 && (epoch.seen & usual_) == usual_) close(out);
  return true;
}

void NmeaEpoch::finish(std::vector<Measurement>& out) {
  close(out);
  if (lone_positions_ > 0) tell_lone_positions(out);
}

/// RMC and GLL have a position, but neither a height nor the kind of its fix: it makes no measurement.
void NmeaEpoch::note_lone_position(HostTime received, std::vector<Measurement>& out) {
  if (knows_quality_ || has_told_lone_) return;
  lone_at_ = received;
  if (++lone_positions_ >= kManyLonePositions) tell_lone_positions(out);
}

void NmeaEpoch::tell_lone_positions(std::vector<Measurement>& out) {
  if (knows_quality_ || has_told_lone_) return;
  out.emplace_back(Fault{kSystemSensor, FaultKind::Implausible, lone_at_, 1,
                         "positions in RMC or GLL alone, which have no height and do not say how good they are: not "
                         "used; ask the receiver for GGA"});
  has_told_lone_ = true;
}

void NmeaEpoch::forget() {
  epoch_.reset();
  usual_ = 0;
  labelled_.reset();
  lone_positions_ = 0;
}

void NmeaEpoch::open(nanoseconds time, unsigned part, std::vector<Measurement>& out) {
  // A sentence of the same kind and time again is not another epoch: some receivers send GGA for several talkers.
  if (epoch_ && epoch_->time_of_day != time) {
    usual_ = 0;  // a sentence that used to come is missing, or others come now: learn again
    close(out);
  }
  if (closed_ && closed_->time_of_day == time && !epoch_) {  // a sentence behind what was taken for the last one
    usual_ = 0;
    late_ = closed_->seen | part;
  }
  if (!epoch_) {
    epoch_.emplace();
    epoch_->time_of_day = time;
    epoch_->is_again = closed_ && closed_->time_of_day == time;
  }
}

void NmeaEpoch::close(std::vector<Measurement>& out) {
  if (!epoch_) return;
  const Epoch epoch = *std::exchange(epoch_, {});
  usual_ = std::exchange(late_, 0u) | epoch.seen;
  closed_ = Closed{epoch.time_of_day, usual_};
  const auto time = time_of(epoch);
  if (!time) {
    if (!has_no_time_)
      out.emplace_back(Fault{kSystemSensor, FaultKind::NoTime, epoch.latest, 1,
                             "sentences without a date: ask the receiver for RMC or ZDA"});
    has_no_time_ = true;
    return;
  }
  has_no_time_ = false;
  if ((epoch.is_valid || (epoch.has_date && epoch.quality > 0)) && !epoch.is_doubted) {
    const GpsTime second(std::chrono::floor<seconds>((*time + milliseconds(1)).time_since_epoch()));
    if (!labelled_ || second != *labelled_)
      out.emplace_back(TimeLabel{kSystemSensor, epoch.has_date ? epoch.dated : epoch.latest, second, {}, true});
    labelled_ = second;
  }
  if (epoch.is_again || !has_position(epoch.seen) || !epoch.place) return;
  GnssFix fix;
  fix.received = epoch.received;
  fix.time = *time;
  fix.type = fix_type(epoch.quality);
  fix.position = *epoch.place;
  fix.has_height = epoch.has_height;
  fix.satellites = epoch.satellites;
  const double horizontal = epoch.hdop.value_or(20) * range_error(fix.type) / std::numbers::sqrt2;
  fix.sigma_enu = epoch.sigma_enu.value_or(std::array<double, 3>{horizontal, horizontal, 3 * horizontal});
  if (!epoch.has_height) fix.sigma_enu[2] = std::max(fix.sigma_enu[2], kUnknownHeightSigma);
  if (epoch.attitude) {
    InsSolution solution;
    solution.received = epoch.received;
    solution.time = *time;
    solution.position = fix.position;
    solution.attitude = *epoch.attitude;
    if (epoch.speed && epoch.track) {
      const double track = *epoch.track * kRadPerDeg;
      solution.velocity_enu = {*epoch.speed * portable::sin(track), *epoch.speed * portable::cos(track), 0};
    }
    solution.is_good = epoch.is_aligned && fix.type != FixType::None && epoch.has_height;
    solution.status = static_cast<std::uint32_t>(epoch.quality);
    if (epoch.attitude_sigma) {
      const auto& place = fix.sigma_enu;
      const auto& turn = *epoch.attitude_sigma;
      // The sentences have no velocity upwards and no sigma of the velocity.
      solution.sigma = {{place[0], place[1], place[2], 0.2, 0.2, 1, turn[0], turn[1], turn[2]}};
    }
    out.emplace_back(std::move(solution));
  }
  out.emplace_back(fix);
}

void NmeaEpoch::take_date(const Date& date, HostTime received, std::vector<Measurement>& out) {
  Epoch& epoch = *epoch_;
  if (epoch.has_date && !(date == *date_)) {
    out.emplace_back(Fault{kSystemSensor, FaultKind::LabelConflict, received, 1,
                           "RMC and ZDA of one moment name different days: no label is made from them"});
    epoch.is_doubted = true;
    return;
  }
  date_ = date;
  date_at_ = epoch.time_of_day;
  epoch.has_date = true;
  epoch.dated = received;
}

/// Returns the epoch's time, with the date of one of its sentences or the latest date that was named.
std::optional<GpsTime> NmeaEpoch::time_of(const Epoch& epoch) const {
  if (!date_) return {};
  const auto whole = std::chrono::floor<seconds>(epoch.time_of_day);
  // A leap second is the 86400th second of a day or the 60th of a minute; the calendar takes it as second 60.
  const auto of_day = static_cast<int>(whole.count());
  UtcTime utc{date_->year,
              date_->month,
              date_->day,
              of_day / 3600,
              of_day / 60 % 60,
              of_day % 60,
              static_cast<std::int32_t>((epoch.time_of_day - whole).count())};
  if (of_day >= 86400) {
    utc.hour = 23;
    utc.minute = 59;
    utc.second = 60;
  }
  auto time = from_utc(utc);
  if (!time || epoch.has_date) return time;
  if (epoch.time_of_day < date_at_ - hours(12)) return *time + hours(24);
  if (epoch.time_of_day > date_at_ + hours(12)) return *time - hours(24);
  return time;
}

}  // namespace hueline::drivers
