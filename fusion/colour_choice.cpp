#include <algorithm>
#include <cmath>
#include <optional>

#include "fusion/colouring.hpp"
#include "fusion/colouring_piece.hpp"

/// Chooses the exposure that gives a point its colour, and samples the colour.
namespace hueline::fusion {
namespace {

std::uint8_t to_byte(float value) { return static_cast<std::uint8_t>(std::clamp(value + 0.5f, 0.0f, 255.0f)); }

/// Returns how far stamps can be trusted in this state, 0 to 1.
float trust(SyncState state) {
  switch (state) {
    case SyncState::Locked:
      return 1.0f;
    case SyncState::Holdover:
      return 0.7f;
    case SyncState::Acquiring:
      return 0.5f;
    case SyncState::Unlocked:
      return 0.25f;
  }
  return 0.25f;
}

struct HeadPoint {
  float x, y, z;
};

/// The difference is calculated in double precision, because ENU coordinates of a long drive do not fit a float.
HeadPoint in_head(const Moment::Viewpoint& view, double east, double north, double up) {
  const auto dx = static_cast<float>(east - view.centre_enu.x()), dy = static_cast<float>(north - view.centre_enu.y()),
             dz = static_cast<float>(up - view.centre_enu.z());
  const auto& R = view.R_head_enu;
  return {R[0] * dx + R[1] * dy + R[2] * dz, R[3] * dx + R[4] * dy + R[5] * dz, R[6] * dx + R[7] * dy + R[8] * dz};
}

Rgb sample_sight(const FloatLens& lens, const Moment::Picture& picture, const Sight& sight) {
  const auto x = static_cast<int>(sight.x),
             y = static_cast<int>(sight.y);  // not negative, because it is at least kSampleReach
  return sample(picture.view, x + static_cast<int>(lens.x_offset), y + static_cast<int>(lens.y_offset),
                sight.x - static_cast<float>(x), sight.y - static_cast<float>(y));
}

constexpr float kFullBorder = 64.0f;        // distance from the border, px, from which the quality is not reduced
constexpr std::size_t kGainSamples = 4096;  // returns that are used to measure the gain of one owner
constexpr std::size_t kGainEnough = 32;     // fewest common points to measure a gain
constexpr float kGainDark = 8.0f, kGainBright = 247.0f;  // beyond these limits there is noise or saturation
constexpr float kGainLimit = 4.0f;
constexpr float kBelowHorizon = 0.3f;  // sine of the depression angle beyond which a point counts as near the hole

/// Returns the colour that the exposures of a moment show at a place, 0 to 255, or nothing if they do not show it.
/// `depression` is set to the sine of the angle below the head's horizon.
std::optional<std::array<float, 3>> colour_at(const HeadProjector& projector, const Moment& moment,
                                              const Eigen::Vector3d& p_enu, float& depression) {
  if (!moment.viewpoint) return std::nullopt;
  const HeadPoint h = in_head(*moment.viewpoint, p_enu.x(), p_enu.y(), p_enu.z());
  Sight sight;
  if (!projector.see(h.x, h.y, h.z, moment.has_image.data(), moment.blind, sight)) return std::nullopt;
  depression = -h.z / std::sqrt(h.x * h.x + h.y * h.y + h.z * h.z);
  const FloatLens& lens = projector.lenses()[sight.lens];
  const Rgb c = sample_sight(lens, moment.pictures[lens.camera], sight);
  return std::array<float, 3>{c.red, c.green, c.blue};
}

/// Ratios of the owner's colour to that of one neighbour, in each channel. Those of points below the horizon are kept
/// separately, because these points lie around the hole that is filled.
struct ColourRatios {
  std::array<std::vector<float>, 3> around, below;

