#include "calibration/lens/lens_calibration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/median.hpp"

namespace hueline::calibration {
namespace {

// Median radius of a plane normal distribution, in standard deviations of one coordinate.
constexpr double kMedianOfRadius = 1.1774;
constexpr double kRobust_px = 1.0;
constexpr double kGoodFit_px = 0.5;
constexpr int kRounds = 4;
constexpr std::size_t kFewestToBend = 6;  // views that determine a bent board beside the lens
constexpr double kLeastBendGain = 5;      // F of 7 and hundreds of degrees of freedom: by chance 1 in 100 000
constexpr double kVagueFocal =
    0.02;  // From this ratio of standard deviation to focal length on, the views count as too weak to determine a lens.

double rms(const std::vector<Eigen::Vector2d>& residuals) {
  double sum = 0;
  for (const auto& r : residuals) sum += r.squaredNorm();
  return residuals.empty() ? 0 : std::sqrt(sum / static_cast<double>(residuals.size()));
}

double median_radius(const AdjustedLens& adjusted) {
  std::vector<double> radii;
  for (const auto& residuals : adjusted.residuals)
    for (const auto& r : residuals) radii.push_back(r.norm());
  return median(std::move(radii));
}

/// Returns the best adjustment of all starts, with a robust loss that limits the influence of bad corners. Views that
/// no start can pose are listed in `rejected` and removed from `views`.
Result<AdjustedLens> first_adjustment(const Board& board, std::vector<BoardView>& views,
                                      std::vector<RejectedView>& rejected, LensModel model, std::uint32_t width,
                                      std::uint32_t height, bool one_focal) {
  std::vector<LensValues> starts;
  if (model == LensModel::Brown)
    if (const auto zhang = zhang_start(board, views, width, height)) starts.push_back(*zhang);
  const auto swept = swept_starts(model, board, views, width, height);
  starts.insert(starts.end(), swept.begin(), swept.end());
  std::optional<AdjustedLens> best;
  std::vector<bool> best_posed;
  std::size_t most_views = 0;
  std::string why = "no start";
  for (const LensValues& start : starts) {
    std::vector<bool> posed;
    std::vector<BoardView> usable;
    for (const BoardView& view : views) {
      posed.push_back(board_pose(board, view, start).has_value());
      if (posed.back()) usable.push_back(view);
    }
    if (usable.size() < 3 || usable.size() < most_views) continue;
    auto adjusted = adjust_lens(board, usable, start, {.one_focal = one_focal, .robust_px = kRobust_px});
    if (!adjusted.ok()) {
      why = adjusted.error().message;
      continue;
    }
    if (!best || usable.size() > most_views || adjusted->cost < best->cost) {
      best = std::move(*adjusted);
      best_posed = posed;
      most_views = usable.size();
    }
    // The fit is as good as the corners themselves. Another start could only reach the same optimum, or one better by
    // noise.
    if (most_views == views.size() && median_radius(*best) < kGoodFit_px) break;
  }
  if (!best) return Error{ErrorCode::Unavailable, why};
  std::vector<BoardView> kept;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (best_posed[i])
      kept.push_back(std::move(views[i]));
    else
      rejected.push_back({views[i].name, "no start value of its pose can be computed"});
  }
  views = std::move(kept);
  return std::move(*best);
}

/// Removes views, then corners, that disagree with the rest. Returns whether it removed any.
bool reject(LensCalibration& calibration, const LensCalibrationConfig& config) {
  AdjustedLens& adjusted = calibration.adjusted;
  std::vector<double> view_rms;
  for (const auto& residuals : adjusted.residuals) view_rms.push_back(rms(residuals));
  const double usual = median(view_rms), limit = config.corner_limit_sigma * median_radius(adjusted) / kMedianOfRadius;
  bool any = false;
  std::vector<BoardView> kept;
  std::vector<BoardView>& views = calibration.views;
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (view_rms[v] > config.view_limit * usual && usual > 0) {
      // A view with a few bad corners stays without them. A view that is mostly bad is removed.
      const auto bad = std::count_if(adjusted.residuals[v].begin(), adjusted.residuals[v].end(),
                                     [&](const auto& r) { return r.norm() > limit; });
      if (4 * static_cast<std::size_t>(bad) > adjusted.residuals[v].size()) {
        calibration.rejected_views.push_back(
            {views[v].name,
             fmt::format("its rms is {:.3f} px, the median of all views is {:.3f} px", view_rms[v], usual)});
        any = true;
        continue;
      }
    }
    BoardView view{views[v].name, {}};
    for (std::size_t c = 0; c < views[v].corners.size(); ++c) {
      const double error = adjusted.residuals[v][c].norm();
      if (error > limit && limit > 0) {
        calibration.rejected_corners.push_back(
            {view.name, views[v].corners[c].index, views[v].corners[c].pixel, error});
        any = true;
      } else {
        view.corners.push_back(views[v].corners[c]);
      }
    }
    if (view.corners.size() < 6) {
      calibration.rejected_views.push_back({view.name, "fewer than 6 good corners"});
      any = true;
      continue;
    }
    kept.push_back(std::move(view));
  }
  views = std::move(kept);
  return any;
}

