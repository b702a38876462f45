#include "fusion/colouring.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <numbers>
#include <utility>

#include "fusion/colouring_piece.hpp"
#include "fusion/head_motion.hpp"
#include "fusion/lens_exposure.hpp"
#include "fusion/worker_pool.hpp"

namespace hueline::fusion {
namespace {
constexpr std::size_t kBatchesAtOnce =
    256;  // limits the working memory; about 100 000 points for packets of 384 returns
constexpr nanoseconds kAdvance{10'000'000};  // so much is coloured at once, so that there is work for all threads
}  // namespace

void Colouring::Config::visit(Keys& keys) {
  keys.choice(
      required("method", "", "Whether a point is projected into the lens directly, or by way of the panoramic sphere."),
      method, {{"lens", ColourMethod::Lens}, {"panorama", ColourMethod::Panorama}});
  keys.choice({"choice", "",
               "Which exposure gives a point its colour: the one that sees it most nearly as the scanner did and from "
               "which nothing hides it, or the one nearest in time."},
              choice, {{"visible", ExposureChoice::Visible}, {"nearest", ExposureChoice::Nearest}});
  keys.duration(
      {"exposure_interval_s", "s", "The time between exposures. An exposure owns the points around it.", "0: measured"},
      exposure_interval, {0, 60});
  // More on each side than Config::max_held_moments can hold would never be there.
  keys.whole(
      {"neighbours", "exposures",
       "How many exposures on each side may give a point its colour besides its owner. Beyond the nearest three of a "
       "side, they are 0.4 s apart."},
      neighbours, {0, 15});
  keys.duration({"max_wait_s", "s",
                 "How long a point waits after its firing for later exposures that may colour it. It always waits for "
                 "half the time between exposures, so that the nearest one has come. Less gives colours sooner; more "
                 "lets more later exposures show what was hidden."},
                max_wait, {0.05, 60});
  keys.whole({"lost_image_neighbours", "exposures",
              "With choice: nearest, how many exposures away an image may be that colours the points of a lost image. "
              "0: they stay without a colour."},
             lost_image_neighbours, {0, 15});
  keys.duration({"max_lateness_s", "s",
                 "How far behind the other data a solution of the POS may arrive. Points wait this long for their "
                 "poses. Later data are recorded, but not fused."},
                max_lateness, {0.01, 60});
  radiometry.visit(keys);
  trajectory.visit(keys);
}

KeyError Colouring::Config::validate() const {
  if (KeyError wrong = check_keys(*this); !wrong.empty()) return wrong;
  if (KeyError wrong = trajectory.validate(); !wrong.empty()) return wrong;
  const auto check = [](const char* key, nanoseconds value, double low, double high) -> KeyError {
    const double s = to_seconds(value);
    return s >= low && s <= high ? KeyError() : not_allowed(key, number_text(s), fmt::format("{} to {} s", low, high));
  };
  for (const KeyError& wrong : {check("pose_step", pose_step, 1e-5, 0.01),
                                check("exposure_interval_at_start", exposure_interval_at_start, 0.01, 60),
                                check("window_slack", window_slack, 0, 1), check("together", together, 0, 1)})
    if (!wrong.empty()) return wrong;
  if (max_pending_returns < 1000)
    return not_allowed("max_pending_returns", std::to_string(max_pending_returns), "1000 or more");
  const auto needed = static_cast<std::size_t>(2 * std::max(neighbours, lost_image_neighbours) + 2);
  if (max_held_moments < needed)
    return not_allowed("max_held_moments", std::to_string(max_held_moments),
                       fmt::format("{} or more with these neighbours", needed));
  if (threads < 1 || threads > 256) return not_allowed("threads", std::to_string(threads), "1 to 256");
  return {};
}

Colouring::Colouring(const Config& config, const RigGeometry& rig, Sink sink)
    : config_(config),
      rig_(rig),
      sink_(std::move(sink)),
      trajectory_(config.trajectory),
      projector_(rig.head, config.method),
      timeline_({config.exposure_interval, config.exposure_interval_at_start, config.window_slack, config.together},
                projector_.cameras().size()),
      radiometry_(config.radiometry, rig.head.lenses.size()),
      visibility_(config.visibility),
      pool_(std::make_unique<WorkerPool>(config.threads)) {
  for (const LaserMount& laser : rig.lasers) lasers_[laser.sensor] = laser;
}

Colouring::~Colouring() = default;

void Colouring::add(const InsSolution& solution) {
  const Trajectory::Counts before = trajectory_.counts();
  trajectory_.add(solution);
  const Trajectory::Counts& now = trajectory_.counts();
  if (now.leaps > before.leaps)
    note(solution.sensor, FaultKind::Implausible, 1,
         fmt::format(
             "the vehicle leapt by {:.3f} m and {:.3f} deg; points after it have a sigma as large, until it leaps back",
             trajectory_.leapt_m(), trajectory_.leapt_angle() * 180.0 / std::numbers::pi));
}

void Colouring::note(SensorId sensor, FaultKind kind, std::uint64_t count, std::string detail) {
  const auto [it, is_new] = faults_.try_emplace({sensor, kind}, Fault{sensor, kind, HostTime{}, 0, std::move(detail)});
  it->second.count += count;
}

std::vector<Fault> Colouring::take_faults() {
  std::vector<Fault> faults;
  for (auto& [key, fault] : faults_) faults.push_back(std::move(fault));
  faults_.clear();
  return faults;
}

GpsTime Colouring::last_firing(const StampedLaserBatch& batch) const {
  std::int32_t last = 0;
  for (const LaserReturn& r : batch.returns) last = std::max(last, r.time_offset_ns);
  return batch.time + nanoseconds(last);
}

nanoseconds Colouring::neighbour_reach() const {
  const int windows = std::max(config_.neighbours, config_.lost_image_neighbours);
  return timeline_.interval() * windows + timeline_.interval() / 2 + config_.window_slack;
}

/// How much earlier than a point's firing an exposure may be that colours it. Earlier ones cost no waiting, so this
/// does not shrink with the time between exposures, as neighbour_reach() does.
nanoseconds Colouring::reach_behind() const {
  if (config_.choice == ExposureChoice::Nearest) return neighbour_reach();
  return timeline_.step() * config_.neighbours + timeline_.interval() / 2 + config_.window_slack;
}

/// How much later than a point's firing an exposure may be that colours it.
nanoseconds Colouring::reach_ahead() const {
  const nanoseconds owner = timeline_.interval() / 2 + config_.window_slack;
  return std::max(owner, std::min(neighbour_reach(), config_.max_wait));
}

void Colouring::add(StampedLaserBatch batch) {
  counts_.returns += batch.returns.size();
  if (!lasers_.contains(batch.sensor)) {
    counts_.unknown_laser_returns += batch.returns.size();
    note(batch.sensor, FaultKind::Spurious, 1,
         "laser batch of a sensor that the rig does not name; recorded, not fused");
    return;
  }
  if (watermark_ && batch.time < *watermark_ - config_.max_lateness) {
    ++counts_.late_batches;
    counts_.late_returns += batch.returns.size();
    note(batch.sensor, FaultKind::Late, 1, "laser batch older than max_lateness; recorded, not fused");
    return;
  }
  if (batch.returns.empty()) return;  // there is nothing to colour, and nothing that max_pending_returns would limit
  counts_.pending_returns += batch.returns.size();
  pending_.push_back(std::move(batch));
}

void Colouring::add(const Exposure& exposure) {
  ++counts_.exposures;
  const auto& cameras = projector_.cameras();
  const auto camera =
      static_cast<std::size_t>(std::find(cameras.begin(), cameras.end(), exposure.camera) - cameras.begin());
  if (camera == cameras.size()) {
    ++counts_.exposures_unknown_camera;
    note(exposure.camera, FaultKind::Spurious, 1,
         "exposure of a camera of which the head has no lens; recorded, not fused");
    return;
  }
  if (exposure.timing == ExposureTiming::Unmatched) {
    ++counts_.exposures_unmatched;
    return;
  }
  if (!exposure.image.is_complete) {
    ++counts_.exposures_incomplete;
    return;
  }
  const RawView view = view_of(exposure.image);
  const bool fits =
      view.data != nullptr && std::all_of(rig_.head.lenses.begin(), rig_.head.lenses.end(), [&](const LensMount& lens) {
        return lens.camera != exposure.camera || (lens.x_offset + lens.intrinsics.width <= view.width &&
                                                  lens.y_offset + lens.intrinsics.height <= view.height);
      });
  if (!fits) {
    ++counts_.exposures_wrong_size;
    note(exposure.camera, FaultKind::WrongSize, 1,
         "image does not hold the lens images of the rig; recorded, not fused");
    return;
  }
  if (watermark_ && exposure.exposure_mid < *watermark_ - config_.max_lateness) {
    ++counts_.exposures_late;
    note(exposure.camera, FaultKind::Late, 1, "exposure older than max_lateness; recorded, not fused");
    return;
  }
  ++counts_.exposures_used;
  const std::uint32_t blind = projector_.blind_lenses(exposure.camera, exposure.image.lost);
  counts_.lenses_lost += static_cast<std::uint64_t>(std::popcount(blind));
  tell_lenses(exposure, timeline_.add(exposure, camera, view, blind));
}

/// Tells a moment when, and with which gain, the lenses of a camera were exposed.
void Colouring::tell_lenses(const Exposure& exposure, Moment& moment) const {
  for (std::size_t i = 0; i < rig_.head.lenses.size(); ++i) {
    const LensMount& lens = rig_.head.lenses[i];
    if (lens.camera != exposure.camera) continue;
    if (const ReportedExposure* part = report_of(exposure.image, lens)) {
      moment.reported.resize(rig_.head.lenses.size());
      moment.reported[i] = *part;
    }
    moment.lateness[i] = lateness_at(exposure, lens, moment.time);
  }
}

bool Colouring::is_ready(const PlacedBatch& batch) const {
  const GpsTime end = batch.last + reach_ahead();
  // Exposures come in order of time, so a whole moment beyond the end is as good as the watermark. An exposure that is
  // due before the end, but has not come, may be late.
  const auto newest = timeline_.newest();
  const bool is_one_due = newest && *newest + timeline_.interval() <= end;
  const bool is_past = watermark_ && *watermark_ >= (is_one_due ? end + config_.max_lateness : end);
  if (!is_past && !timeline_.has_whole_after(end)) return false;
  for (std::size_t i = 0; i < timeline_.size(); ++i) {
    const Moment& moment = timeline_.at(static_cast<int>(i));
    if (moment.time > end) break;
    if (moment.time + reach_behind() >= batch.batch.time && !moment.is_pose_final) return false;
  }
  return true;
}

void Colouring::advance(GpsTime watermark) {
  watermark_ = watermark_ ? std::max(*watermark_, watermark) : watermark;
  const bool is_crowded = counts_.pending_returns > config_.max_pending_returns;
  const GpsTime newest = pending_.empty() ? *watermark_ : pending_.back().time;
  const bool is_new = *watermark_ >= worked_until_ + kAdvance || std::chrono::abs(newest - worked_newest_) >= kAdvance;
  if (!is_new && !is_crowded) return;
  worked_until_ = *watermark_;
  worked_newest_ = newest;
  const std::size_t before = coloured_;
  place_ready(false);
  colour_ready(false);
  // Going through everything that waits at each call would cost more than the colouring.
  if (coloured_ != before || placed_.empty() || timeline_.size() > config_.max_held_moments) forget();
}

void Colouring::flush() {
  place_ready(true);
  colour_ready(true);
  forget();
}

/// Returns a batch that has its number, and memory for its places.
PlacedBatch Colouring::unplaced(StampedLaserBatch&& batch) {
  PlacedBatch out;
  if (!coloured_spare_.empty()) {
    out.placed = std::move(coloured_spare_.back());
    coloured_spare_.pop_back();
  }
  if (!gone_spare_.empty()) {
    out.placed.places = std::move(gone_spare_.back().placed.places);
    out.on_skin = std::move(gone_spare_.back().on_skin);
    out.on_skin.clear();
    gone_spare_.pop_back();
  }
  out.batch = std::move(batch);
  out.number = next_number_++;
  return out;
}

void Colouring::place_ready(bool everything) {
  const std::size_t first = placed_.size();
  while (!pending_.empty()) {
    const GpsTime last = last_firing(pending_.front());
    const bool is_forced = counts_.pending_returns > config_.max_pending_returns;
    const bool is_settled = trajectory_.is_settled(last) || (watermark_ && *watermark_ >= last + config_.max_lateness);
    if (!everything && !is_settled && !is_forced) break;
    placed_.push_back(unplaced(std::move(pending_.front())));
    placed_.back().last = last;
    pending_.pop_front();
  }
  pool_->run(placed_.size() - first, [&](std::size_t i) {
    PlacedBatch& batch = placed_[first + i];
    georeference(batch.batch, lasers_.at(batch.batch.sensor), trajectory_, config_.pose_step, batch.placed);
  });
  if (config_.choice == ExposureChoice::Visible) visibility_.add(placed_, everything, *pool_);
  resolve_viewpoints(everything);
  if (provisional_sink_ && placed_.size() > first) colour_provisionally(first);
}

void Colouring::map_depths(GpsTime from, GpsTime to) {
  if (config_.choice != ExposureChoice::Visible) return;
  std::vector<Moment*> moments;
  for (std::size_t i = 0; i < timeline_.size(); ++i) {
    Moment& moment = timeline_.at(static_cast<int>(i));
    if (!moment.viewpoint || moment.time < from - reach_behind() || moment.time > to + neighbour_reach()) continue;
    moments.push_back(&moment);
  }
  visibility_.map(moments, placed_, *pool_);
}

void Colouring::colour_ready(bool everything) {
  if (coloured_ == placed_.size()) return;
  std::size_t count = 0;
  bool is_mapped = false;
  while (coloured_ + count < placed_.size()) {
    const bool is_forced = counts_.pending_returns > config_.max_pending_returns;
    if (!everything && !is_ready(placed_[coloured_ + count])) {
      if (!is_forced) break;
      ++counts_.forced_batches;
    }
    if (!is_mapped) {
      const GpsTime to = placed_[coloured_ + count].last + timeline_.interval();
      map_depths(placed_[coloured_ + count].batch.time, to);
      measure_light(to);
    }
    is_mapped = true;
    counts_.pending_returns -= placed_[coloured_ + count].batch.returns.size();
    if (++count == kBatchesAtOnce) {
      colour_batches(count);
      count = 0;
    }
  }
  if (count > 0) colour_batches(count);
}

void Colouring::resolve_viewpoints(bool everything) {
  for (std::size_t i = 0; i < timeline_.size(); ++i) {
    Moment& moment = timeline_.at(static_cast<int>(i));
    if (moment.is_pose_final) continue;
    const bool is_moved = projector_.is_rolling() || moment.is_spread();
    const nanoseconds around = is_moved ? kMotionAround : nanoseconds(0);
    const bool is_final = everything || trajectory_.is_settled(moment.time + around) ||
                          (watermark_ && *watermark_ >= moment.time + config_.max_lateness);
    if (!is_final) continue;
    moment.is_pose_final = true;
    const auto [pose, reason] = trajectory_.pose_at(moment.time);
    if (!pose) {
      ++counts_.moments_without_pose;
      continue;
    }
    const Transform<CameraHead, Enu> T_head_enu = (pose->T_enu_body * rig_.head.T_body_head).inverse();
    const Eigen::Matrix3d R = T_head_enu.rotation.toRotationMatrix();
    Moment::Viewpoint viewpoint;
    for (int k = 0; k < 9; ++k) viewpoint.R_head_enu[static_cast<std::size_t>(k)] = static_cast<float>(R(k / 3, k % 3));
    viewpoint.centre_enu = T_head_enu.inverse().translation;
    viewpoint.leapt = pose->leapt;
    viewpoint.eyes = projector_.eyes();
    if (is_moved) viewpoint.motion = motion_at(trajectory_, moment.time, rig_.head.T_body_head);
    viewpoint.motion.lateness = moment.lateness;
    moment.viewpoint = viewpoint;
    drop_frozen(moment);
  }
}

void Colouring::drop_frozen(Moment& moment) {
  constexpr double kMoved_m = 0.05,
                   kTurned = 2e-3;  // a standing vehicle may see the same picture twice if nothing moves
  fresh_.resize(moment.pictures.size());
  for (std::size_t camera = 0; camera < moment.pictures.size(); ++camera) {
    if (moment.has_image[camera] == 0) continue;
    std::optional<Fresh>& fresh = fresh_[camera];
    if (!fresh || fresh->content != moment.pictures[camera].content) {
      fresh = Fresh{moment.pictures[camera].content, *moment.viewpoint};
      continue;
    }
    const double moved = (moment.viewpoint->centre_enu - fresh->viewpoint.centre_enu).norm();
    double turned = 0;
    for (std::size_t k = 0; k < 9; ++k)
      turned = std::max(
          turned, std::abs(static_cast<double>(moment.viewpoint->R_head_enu[k] - fresh->viewpoint.R_head_enu[k])));
    if (moved < kMoved_m && turned < kTurned) continue;
    ++counts_.exposures_frozen;
    note(projector_.cameras()[camera], FaultKind::Spurious, 1,
         "the same picture as before, though the vehicle has moved: the camera is frozen; not used");
    moment.has_image[camera] = 0;
  }
  if (std::none_of(moment.has_image.begin(), moment.has_image.end(), [](std::uint8_t has) { return has != 0; }))
    moment.viewpoint.reset();
}

/// Colours `count` placed batches from `first` on into block_, provisionally or for good. Returns the number of points.
std::size_t Colouring::fill_block(std::size_t first, std::size_t count, bool is_provisional,
                                  const HeadGains* usual_gains) {
  if (pieces_.size() < count) pieces_.resize(count);
  std::vector<std::size_t> begin(count);
  std::size_t total = 0;
  for (std::size_t i = 0; i < count; ++i) {
    begin[i] = total;
    total += placed_[first + i].placed.size();
  }
  block_.points.resize(total);
  pool_->run(count, [&](std::size_t i) {
    pieces_[i].is_provisional = is_provisional;
    pieces_[i].keeps_judged = sight_sink_ && !is_provisional;
    pieces_[i].judged.clear();
    pieces_[i].usual_gains = usual_gains;
    colour_piece(placed_[first + i], pieces_[i], block_.points.data() + begin[i]);
  });
  judged_.clear();
  for (std::size_t i = 0; i < count && sight_sink_; ++i)
    for (JudgedSight judged : pieces_[i].judged) {
      judged.point += static_cast<std::uint32_t>(begin[i]);
      judged_.push_back(judged);
    }
  if (total > 0) block_.origin = *trajectory_.origin();  // a point was placed, so there was a solution
  return total;
}

void Colouring::colour_batches(std::size_t count) {
  const std::size_t begin = coloured_, total = fill_block(begin, count, false, nullptr);
  for (std::size_t i = 0; i < count; ++i) {
    const GeoreferencedBatch& placed = placed_[begin + i].placed;
    counts_.empty_returns += placed.empty;
    for (std::size_t k = 0; k < kNoPoseReasons; ++k) counts_.no_pose[k] += placed.no_pose[k];
    for (std::size_t k = 0; k < kColourStates; ++k) counts_.by_state[k] += pieces_[i].by_state[k];
  }
  counts_.points += total;
  coloured_ += count;
  for (std::size_t i = 0; i < count; ++i) {
    // Only the places are needed later.
    PlacedBatch& batch = placed_[begin + i];
    kept_returns_ += batch.placed.size();
    batch.batch.returns = {};
    GeoreferencedBatch kept;
    kept.places = std::move(batch.placed.places);
    kept.scanner_enu = batch.placed.scanner_enu;
    std::swap(batch.placed, kept);
    if (coloured_spare_.size() < placed_.size() - coloured_ + kBatchesAtOnce)
      coloured_spare_.push_back(std::move(kept));
  }
  if (total > 0 && sight_sink_) sight_sink_(block_, judged_);
  if (total > 0) sink_(block_);
}

/// Colours the placed batches from `first` on with what is there.
void Colouring::colour_provisionally(std::size_t first) {
  std::vector<Moment*> unmapped;
  const HeadGains* gains = nullptr;
  for (std::size_t i = 0; i < timeline_.size(); ++i) {
    Moment& moment = timeline_.at(static_cast<int>(i));
    if (moment.viewpoint && !moment.standing && !moment.early) unmapped.push_back(&moment);
    if (moment.gains) gains = &*moment.gains;
  }
  if (config_.choice == ExposureChoice::Visible && !unmapped.empty()) visibility_.map_early(unmapped, *pool_);
  if (fill_block(first, placed_.size() - first, true, gains) > 0) provisional_sink_(block_);
}

void Colouring::forget() {
  while (timeline_.size() > config_.max_held_moments) {
    timeline_.drop_oldest();
    ++counts_.moments_crowded_out;
  }
  if (!watermark_) return;
  GpsTime oldest = *watermark_ - config_.max_lateness;
  for (const StampedLaserBatch& batch : pending_) oldest = std::min(oldest, batch.time);
  for (std::size_t i = coloured_; i < placed_.size(); ++i) oldest = std::min(oldest, placed_[i].batch.time);
  timeline_.forget_before(oldest - reach_behind());
  if (config_.choice == ExposureChoice::Visible) timeline_.keep_steps_before(oldest - neighbour_reach());
  trajectory_.forget_before(oldest - reach_behind());
  // Visibility still holds the batches of turns that have not ended.
  const auto is_in_open_turn = [&](const PlacedBatch& batch) {
    return config_.choice == ExposureChoice::Visible && batch.turn == 0 && batch.placed.places.size() > 0;
  };
  while (coloured_ > 0 && !is_in_open_turn(placed_.front()) &&
         (placed_.front().batch.time < oldest - reach_behind() || kept_returns_ > config_.max_pending_returns)) {
    kept_returns_ -= placed_.front().placed.places.size();
    if (gone_spare_.size() < placed_.size()) gone_spare_.push_back(std::move(placed_.front()));
    placed_.pop_front();
    --coloured_;
  }
  visibility_.forget_before(oldest - reach_behind());
}

}  // namespace hueline::fusion
