#include "runtime/post_trajectory.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <utility>

#include "core/angle.hpp"
#include "core/calendar.hpp"
#include "core/geodesy.hpp"
#include "core/median.hpp"
#include "core/portable_math.hpp"

namespace hueline::runtime {
namespace {

constexpr nanoseconds kCompareEvery{100'000'000}, kStretch{10'000'000'000}, kLongestPause{1'000'000'000};
constexpr std::size_t kMostCompared = 2'000'000;  // two days at ten a second
constexpr nanoseconds kBefore{2'000'000'000};     // what may be held from before the POS's first solution
constexpr std::size_t kMostStretches = 10;
constexpr double kOtherPoint_m = 5;  // no two points of a vehicle are farther apart
constexpr double kMostAstray = 0.25;
constexpr double kOtherHeights_m = 20;  // no POS without sigmas errs by more in the median
constexpr double kOtherDrive_m = 50, kSameTime_m = 0.5, kMuchBetter = 5, kSameHeading = 0.01, kOtherAxes = 0.1;

/// Returns the angle in (-pi, pi].
double wrapped(double angle) { return std::remainder(angle, 2 * std::numbers::pi); }

double between(double a, double b, double share) { return a + share * (b - a); }
double angle_between(double a, double b, double share) { return a + share * wrapped(b - a); }

}  // namespace

/// The solutions of the file from front to back. Their headings are those of Heading::MinusWander until they are given.
class PostTrajectory::Solutions {
 public:
  using One = drivers::SbetSolutions::One;
  Solutions(drivers::SbetFile file, const Config& config, int week)
      : file_(std::move(file)), solutions_({week, config.is_utc, config.point_body}) {}

  /// Returns the next solution. Errors: those of SbetFile::next().
  Result<One> next() {
    while (!end_) {
      const auto record = file_.next();
      if (!record.ok()) end_ = record.error();
      if (auto one = end_ ? solutions_.finish() : solutions_.take(*record)) return std::move(*one);
    }
    return *end_;
  }

 private:
  drivers::SbetFile file_;
  drivers::SbetSolutions solutions_;
  std::optional<Error> end_;
};

/// The comparison with the POS, one pair of solutions after the other.
struct PostTrajectory::Differences {
  struct Pair {
    GpsTime time{};
    Geodetic place{};
    Eigen::Vector3d enu, body;
    double roll = 0, pitch = 0, heading = 0, wander = 0;
    double axis_sigma = 0, up_sigma = 0;  // of the horizontal difference, each axis, and of the vertical; 0: not known
    double horizontal() const { return portable::hypot(enu.x(), enu.y()); }
    /// The difference of the headings if that of the trajectory is read as `rule` says.
    double heading_by(Heading rule) const { return wrapped(heading + wander * static_cast<double>(rule)); }
  };

  /// Goes forward through the solutions of a file.
  class Cursor {
   public:
    explicit Cursor(Solutions solutions) : solutions_(std::move(solutions)) {}
    /// Returns the trajectory minus `own`, by linear interpolation; empty where the trajectory has a gap.
    std::optional<Pair> at(const InsSolution& own) {
      while (!end_ && (!after_ || after_->solution.time < own.time)) {
        before_ = std::exchange(after_, {});
        auto next = solutions_.next();
        if (next.ok()) {
          after_ = std::move(*next);
        } else {
          end_ = next.error();
        }
      }
      if (!before_ || !after_ || own.time < before_->solution.time) return {};
      const InsSolution &a = before_->solution, &b = after_->solution;
      if (b.time - a.time > kLongestPause) return {};
      const double share = to_seconds(own.time - a.time) / to_seconds(b.time - a.time);
      const Geodetic place{between(a.position.latitude, b.position.latitude, share),
                           angle_between(a.position.longitude, b.position.longitude, share),
                           between(a.position.ellipsoidal_height, b.position.ellipsoidal_height, share)};
      Pair out;
      out.time = own.time;
      out.place = own.position;
      out.enu = (ecef_from_enu(own.position).inverse() * to_ecef(place)).xyz;
      out.body = rotation_enu_body(own.attitude).conjugate() * out.enu;
      out.roll = wrapped(angle_between(a.attitude.roll, b.attitude.roll, share) - own.attitude.roll);
      out.pitch = wrapped(angle_between(a.attitude.pitch, b.attitude.pitch, share) - own.attitude.pitch);
      out.heading = wrapped(angle_between(a.attitude.heading, b.attitude.heading, share) - own.attitude.heading);
      out.wander = between(before_->wander, after_->wander, share);
      if (own.sigma) {
        double square = portable::square((*own.sigma)[0]) + portable::square((*own.sigma)[1]);
        if (a.sigma) square += portable::square((*a.sigma)[0]) + portable::square((*a.sigma)[1]);
        out.axis_sigma = std::sqrt(square / 2);
        out.up_sigma = portable::hypot((*own.sigma)[2], a.sigma ? (*a.sigma)[2] : 0);
      }
      return out;
    }
    /// Returns why the file ended; empty if it was not read to its end.
    const std::optional<Error>& end() const { return end_; }

