#include "sim/judge.hpp"

#include <algorithm>
#include <cmath>

#include "sim/earth.hpp"
#include "sim/ins_model.hpp"

namespace hueline::sim {
namespace {
constexpr double kLowest = 1e-6, kBinsPerFactorE = 94.0;
}

void Spread::add(double x) {
  if (bins_.empty()) bins_.assign(kBins, 0);
  ++count_;
  sum_square_ += x * x;
  max_ = std::max(max_, x);
  const double bin = x > kLowest ? kBinsPerFactorE * std::log(x / kLowest) + 1 : 0;
  ++bins_[std::min(kBins - 1, static_cast<std::size_t>(bin))];
}

double Spread::rms() const { return count_ > 0 ? std::sqrt(sum_square_ / static_cast<double>(count_)) : 0.0; }

double Spread::quantile(double share) const {
  const double wanted = share * static_cast<double>(count_);
  std::uint64_t below = 0;
  for (std::size_t i = 0; i < bins_.size(); ++i) {
    below += bins_[i];
    if (static_cast<double>(below) >= wanted)
      return std::min(max_, kLowest * std::exp(static_cast<double>(i) / kBinsPerFactorE));
  }
  return max_;
}

std::string Judge::Config::validate() const {
  if (!(panorama_width >= 2 && panorama_height >= 1))
    return "panorama_width and panorama_height must be at least 2 and 1";
  if (match_ns < 0 || match_ns > 27'000)
    return "match_ns must be 0 to 27000: less than half the time between firings of a channel";
  return {};
}

Judge::Judge(const Scenario& scenario, const Config& config)
    : config_(config), rig_(rig_truth(scenario)), shutter_(scenario), by_lens_(rig_.lenses.size()) {
  if (!shutter_.is_one_moment()) motion_.emplace(scenario);
  // A profile scanner fires all pulses in one channel, microseconds apart. The limit keeps a claim from being matched
  // with the neighbouring pulse.
  if (scenario.laser.model == LaserModel::Profile)
    config_.match_ns = std::min(config_.match_ns, profile_timing(scenario.laser).pulse_period_ps * 2 / 5 / 1000);
}

Pose Judge::T_enu_head(const TrueExposure& exposure, std::size_t lens, Vec3 p_enu) const {
  Pose T_enu_head{{exposure.R_enu_head}, {exposure.p_enu_head[0], exposure.p_enu_head[1], exposure.p_enu_head[2]}};
  // The row gives the time, and the time moves the row. Each iteration changes the row by far less than one row.
  for (int i = 0; i < 3 && motion_; ++i) {
    const auto pixel = rig_.lenses[lens].project(inverse(T_enu_head * rig_.lenses[lens].T_head_lens) * p_enu);
    if (!pixel) break;
    const GpsNs time =
        exposure.exposure_mid_gps_ns + shutter_.lateness(exposure.lens_gain, lens) + shutter_.row_delay(pixel->v);
    T_enu_head = motion_->T_enu_body(time) * rig_.T_body_head_at(time);
  }
  return T_enu_head;
}

Result<Judge> Judge::open(const Scenario& scenario, const std::string& truth_file, const Config& config) {
  if (const std::string complaint = config.validate(); !complaint.empty())
    return Error{ErrorCode::Invalid, "judge: " + complaint};
  auto reader = TruthReader::open(truth_file);
  if (!reader.ok()) return reader.error();
  if (reader->header().scenario != scenario.text())
    return Error{ErrorCode::Invalid, truth_file + " holds the truth of another scenario"};
  Judge judge(scenario, config);
  judge.header_ = reader->header();
  const GeodeticPlace origin = scene_origin(scenario);
  judge.origin_ecef_ = ecef_from_geodetic(origin);
  judge.R_ecef_scene_ = R_ecef_enu(origin);
  for (;;) {
    auto packet = reader->next_packet();
    if (!packet.ok()) {
      if (packet.error().code == ErrorCode::EndOfData) break;
      return packet.error();
    }
    for (const TrueReturn& r : *packet) {
      if (r.channel >= judge.channels_.size()) judge.channels_.resize(r.channel + 1u);
      judge.channels_[r.channel].push_back(
          {r.fired_gps_ns,
           {r.beam_east, r.beam_north, r.beam_up},
           {static_cast<float>(r.east - r.beam_east), static_cast<float>(r.north - r.beam_north),
            static_cast<float>(r.up - r.beam_up)},
           r.surface,
           {r.red, r.green, r.blue},
           r.albedo,
           r.is_moving,
           r.light});
      ++judge.true_returns_;
    }
  }
  return judge;
}

const Judge::Record* Judge::find(std::uint16_t channel, GpsNs fired) const {
  if (channel >= channels_.size()) return nullptr;
  const auto& list = channels_[channel];
  const auto after =
      std::lower_bound(list.begin(), list.end(), fired, [](const Record& r, GpsNs t) { return r.fired < t; });
  const Record* best = nullptr;
  if (after != list.end()) best = &*after;
  if (after != list.begin() && (best == nullptr || fired - (after - 1)->fired < best->fired - fired))
    best = &*(after - 1);
  return best != nullptr && std::abs(best->fired - fired) <= config_.match_ns ? best : nullptr;
}

std::optional<TrueReturn> Judge::true_return(std::uint16_t channel, GpsNs fired) const {
  const Record* record = find(channel, fired);
  if (record == nullptr) return std::nullopt;
  TrueReturn r;
  r.fired_gps_ns = record->fired;
  r.channel = channel;
  r.surface = record->surface;
  r.beam_east = record->beam[0], r.beam_north = record->beam[1], r.beam_up = record->beam[2];
  r.east = r.beam_east + record->hit[0], r.north = r.beam_north + record->hit[1], r.up = r.beam_up + record->hit[2];
  r.albedo = record->albedo;
  r.is_moving = record->is_moving;
  r.light = record->light;
  r.red = record->colour[0], r.green = record->colour[1], r.blue = record->colour[2];
  return r;
}

TruePixel Judge::panorama_pixel(Vec3 d) const {
  const double per_radian = config_.panorama_width / (2 * kPi);
  const double left = std::atan2(d.y, d.x);  // anticlockwise from forward
  double u = config_.forward_column + (config_.is_clockwise ? -left : left) * per_radian;
  u -= config_.panorama_width * std::floor((u + 0.5) / config_.panorama_width);
  const double polar = std::atan2(std::hypot(d.x, d.y), d.z);
  return {u, polar / kPi * config_.panorama_height - 0.5};
}

Vec3 Judge::panorama_direction(TruePixel p) const {
  const double turn = (p.u - config_.forward_column) * 2 * kPi / config_.panorama_width;
  const double left = config_.is_clockwise ? -turn : turn;
  const double polar = (p.v + 0.5) / config_.panorama_height * kPi;
  return {std::sin(polar) * std::cos(left), std::sin(polar) * std::sin(left), std::cos(polar)};
}

std::optional<Verdict> Judge::judge(const Claim& claim) const {
  if (claim.exposure >= header_.exposures.size() || claim.lens >= rig_.lenses.size()) return std::nullopt;
  const Record* record = find(claim.channel, claim.fired_gps_ns);
  if (record == nullptr) return std::nullopt;
  const TrueExposure& exposure = header_.exposures[claim.exposure];
  const Vec3 p_enu{record->beam[0], record->beam[1], record->beam[2]};
  const Vec3 p_head = inverse(T_enu_head(exposure, claim.lens, p_enu)) * p_enu;

  Verdict verdict;
  verdict.surface = record->surface;
  verdict.distance_m = length(p_head);
  double angle = 0;
  if (claim.is_panorama_pixel) {
    verdict.expected = panorama_pixel(p_head);
    angle = angle_between(panorama_direction({claim.u, claim.v}), p_head);
  } else {
    const TrueLens& lens = rig_.lenses[claim.lens];
    const Vec3 p_lens = inverse(lens.T_head_lens) * p_head;
    const auto expected = lens.project(p_lens);
    const auto ray = lens.ray(claim.u, claim.v);
    if (!expected || !ray) return std::nullopt;
    verdict.expected = *expected;
    angle = angle_between(*ray, p_lens);
  }
  verdict.error_px = angle * config_.panorama_width / (2 * kPi);
  const std::array<int, 3> difference{claim.red - record->colour[0], claim.green - record->colour[1],
                                      claim.blue - record->colour[2]};
  for (const int d : difference)
    verdict.colour_difference = std::max(verdict.colour_difference, std::abs(static_cast<double>(d)));
  if (claim.place_ecef) verdict.place_error_m = length(*claim.place_ecef - (R_ecef_scene_ * p_enu + origin_ecef_));
  return verdict;
}

void Judge::add(const Claim& claim) {
  const auto verdict = judge(claim);
  if (!verdict) {
    ++unmatched_;
    return;
  }
  for (Figures* figures : {&all_, &by_lens_[claim.lens]}) {
    figures->error_px.add(verdict->error_px);
    figures->colour_difference.add(verdict->colour_difference);
    if (claim.place_ecef) figures->place_error_m.add(verdict->place_error_m);
  }
}

}  // namespace hueline::sim
