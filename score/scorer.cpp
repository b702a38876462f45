#include "score/scorer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <iterator>
#include <map>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "core/output_file.hpp"
#include "score/sight_figures.hpp"
#include "sim/earth.hpp"
#include "sim/ins_model.hpp"
#include "sim/noise.hpp"

namespace hueline::score {
namespace {
// Far more than any sigma of a POS that calls its solution good.
constexpr double kMisplaced_m = 0.5;

sim::Pose head_of(const sim::TrueExposure& e) {
  return {{e.R_enu_head}, {e.p_enu_head[0], e.p_enu_head[1], e.p_enu_head[2]}};
}
}  // namespace

std::string Scorer::Config::validate() const {
  if (ray_returns < 100 || ray_returns > 10'000'000) return "ray_returns must be 100 to 10000000";
  if (neighbours < 0 || neighbours > 100) return "neighbours must be 0 to 100";
  return threads >= 1 && threads <= 256 ? "" : "threads must be 1 to 256";
}

Scorer::Scorer(const sim::Scenario& scenario, sim::Judge judge, const Config& config)
    : config_(config),
      judge_(std::move(judge)),
      begin_(scenario.begin_gps_ns()),
      lab_(encoding_of(scenario)),
      outlook_(std::make_unique<Outlook>(scenario, judge_.exposures())),
      is_there_(judge_.exposures().size()),
      reprojection_(outlook_->rig()) {
  const sim::GeodeticPlace origin = sim::scene_origin(scenario);
  T_ecef_scene_ = {sim::R_ecef_enu(origin), sim::ecef_from_geodetic(origin)};
  if (!judge_.exposures().empty()) view_.emplace(head_of(judge_.exposures()[judge_.exposures().size() / 2]));
  one_in_ = std::max<std::uint64_t>(1, judge_.true_returns() / config_.ray_returns);
}

Result<Scorer> Scorer::open(const sim::Scenario& scenario, const std::string& cache_dir, const Config& config) {
  if (const std::string complaint = config.validate(); !complaint.empty())
    return Error{ErrorCode::Invalid, "score: " + complaint};
  const std::string file = cache_dir + "/truth.bin";
  auto judge = sim::Judge::open(scenario, file, {});
  if (!judge.ok()) return judge.error();
  Scorer scorer(scenario, std::move(*judge), config);
  auto reader = sim::TruthReader::open(file);
  if (!reader.ok()) return reader.error();
  for (;;) {
    auto packet = reader->next_packet();
    if (!packet.ok()) {
      if (packet.error().code == ErrorCode::EndOfData) return scorer;
      return packet.error();
    }
    for (const sim::TrueReturn& r : *packet) {
      if (r.surface == kOwnVehicle) continue;
      ++scorer.world_returns_;
      if (scorer.is_sampled(r)) scorer.sample_.push_back(r);
    }
  }
}

bool Scorer::is_sampled(const sim::TrueReturn& truth) const {
  return sim::scrambled(key(truth) ^ sim::scrambled(config_.seed)) % one_in_ == 0;
}

void Scorer::add(const ExposureClaim& claim) {
  if (claim.number >= judge_.exposures().size()) return;
  const sim::TrueExposure& truth = judge_.exposures()[claim.number];
  ExposureError error;
  error.drive_s = static_cast<double>(truth.exposure_mid_gps_ns - begin_) * 1e-9;
  error.error_us = static_cast<double>(claim.mid_gps_ns - truth.exposure_mid_gps_ns) * 1e-3;
  error.sigma_us = claim.sigma_ns * 1e-3;
  if (claim.T_ecef_head) {
    const sim::Pose stated = inverse(T_ecef_scene_) * *claim.T_ecef_head, wanted = head_of(truth);
    error.has_pose = true;
    error.position_error_m = stated.p - wanted.p;
    // The angle of the rotation between the two. Its sine is half the length of the antisymmetric part, which is
    // accurate for small angles.
    const sim::Mat3 turn = stated.R * transposed(wanted.R);
    const sim::Vec3 axis{turn.m[7] - turn.m[5], turn.m[2] - turn.m[6], turn.m[3] - turn.m[1]};
    error.attitude_error_deg = sim::degrees(std::atan2(length(axis), turn.m[0] + turn.m[4] + turn.m[8] - 1));
  }
  exposures_.push_back(error);
  is_there_[claim.number] = claim.has_image && claim.T_ecef_head;
}

void Scorer::add(const PointClaim& point) {
  const sim::Claim& claim = point.claim;
  const auto truth = judge_.true_return(claim.channel, claim.fired_gps_ns);
  if (!truth) {
    ++unmatched_;
    return;
  }
  if (truth->surface == kOwnVehicle) {
    ++own_;
    return;
  }
  ++points_;
  motion_.add(truth->is_moving, point.moving);
  const sim::Vec3 beam{truth->beam_east, truth->beam_north, truth->beam_up};
  if (claim.place_ecef) {
    const double off = length(*claim.place_ecef - T_ecef_scene_ * beam);
    if (off > kMisplaced_m)
      ++misplaced_;
    else
      place_.add(off);
  }
  if (!point.is_coloured) return;
  ++coloured_;
  if (point.latency_ms)
    latency_.add(*point.latency_ms);
  else
    ++at_the_end_;
  if (claim.exposure >= judge_.exposures().size()) return;
  if (const auto verdict = judge_.judge(claim))
    reprojection_.add(verdict->error_px, verdict->distance_m, claim.lens,
                      inverse(head_of(judge_.exposures()[claim.exposure])) * beam);
  const std::array<std::uint8_t, 3> given{claim.red, claim.green, claim.blue};
  const std::array<std::uint8_t, 3> wanted =
      outlook_->tone().perfect({truth->light[0], truth->light[1], truth->light[2]});
  const Lab given_lab = lab_(given), wanted_lab = lab_(wanted);
  const double difference = ciede2000(given_lab, wanted_lab);
  const sim::Vec3 place{truth->east, truth->north, truth->up};
  colour_.add(claim.exposure, given_lab, wanted_lab, difference);
  seams_.add(place, truth->surface, claim.exposure, claim.lens, given_lab, wanted_lab);
  if (!truth->is_moving)
    flicker_.add(place, truth->surface, key(*truth), claim.exposure, claim.lens, given_lab, wanted_lab);
  if (view_) view_->add(place, given, wanted, difference);
  if (is_sampled(*truth)) given_[key(*truth)] = {claim.exposure, claim.lens, difference};
}

void Scorer::add(SightClaim sight) {
  const auto truth = judge_.true_return(sight.channel, sight.fired_gps_ns);
  if (!truth || truth->surface == kOwnVehicle || !is_sampled(*truth)) return;
  if (sight.exposure >= judge_.exposures().size()) return;
  sights_.push_back({{truth->east, truth->north, truth->up}, std::move(sight)});
}

Status Scorer::write_sights(const std::filesystem::path& file, std::span<const char* const> words) const {
  fmt::memory_buffer text;
  const auto out = std::back_inserter(text);
  fmt::format_to(out, "point,seen");
  for (const char* word : words) fmt::format_to(out, ",{}", word);
  std::map<std::pair<sim::GpsNs, std::uint16_t>, std::size_t> numbers;  // of the returns, by firing and channel
  for (const auto& [place, claim] : sights_) {
    const std::size_t number = numbers.try_emplace({claim.fired_gps_ns, claim.channel}, numbers.size()).first->second;
    const auto sight = outlook_->sight(claim.exposure, claim.lens, place);
    if (!sight) continue;
    const bool is_seen = outlook_->look(*sight, place).met == Outlook::Met::Place;
    fmt::format_to(out, "\n{},{}", number, is_seen ? 1 : 0);
    for (const float value : claim.evidence) fmt::format_to(out, ",{}", value);
  }
  text.push_back('\n');
  return write_output(file, {text.data(), text.size()});
}

std::vector<Observation> Scorer::observe_sample(const std::function<void(double)>& progress) const {
  std::vector<Observation> out(sample_.size());
  std::vector<sim::GpsNs> mids;
  for (const sim::TrueExposure& e : judge_.exposures()) mids.push_back(e.exposure_mid_gps_ns);
  const Candidates candidates(mids, is_there_, config_.neighbours);
  std::atomic<std::size_t> next{0};
  constexpr std::size_t kAtOnce = 128;
  const auto work = [&](bool is_caller) {
    for (std::size_t first; (first = next.fetch_add(kAtOnce)) < sample_.size();) {
      if (is_caller) progress(static_cast<double>(first) / static_cast<double>(sample_.size()));
      for (std::size_t i = first; i < std::min(first + kAtOnce, sample_.size()); ++i) {
        const auto found = given_.find(key(sample_[i]));
        out[i] = observe(*outlook_, sample_[i], candidates,
                         found == given_.end() ? std::nullopt : std::optional(found->second));
      }
    }
  };
  {
    std::vector<std::jthread> others;
    for (int i = 1; i < config_.threads; ++i) others.emplace_back(work, false);
    work(true);
  }
  progress(1);
  return out;
}

ScenarioScore Scorer::finish(const std::string& name, const std::map<std::string, DeviceBytes>& devices,
                             const std::function<void(double)>& progress) {
  ScenarioScore score;
  score.scenario = name;
  std::sort(exposures_.begin(), exposures_.end(),
            [](const ExposureError& a, const ExposureError& b) { return a.drive_s < b.drive_s; });
  add_time_figures(exposures_, judge_.exposures().size(), score);
  reprojection_.report(score);
  const auto share = [&](std::uint64_t part) {
    return world_returns_ ? Figure{static_cast<double>(part) / static_cast<double>(world_returns_), {}}
                          : Figure{{}, "the laser has no return"};
  };
  const std::uint64_t given = points_ + unmatched_;
  score.figures["place_rms_m"] = place_.count() ? Figure{place_.rms(), {}} : Figure{{}, "no point was placed"};
  score.figures["misplaced_share"] =
      given ? Figure{static_cast<double>(misplaced_ + unmatched_) / static_cast<double>(given), {}}
            : Figure{{}, "no point was given"};
  score.figures["placed_share"] = share(points_);
  score.figures["coloured_share"] = share(coloured_);
  colour_.report(score);
  seams_.report(score);
  flicker_.report(score);
  motion_.report(score);

  SightFigures sights(outlook_->world().surfaces());
  for (const Observation& observation : observe_sample(progress)) sights.add(observation);
  sights.report(score);

  const auto quantile = [](const sim::Spread& latency, double q) {
    return latency.count() ? Figure{latency.quantile(q), {}}
                           : Figure{{}, "no point was coloured before the stream's end"};
  };
  score.figures["provisional_latency_p99_ms"] = quantile(provisional_latency_, 0.99);
  score.figures["latency_p50_ms"] = quantile(latency_, 0.5);
  score.figures["latency_p99_ms"] = quantile(latency_, 0.99);
  Chart latency{
      "Latency from the last needed input", "ms of drive time", "% of points below", Chart::Kind::Lines, false, {}, {}};
  latency.curves.push_back(distribution("final", latency_));
  latency.curves.push_back(distribution("provisional", provisional_latency_));
  score.charts.push_back(std::move(latency));
  add_byte_figures(devices, score);
  score.notes.insert(score.notes.begin(),
                     fmt::format("{} true returns, {} of them on the own vehicle and left out; {} points given, {} "
                                 "coloured ({} of them at the stream's end, without a latency), {} without truth; rays "
                                 "for one return in {}; true colours at {:.3f} of the nominal gain",
                                 judge_.true_returns(), judge_.true_returns() - world_returns_, points_ + own_,
                                 coloured_, at_the_end_, unmatched_, one_in_, outlook_->reference_gain()));
  if (view_) score.pictures = view_->pictures();
  return score;
}

}  // namespace hueline::score