   private:
    Solutions solutions_;
    std::optional<Solutions::One> before_, after_;
    std::optional<Error> end_;
  };

  std::vector<Pair> pairs;

  double median_horizontal() const {
    std::vector<double> all;
    for (const Pair& pair : pairs) all.push_back(pair.horizontal());
    return median(std::move(all));
  }
  /// Returns the share of the pairs that are farther apart than errors and another point of the vehicle explain.
  double share_astray() const {
    const auto is_astray = [](const Pair& pair) {
      return pair.horizontal() > (pair.axis_sigma > 0 ? kOtherPoint_m + 10 * pair.axis_sigma : kOtherDrive_m);
    };
    return static_cast<double>(std::count_if(pairs.begin(), pairs.end(), is_astray)) /
           static_cast<double>(pairs.size());
  }
  double median_up() const {
    std::vector<double> all;
    for (const Pair& pair : pairs) all.push_back(pair.enu.z());
    return median(std::move(all));
  }
  /// Returns by how much the heights may differ in the median: errors, and another point of the vehicle.
  double most_up() const {
    std::vector<double> all;
    for (const Pair& pair : pairs)
      all.push_back(pair.up_sigma > 0 ? kOtherPoint_m + 10 * pair.up_sigma : kOtherHeights_m);
    return median(std::move(all));
  }
  double median_heading(Heading rule) const {
    std::vector<double> all;
    for (const Pair& pair : pairs) all.push_back(std::abs(pair.heading_by(rule)));
    return median(std::move(all));
  }
  void sum_up(Heading rule, TrajectoryComparison& out) const;
  void find_stretches(Heading rule, TrajectoryComparison& out) const;
};

void PostTrajectory::Differences::sum_up(Heading rule, TrajectoryComparison& out) const {
  const auto n = static_cast<double>(pairs.size());
  std::array<double, 3> body_square{};
  std::uint64_t judged = 0, within = 0;
  for (const Pair& pair : pairs) {
    const std::array<double, 3> angles{pair.roll, pair.pitch, pair.heading_by(rule)};
    for (std::size_t i = 0; i < 3; ++i) {
      const auto axis = static_cast<Eigen::Index>(i);
      out.mean_enu[i] += pair.enu[axis] / n;
      out.rms_enu[i] += pair.enu[axis] * pair.enu[axis] / n;
      out.mean_body[i] += pair.body[axis] / n;
      body_square[i] += pair.body[axis] * pair.body[axis] / n;
      out.rms_angles[i] += angles[i] * angles[i] / n;
    }
    if (pair.horizontal() > out.largest_m) {
      out.largest_m = pair.horizontal();
      out.largest_at = pair.time;
    }
    if (pair.axis_sigma <= 0) continue;
    ++judged;
    if (pair.horizontal() <= 2 * pair.axis_sigma) ++within;
  }
  for (std::size_t i = 0; i < 3; ++i) {
    out.deviation_body[i] = std::sqrt(std::max(0.0, body_square[i] - out.mean_body[i] * out.mean_body[i]));
    out.rms_enu[i] = std::sqrt(out.rms_enu[i]);
    out.rms_angles[i] = std::sqrt(out.rms_angles[i]);
  }
  out.compared = pairs.size();
  if (judged > 0) out.within_two_sigma = static_cast<double>(within) / static_cast<double>(judged);
}

void PostTrajectory::Differences::find_stretches(Heading rule, TrajectoryComparison& out) const {
  for (std::size_t begin = 0; begin < pairs.size();) {
    TrajectoryStretch stretch;
    stretch.begin = pairs[begin].time;
    stretch.place = pairs[begin].place;
    std::size_t end = begin;
    for (; end < pairs.size() && pairs[end].time - stretch.begin < kStretch; ++end) {
      stretch.end = pairs[end].time;
      stretch.horizontal_m += portable::square(pairs[end].horizontal());
      stretch.up_m += portable::square(pairs[end].enu.z());
      stretch.heading += portable::square(pairs[end].heading_by(rule));
    }
    const auto n = static_cast<double>(end - begin);
    stretch.horizontal_m = std::sqrt(stretch.horizontal_m / n);
    stretch.up_m = std::sqrt(stretch.up_m / n);
    stretch.heading = std::sqrt(stretch.heading / n);
    out.stretches.push_back(stretch);
    begin = end;
  }
  std::stable_sort(out.stretches.begin(), out.stretches.end(),
                   [](const auto& a, const auto& b) { return a.horizontal_m > b.horizontal_m; });
  if (out.stretches.size() > kMostStretches) out.stretches.resize(kMostStretches);
}

PostTrajectory::~PostTrajectory() = default;
PostTrajectory::PostTrajectory(const Config& config) : config_(config) {}

Result<std::unique_ptr<PostTrajectory>> PostTrajectory::open(const Config& config, const OwnSolutions& own) {
  std::unique_ptr<PostTrajectory> out(new PostTrajectory(config));
  if (Status compared = out->compare(own); !compared.ok()) return compared.error();
  auto file = drivers::SbetFile::open(config.sbet, config.smrmsg);
  if (!file.ok()) return file.error();
  out->solutions_ = std::make_unique<Solutions>(std::move(*file), config, out->week_);
  return out;
}

/// Reads the file once and finds its span. Returns the week in which its seconds begin so that they are nearest to
/// `near`.
Result<int> PostTrajectory::find_span(GpsTime near) {
  auto file = drivers::SbetFile::open(config_.sbet, config_.smrmsg);
  if (!file.ok()) return file.error();
  std::optional<double> first, last;
  for (;;) {
    auto record = file->next();
    if (!record.ok() && record.error().code == ErrorCode::EndOfData) break;
    if (!record.ok()) return record.error();
    if (!first) first = record->second;
    last = record->second;
    if (record->sigma) ++comparison_.with_sigma;
  }
  const drivers::SbetFile::Counts& counts = file->counts();
  if (!config_.smrmsg.empty() && (comparison_.with_sigma == 0 || counts.impossible_accuracies > counts.accuracies / 4))
    return Error{
        ErrorCode::Invalid,
        fmt::format("{}: is not the file of accuracies (SMRMSG) of {}: of {} records {} are impossible, and {}",
                    config_.smrmsg, config_.sbet, counts.accuracies + counts.impossible_accuracies,
                    counts.impossible_accuracies,
                    comparison_.with_sigma > 0 ? "the others are likely to be, too"
                                               : "none is within 2 s of a record of the trajectory")};
  int week = to_gps_week(near).week;
  const nanoseconds begin = from_seconds(*first), half = std::chrono::seconds(kSecondsPerWeek / 2);
  if (from_gps_week(week, begin) - near > half) --week;
  if (near - from_gps_week(week, begin) > half) ++week;
  const nanoseconds utc = config_.is_utc ? nanoseconds(utc_offset_from_table(near)) : nanoseconds(0);
  comparison_.begin = from_gps_week(week, begin) + utc;
  comparison_.end = from_gps_week(week, from_seconds(*last)) + utc;
  comparison_.records = counts.records;
  comparison_.left_out = counts.impossible + counts.out_of_order;
  comparison_.bytes_at_end = counts.bytes_at_end;
  comparison_.accuracies_left_out = counts.impossible_accuracies;
  comparison_.accuracy_bytes_at_end = counts.accuracy_bytes_at_end;
  return week;
}

Status PostTrajectory::compare(const OwnSolutions& own) {
  comparison_.file = config_.sbet;
  // The other scale of time shows whether the file has UTC times, or should have them.
  Config other_config = config_;
  other_config.is_utc = !config_.is_utc;
  std::optional<Differences::Cursor> cursor, other_cursor;
  Differences all, other;
  std::optional<GpsTime> last;
  bool is_first = true;
  Status opened;
  const Status read = own([&](const InsSolution& solution) {
    if (is_first) comparison_.drive_begin = solution.time;
    is_first = false;
    comparison_.drive_end = solution.time;
    if (!solution.is_good || !opened.ok() || (last && solution.time < *last + kCompareEvery) ||
        all.pairs.size() == kMostCompared)
      return;
    if (!last) {
      const auto week = find_span(solution.time);
      auto file = drivers::SbetFile::open(config_.sbet, config_.smrmsg),
           again = drivers::SbetFile::open(config_.sbet, config_.smrmsg);
      for (const Error* error : {week.ok() ? nullptr : &week.error(), file.ok() ? nullptr : &file.error(),
                                 again.ok() ? nullptr : &again.error()})
        if (error != nullptr) opened = *error;
      if (!opened.ok()) return;
      week_ = *week;
      cursor.emplace(Solutions(std::move(*file), config_, week_));
      other_cursor.emplace(Solutions(std::move(*again), other_config, week_));
    }
    last = solution.time;
    if (auto pair = cursor->at(solution)) all.pairs.push_back(*pair);
    if (auto pair = other_cursor->at(solution)) other.pairs.push_back(*pair);
  });
  if (!read.ok()) return read;
  if (!opened.ok()) return opened;
  const auto invalid = [&](const std::string& why) {
    return Error{ErrorCode::Invalid, fmt::format("{}: {}", config_.sbet, why)};
  };
  if (!last)
    return invalid("the recording has no good solution of its POS, so nothing says whether this is its trajectory");
  if (all.pairs.empty())
    return invalid(
        fmt::format("covers {} to {} (GPS seconds of the week, as they are written, of the week nearest to "
                    "the drive), but the drive lasted from {} to {}: it is of another drive, or its seconds "
                    "are not those of the week",
                    iso_utc(comparison_.begin), iso_utc(comparison_.end), iso_utc(comparison_.drive_begin),
                    iso_utc(comparison_.drive_end)));
  const double apart = all.median_horizontal();
  if (apart > kSameTime_m && !other.pairs.empty() && other.median_horizontal() * kMuchBetter < apart)
    return invalid(
        fmt::format("lies {:.2f} m (median) from where the POS was, and {:.2f} m if its times are read as "
                    "{}: say {}",
                    apart, other.median_horizontal(), config_.is_utc ? "GPS seconds" : "UTC",
                    config_.is_utc ? "--trajectory-time gps" : "--trajectory-time utc"));
  if (const double astray = all.share_astray(); astray > kMostAstray)
    return invalid(
        fmt::format("lies {:.1f} m (median) from where the POS was, and farther from it for {:.0f} % of the "
                    "time than sigmas and lever arms explain: it is of another drive",
                    apart, astray * 100));
  if (const double up = all.median_up(); std::abs(up) > all.most_up())
    return invalid(fmt::format(
        "lies {:.1f} m {} where the POS was (median): its heights are not those above the ellipsoid that the "
        "POS gives; export it with ellipsoidal heights, or correct how the rig reads those of the POS",
        std::abs(up), up > 0 ? "above" : "below"));
  return choose_heading(all);
}

/// Takes the heading that agrees with the POS; with the wander angle subtracted, as POSPac writes it, if several do.
Status PostTrajectory::choose_heading(const Differences& all) {
  constexpr std::array<const char*, 3> kWords{"platform heading minus wander angle", "platform heading",
                                              "platform heading plus wander angle"};
  heading_ = Heading::MinusWander;
  double least = all.median_heading(heading_);
  for (const Heading rule : {Heading::Platform, Heading::PlusWander}) {
    const double apart = all.median_heading(rule);
    if (least < kSameHeading || apart * kMuchBetter > least) continue;
    heading_ = rule;
    least = apart;
  }
  comparison_.heading = kWords[static_cast<std::size_t>(heading_)];
  all.sum_up(heading_, comparison_);
  all.find_stretches(heading_, comparison_);
  const double tilted = std::max(comparison_.rms_angles[0], comparison_.rms_angles[1]);
  if (least <= kOtherAxes && tilted <= kOtherAxes) return {};
  return Error{
      ErrorCode::Invalid,
      fmt::format("{}: its attitude differs from that of the POS by {:.1f} deg of heading (median), {:.1f} deg "
                  "of roll and {:.1f} deg of pitch (rms): export it for the axes of the POS (x forward, y "
                  "right, z down)",
                  config_.sbet, least * kDegPerRad, comparison_.rms_angles[0] * kDegPerRad,
                  comparison_.rms_angles[1] * kDegPerRad)};
}

void PostTrajectory::take_until(GpsTime time, const std::function<void(const InsSolution&)>& use) {
  while (!is_over_) {
    if (waiting_ && waiting_->time > time) return;
    // A file may begin long before the drive.
    if (waiting_ && waiting_->time >= comparison_.drive_begin - kBefore) use(*waiting_);
    waiting_.reset();
    auto next = solutions_->next();
    if (!next.ok()) {
      is_over_ = true;
      if (next.error().code != ErrorCode::EndOfData) status_ = next.error();
      return;
    }
    waiting_ = std::move(next->solution);
    double& heading = waiting_->attitude.heading;
    heading = wrapped(heading + next->wander * static_cast<double>(heading_));
    if (heading < 0) heading += 2 * std::numbers::pi;
  }
}

nlohmann::ordered_json TrajectoryComparison::json() const {
  using nlohmann::ordered_json;
  const auto degrees = [](double angle) { return angle * kDegPerRad; };
  ordered_json out{
      {"file", file},
      {"records", records},
      {"records_left_out", left_out},
      {"bytes_at_end", bytes_at_end},
      {"accuracies_left_out", accuracies_left_out},
      {"accuracy_bytes_at_end", accuracy_bytes_at_end},
      {"begin", iso_utc(begin)},
      {"end", iso_utc(end)},
      {"records_with_sigma", with_sigma},
      {"heading", heading},
      {"compared", compared},
      {"mean_east_north_up_m", mean_enu},
      {"rms_east_north_up_m", rms_enu},
      {"mean_right_forward_up_m", mean_body},
      {"deviation_right_forward_up_m", deviation_body},
      {"rms_roll_pitch_heading_deg", {degrees(rms_angles[0]), degrees(rms_angles[1]), degrees(rms_angles[2])}},
      {"largest_horizontal_m", largest_m},
      {"largest_at", iso_utc(largest_at)}};
  if (within_two_sigma) out["within_two_sigma"] = *within_two_sigma;
  ordered_json worst = ordered_json::array();
  for (const TrajectoryStretch& stretch : stretches)
    worst.push_back({{"begin", iso_utc(stretch.begin)},
                     {"end", iso_utc(stretch.end)},
                     {"latitude_deg", degrees(stretch.place.latitude)},
                     {"longitude_deg", degrees(stretch.place.longitude)},
                     {"horizontal_m", stretch.horizontal_m},
                     {"up_m", stretch.up_m},
                     {"heading_deg", degrees(stretch.heading)}});
  out["worst_stretches"] = std::move(worst);
  return out;
}

std::string TrajectoryComparison::text() const {
  std::string out = fmt::format(
      "trajectory {} in place of the POS's solutions, {}: differs from them by {:.3f} m east, {:.3f} m north, "
      "{:.3f} m up, {:.3f} deg of roll, {:.3f} of pitch, {:.3f} of heading (rms); at most {:.2f} m horizontally, at "
      "{}\n",
      file,
      with_sigma == 0         ? "without sigmas of its own"
      : with_sigma == records ? "with its own sigmas"
                              : fmt::format("with its own sigmas for {} of {} records", with_sigma, records),
      rms_enu[0], rms_enu[1], rms_enu[2], rms_angles[0] * kDegPerRad, rms_angles[1] * kDegPerRad,
      rms_angles[2] * kDegPerRad, largest_m, iso_utc(largest_at));
  if (within_two_sigma)
    out += fmt::format("           {:.0f} % of the horizontal differences are within two sigma\n",
                       *within_two_sigma * 100);
  if (left_out + bytes_at_end > 0)
    out += fmt::format(
        "           {} of its records are impossible or out of order, and {} bytes at its end are no "
        "whole record; they are left out\n",
        left_out, bytes_at_end);
  if (accuracies_left_out + accuracy_bytes_at_end > 0)
    out += fmt::format(
        "           {} records of its accuracies (SMRMSG) are impossible, and {} bytes at their end are no whole "
        "record; they are left out\n",
        accuracies_left_out, accuracy_bytes_at_end);
  if (begin > drive_begin || end < drive_end)
    out += fmt::format("           it covers {} to {} only; the drive lasted from {} to {}\n", iso_utc(begin),
                       iso_utc(end), iso_utc(drive_begin), iso_utc(drive_end));
  const bool is_constant = deviation_body[0] + deviation_body[1] < 0.05;
  if (is_constant && portable::hypot(mean_body[0], mean_body[1]) > 0.1)
    out += fmt::format(
        "           it lies {:.2f} m to the right and {:.2f} m before the POS's point all the time: "
        "if it is of another point of the vehicle, say --trajectory-point\n",
        mean_body[0], mean_body[1]);
  return out;
}

}  // namespace hueline::runtime