/// Lists and removes views that the present lens cannot pose. They would make the adjustment of all others fail.
void drop_unposable(LensCalibration& calibration) {
  std::erase_if(calibration.views, [&](const BoardView& view) {
    if (board_pose(calibration.board, view, calibration.adjusted.lens)) return false;
    calibration.rejected_views.push_back({view.name, "the lens that fits the other views gives no pose for it"});
    return true;
  });
}

/// Adjusts lens and poses, and the bend of the board if `is_bent`, by least squares, until no view and no corner
/// disagrees with the rest. Starts with the views and the lens of `out`.
Status settle(bool is_bent, const LensCalibrationConfig& config, LensCalibration& out) {
  for (int round = 0; round < kRounds; ++round) {
    const bool any = reject(out, config);
    drop_unposable(out);
    if (out.views.size() < 3) return Error{ErrorCode::Unavailable, "fewer than three views agree with each other"};
    if (round > 0 && !any) break;
    auto again =
        adjust_lens(out.board, out.views, out.adjusted.lens, {.one_focal = config.one_focal, .is_bent = is_bent});
    if (!again.ok()) return again.error();
    out.adjusted = std::move(*again);
    out.board.bend_m = out.adjusted.bend_m;
  }
  for (int i = 0; i < 2; ++i) {
    const double sigma = out.adjusted.focal_noise_px[i];
    if (!(sigma < kVagueFocal * out.adjusted.lens.focal_px[i]))
      return Error{ErrorCode::Unavailable,
                   fmt::format("the views do not determine the focal length ({:.1f} px +- {:.1f}): tilt the board "
                               "against the image, differently in each view",
                               out.adjusted.lens.focal_px[i], sigma)};
  }
  return {};
}

/// Judges a lens by a view to which it was not fitted, and adds the errors to `sum` and `count`. Returns why the lens
/// fails on the view, or an empty text.
std::string judge_held(const Board& board, const BoardView& view, const LensValues& lens, double& sum,
                       std::size_t& count) {
  for (std::size_t half = 0; half < 2; ++half) {
    BoardView posing{view.name, {}}, judging{view.name, {}};
    for (std::size_t c = 0; c < view.corners.size(); ++c)
      (c % 2 == half ? posing : judging).corners.push_back(view.corners[c]);
    const auto pose = resect_board(board, posing, lens);
    if (!pose) return "the board cannot be posed";
    for (const SeenCorner& corner : judging.corners) {
      const auto pixel = lens.project(pose->to_lens(board.corner(corner.index)));
      if (!pixel) return fmt::format("corner {} has no pixel", corner.index);
      sum += (*pixel - corner.pixel).squaredNorm();
      ++count;
    }
  }
  return {};
}