  void add(const std::array<float, 3>& in_owner, const std::array<float, 3>& in_neighbour, bool is_below) {
    for (std::size_t c = 0; c < 3; ++c) {
      const float a = in_owner[c], b = in_neighbour[c];
      if (a < kGainDark || b < kGainDark || a > kGainBright || b > kGainBright) continue;
      around[c].push_back(a / b);
      if (is_below) below[c].push_back(a / b);
    }
  }
  /// Sets the gain to the medians, because moving objects, edges and parallax disturb both ends in the same way.
  /// Returns false if a channel has too few ratios; its gain is then left as it is. Reorders the ratios.
  bool measure(std::array<float, 3>& gain) {
    bool is_measured = true;
    for (std::size_t c = 0; c < 3; ++c) {
      std::vector<float>& ratios = below[c].size() >= kGainEnough ? below[c] : around[c];
      if (ratios.size() < kGainEnough) {
        is_measured = false;
        continue;
      }
      const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
      std::nth_element(ratios.begin(), middle, ratios.end());
      gain[c] = std::clamp(*middle, 1.0f / kGainLimit, kGainLimit);
    }
    return is_measured;
  }
};

}  // namespace

bool Colouring::try_moment(const Moment& moment, const ColourGain* gain, ColouredPoint& point) const {
  if (!moment.viewpoint) return false;
  const HeadPoint p = in_head(*moment.viewpoint, point.east, point.north, point.up);
  Sight sight;
  if (!projector_.see(p.x, p.y, p.z, moment.has_image.data(), moment.blind, sight)) return false;
  const FloatLens& lens = projector_.lenses()[sight.lens];
  const Moment::Picture& picture = moment.pictures[lens.camera];
  Rgb colour = sample_sight(lens, picture, sight);
  if (gain != nullptr) {
    colour.red *= gain->gain[0];
    colour.green *= gain->gain[1];
    colour.blue *= gain->gain[2];
  }
  point.red = to_byte(colour.red);
  point.green = to_byte(colour.green);
  point.blue = to_byte(colour.blue);
  point.exposure = picture.exposure;
  point.lens = sight.lens;
  if (projector_.method() == ColourMethod::Panorama) {
    projector_.panorama_pixel(p.x, p.y, p.z, point.u, point.v);
  } else {
    point.u = sight.x;
    point.v = sight.y;
  }
  const auto away = static_cast<float>(std::abs((point.time - moment.time).count()));
  const auto interval = static_cast<float>(timeline_.interval().count());
  const float timely = interval / (interval + away);
  const float border = std::min(1.0f, sight.border_px / kFullBorder);
  const float stamped = trust(moment.state) * (moment.timing == ExposureTiming::EventMark ? 1.0f : 0.8f);
  point.quality = static_cast<std::uint8_t>(1.0f + 254.0f * timely * border * stamped);
  return true;
}

void Colouring::colour_point(int owner, Piece& piece, ColouredPoint& point) const {
  if (owner >= 0 && try_moment(timeline_.at(owner), nullptr, point)) {
    point.state = ColourState::Direct;
    return;
  }
  // An owner without a pose is treated as a lost image.
  const bool is_lost = owner < 0 || !timeline_.at(owner).viewpoint;
  const int per_side = is_lost ? config_.lost_image_neighbours : config_.neighbours;
  const nanoseconds reach = timeline_.interval() * per_side + timeline_.interval() / 2 + config_.window_slack;
  if (per_side > 0) {
    timeline_.neighbours_of(point.time, reach, per_side, owner, piece.candidates);
    for (const int candidate : piece.candidates) {
      const Moment& neighbour = timeline_.at(candidate);
      const ColourGain* gain = is_lost ? nullptr : timeline_.at(owner).gain_of(neighbour.serial);
      if (!try_moment(neighbour, gain, point)) continue;
      point.state = ColourState::Neighbour;
      return;
    }
  }
  const bool has_asked = !is_lost || (per_side > 0 && !piece.candidates.empty());
  point.state = has_asked ? ColourState::Outside : ColourState::NoExposure;
}

void Colouring::colour_piece(const StampedLaserBatch& batch, Piece& piece, ColouredPoint* points) const {
  piece.by_state.fill(0);
  const GeoreferencedBatch& placed = piece.placed;
  // A batch lasts about a millisecond and a window at least a tenth of a second, so nearly always one moment owns the
  // whole batch.
  const int owner_of_first = timeline_.owner_of(batch.time), owner_of_last = timeline_.owner_of(last_firing(batch));
  const bool is_one_window = owner_of_first == owner_of_last && owner_of_first >= 0;
  for (std::size_t i = 0; i < placed.size(); ++i) {
    const LaserReturn& r = batch.returns[placed.source[i]];
    ColouredPoint& point = points[i];
    point.east = placed.east[i];
    point.north = placed.north[i];
    point.up = placed.up[i];
    point.sigma_m = placed.sigma_m[i];
    point.time = batch.time + nanoseconds(r.time_offset_ns);
    point.reflectivity = r.reflectivity;
    point.return_number = r.return_number;
    point.return_count = r.return_count;
    point.channel = r.channel;
    point.sensor = batch.sensor;
    colour_point(is_one_window && r.time_offset_ns >= 0 ? owner_of_first : timeline_.owner_of(point.time), piece,
                 point);
    ++piece.by_state[static_cast<std::size_t>(point.state)];
  }
}

void Colouring::measure_gains(Moment& owner, int owner_index, const std::vector<StampedLaserBatch>& batches) {
  owner.gains.emplace();
  if (!owner.viewpoint) return;
  std::vector<int> neighbours;
  timeline_.neighbours_of(owner.time, neighbour_reach() + timeline_.interval(), config_.neighbours, owner_index,
                          neighbours);
  std::vector<const StampedLaserBatch*> own;
  std::size_t returns = 0;
  const auto collect = [&](const StampedLaserBatch& batch) {
    if (timeline_.owner_of(batch.time) != owner_index) return;
    own.push_back(&batch);
    returns += batch.returns.size();
  };
  for (const StampedLaserBatch& batch : batches) collect(batch);
  for (const StampedLaserBatch& batch : pending_) collect(batch);

  std::vector<ColourRatios> ratios(neighbours.size());
  const std::size_t stride = std::max<std::size_t>(1, returns / kGainSamples);
  std::size_t counter = 0;
  for (const StampedLaserBatch* batch : own) {
    const LaserMount& mount = lasers_.at(batch->sensor);
    for (const LaserReturn& r : batch->returns) {
      if (counter++ % stride != 0 || !(r.range_m > 0)) continue;
      const auto [pose, reason] = trajectory_.pose_at(batch->time + nanoseconds(r.time_offset_ns));
      if (!pose) continue;
      const Eigen::Vector3d p = (pose->T_enu_body * (mount.T_body_scanner * Point<Scanner>{{r.x, r.y, r.z}})).xyz;
      float depression = 0, unused = 0;
      const auto in_owner = colour_at(projector_, owner, p, depression);
      if (!in_owner) continue;
      for (std::size_t n = 0; n < neighbours.size(); ++n)
        if (const auto in_neighbour = colour_at(projector_, timeline_.at(neighbours[n]), p, unused))
          ratios[n].add(*in_owner, *in_neighbour, depression > kBelowHorizon);
    }
  }
  for (std::size_t n = 0; n < neighbours.size(); ++n) {
    ColourGain gain{timeline_.at(neighbours[n]).serial, {1.0f, 1.0f, 1.0f}};
    ++counts_.gain_pairs;
    if (!ratios[n].measure(gain.gain)) ++counts_.gain_pairs_unmeasured;
    owner.gains->push_back(gain);
  }
}

}  // namespace hueline::fusion