/// Judges a lens by held-back views: every other corner gives the pose of a view, and the remaining corners give the
/// error. Views with too few corners for two halves are not judged.
void predict(const LensCalibration& full, const LensCalibrationConfig& config, ModelTrial& trial) {
  constexpr std::size_t kFewestToHalve = 8;  // four corners for the homography of each half
  const int folds = std::min(config.folds, static_cast<int>(full.views.size()));
  double sum = 0;
  std::size_t count = 0;
  for (int fold = 0; fold < folds; ++fold) {
    std::vector<BoardView> rest, held;
    for (std::size_t v = 0; v < full.views.size(); ++v)
      (static_cast<int>(v) % folds == fold ? held : rest).push_back(full.views[v]);
    if (rest.size() < 3) return;  // too few views to hold any back
    const auto adjusted =
        adjust_lens(full.board, rest, full.adjusted.lens, {.one_focal = config.one_focal, .is_bent = full.is_bent()});
    Board board = full.board;
    if (adjusted.ok()) board.bend_m = adjusted->bend_m;
    for (const BoardView& view : held) {
      if (view.corners.size() < kFewestToHalve) continue;
      const std::string why = adjusted.ok() ? judge_held(board, view, adjusted->lens, sum, count)
                                            : "the other views alone give no lens: " + adjusted.error().message;
      if (!why.empty()) trial.unpredicted.push_back({view.name, why});
    }
  }
  if (trial.unpredicted.empty() && count > 0) trial.predicted_rms_px = std::sqrt(sum / static_cast<double>(count));
}

/// Fits a bent board. Returns nothing if the views do not show that it is bent: the squares of the residuals of `flat`
/// become smaller by what chance gives in one of a hundred thousand calibrations, or views that are held back are
/// predicted no better. `start`: the first adjustment, whose views and corners are all there, because a bent board's
/// outer corners may have been left out.
std::optional<LensCalibration> with_bend(const LensCalibration& start, const LensCalibration& flat,
                                         const LensCalibrationConfig& config) {
  if (flat.views.size() < kFewestToBend) return std::nullopt;
  const auto trial =
      adjust_lens(flat.board, flat.views, flat.adjusted.lens, {.one_focal = config.one_focal, .is_bent = true});
  if (!trial.ok()) return std::nullopt;
  const int redundancy = trial->observations - trial->unknowns;
  // Where the errors of a view's corners are alike, the gain by chance is larger, too.
  const double alike = std::max(1.0, trial->disagreement * trial->disagreement);
  const double gain =
      (flat.adjusted.cost - trial->cost) / static_cast<double>(kBendTerms) / (trial->cost / redundancy) / alike;
  if (!(gain > kLeastBendGain)) return std::nullopt;
  LensCalibration out = start;
  out.adjusted.lens = trial->lens;
  out.board.bend_m = trial->bend_m;
  drop_unposable(out);
  auto first = adjust_lens(out.board, out.views, trial->lens,
                           {.one_focal = config.one_focal, .is_bent = true, .robust_px = kRobust_px});
  if (!first.ok()) return std::nullopt;
  out.adjusted = std::move(*first);
  out.board.bend_m = out.adjusted.bend_m;
  if (!settle(true, config, out).ok()) return std::nullopt;
  ModelTrial as_flat, as_bent;
  predict(flat, config, as_flat);
  predict(out, config, as_bent);
  if (!as_bent.predicted_rms_px || (as_flat.predicted_rms_px && *as_bent.predicted_rms_px >= *as_flat.predicted_rms_px))
    return std::nullopt;
  return out;
}

Result<LensCalibration> with_model(const Board& board, std::vector<BoardView> views, std::uint32_t width,
                                   std::uint32_t height, LensModel model, const LensCalibrationConfig& config) {
  LensCalibration out;
  out.board = board;
  auto first = first_adjustment(board, views, out.rejected_views, model, width, height, config.one_focal);
  if (!first.ok()) return first.error();
  out.views = std::move(views);
  out.adjusted = std::move(*first);
  const LensCalibration start = out;
  if (const Status settled = settle(false, config, out); !settled.ok()) return settled.error();
  if (auto bent = with_bend(start, out, config)) return std::move(*bent);
  return out;
}

}  // namespace

std::string ModelTrial::words() const {
  if (!failure.empty()) return failure;
  std::string out = fmt::format("rms {:.4f} px", rms_px);
  if (predicted_rms_px) return out + fmt::format(", of views held back {:.4f} px", *predicted_rms_px);
  if (unpredicted.empty()) return out + "; too few views to hold any back";
  out += fmt::format(", fails on {} of the views held back", unpredicted.size());
  constexpr std::size_t kNamed = 3;
  std::vector<std::string> reasons;
  for (const RejectedView& one : unpredicted)
    if (std::ranges::find(reasons, one.why) == reasons.end()) reasons.push_back(one.why);
  for (std::size_t r = 0; r < reasons.size(); ++r) {
    std::string names;
    std::size_t count = 0;
    for (const RejectedView& one : unpredicted)
      if (one.why == reasons[r] && ++count <= kNamed) names += (count > 1 ? ", " : "") + one.view;
    out += fmt::format("{} {}{}: {}", r ? ";" : ":", names,
                       count > kNamed ? fmt::format(" and {} more", count - kNamed) : "", reasons[r]);
  }
  return out;
}

std::string LensCalibrationConfig::validate() const {
  if (!(corner_limit_sigma >= 3))
    return fmt::format("corner_limit_sigma is {}; allowed: 3 or more", corner_limit_sigma);
  if (!(view_limit >= 1.5)) return fmt::format("view_limit is {}; allowed: 1.5 or more", view_limit);
  if (folds < 2) return fmt::format("folds is {}; allowed: 2 or more", folds);
  return {};
}

Result<LensCalibration> calibrate_lens(const Board& board, const std::vector<BoardView>& views, std::uint32_t width,
                                       std::uint32_t height, const LensCalibrationConfig& config) {
  for (const std::string& wrong : {board.validate(), config.validate()})
    if (!wrong.empty()) return Error{ErrorCode::Invalid, wrong};
  if (width < 16 || height < 16) return Error{ErrorCode::Invalid, "the images are smaller than 16 x 16 px"};
  if (views.size() < 3)
    return Error{ErrorCode::Invalid,
                 fmt::format("{} views with the board; 3 are needed, 10 or more are better", views.size())};
  for (const BoardView& view : views) {
    if (view.corners.size() < 6)
      return Error{ErrorCode::Invalid, fmt::format("{}: {} corners, 6 are needed", view.name, view.corners.size())};
    for (const SeenCorner& corner : view.corners)
      if (corner.index >= board.corner_count() || !corner.pixel.allFinite())
        return Error{ErrorCode::Invalid, fmt::format("{}: corner {} is none of the board's {}", view.name, corner.index,
                                                     board.corner_count())};
  }
  std::optional<LensCalibration> best;
  std::vector<ModelTrial> trials;
  double best_rms = 0;
  bool best_is_predicted = false;
  for (const LensModel model : {LensModel::Brown, LensModel::KannalaBrandt}) {
    if (config.model && *config.model != model) continue;
    auto one = with_model(board, views, width, height, model, config);
    ModelTrial trial;
    trial.model = model;
    if (!one.ok()) {
      trial.failure = one.error().message;
    } else {
      trial.rms_px = one->adjusted.rms_px;
      predict(*one, config, trial);
      // The error is scaled by the share of views used, so that a model gains nothing by removing views.
      const double judged = trial.predicted_rms_px.value_or(trial.rms_px) * static_cast<double>(views.size()) /
                            static_cast<double>(one->views.size());
      const bool is_candidate = trial.unpredicted.empty() || config.model;
      // An error measured on held-back views ranks before the error of a fit, which is smaller by nature.
      const bool outranks = !best || trial.predicted_rms_px.has_value() > best_is_predicted ||
                            (trial.predicted_rms_px.has_value() == best_is_predicted && judged < best_rms);
      if (is_candidate && outranks) {
        best_rms = judged;
        best_is_predicted = trial.predicted_rms_px.has_value();
        best = std::move(*one);
      }
    }
    trials.push_back(trial);
  }
  if (!best) {
    std::string why;
    for (const ModelTrial& t : trials)
      why += fmt::format("{}{}: {}", why.empty() ? "" : "; ", name(t.model), t.words());
    if (std::ranges::any_of(trials, [](const ModelTrial& t) { return !t.unpredicted.empty(); }))
      why += ". Leave those views out, or choose a --model";
    return Error{ErrorCode::Unavailable, why};
  }
  best->trials = std::move(trials);
  best->two_lenses = find_two_lenses(board, best->views, best->adjusted, config.one_focal);
  return std::move(*best);
}

}  // namespace hueline::calibration
