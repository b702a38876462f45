#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

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
  const auto h = moment.viewpoint->in_head(p_enu.x(), p_enu.y(), p_enu.z());
  Sight sight;
  if (!projector.see(h[0], h[1], h[2], moment.has_image.data(), moment.blind, sight)) return std::nullopt;
  depression = -h[2] / std::sqrt(h[0] * h[0] + h[1] * h[1] + h[2] * h[2]);
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

int confidence_of_moving(int free, int occupied) {
  const int balance = 127 * (free - occupied) / (free + occupied + 1);
  return is_moving(free, occupied) ? 128 + balance : free > 0 ? std::clamp(127 + balance, 1, 127) : 0;
}

bool is_moving(int free, int occupied) { return free >= 2 && free > occupied; }

void Colouring::paint(const Moment& moment, const Found& found, const ColourGain* gain, ColouredPoint& point) const {
  const Sight& sight = found.sight;
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
    const auto [x, y, z] = moment.viewpoint->in_head(point.east, point.north, point.up);
    projector_.panorama_pixel(x, y, z, point.u, point.v);
  } else {
    point.u = sight.x;
    point.v = sight.y;
  }
  const auto away = static_cast<float>(std::abs((point.time - moment.time).count()));
  const auto interval = static_cast<float>(timeline_.interval().count());
  const float timely = interval / (interval + away);
  const float border = std::min(1.0f, sight.border_px / kFullBorder);
  const float stamped = trust(moment.state) * (moment.timing == ExposureTiming::EventMark ? 1.0f : 0.8f);
  // How far the laser points vouch for the line of sight.
  constexpr std::array<float, 5> kVouched{0.0f, 0.4f, 0.6f, 0.8f, 1.0f};
  const float vouched =
      config_.choice == ExposureChoice::Visible ? kVouched[static_cast<std::size_t>(found.look)] : 1.0f;
  point.quality = static_cast<std::uint8_t>(1.0f + 254.0f * timely * border * stamped * vouched);
}

LineOfSight Colouring::look_at(const Moment& moment, std::uint32_t cell, float nearness) const {
  if (moment.glance && moment.glance->look(cell, nearness) == LineOfSight::Hidden) return LineOfSight::Hidden;
  return moment.standing ? moment.standing->look(cell, nearness) : LineOfSight::Clear;
}

/// Colours a point from the moment that sees it most nearly as the scanner did, for the scanner did see it. What may
/// lie between grows with the angle between the two lines.
Colouring::Found Colouring::find_visible(const PlacedBatch& batch, std::size_t index, Piece& piece,
                                         const ColouredPoint& point) const {
  constexpr float kStep = 0.17f;  // what one step of LineOfSight costs, as an angle of parallax, rad
  constexpr float kNever = 1e30f;
  constexpr nanoseconds kAtOnce{20'000'000};  // nothing moves far in this time
  const bool moves = is_moving(batch.free[index], batch.occupied[index]);
  std::array<float, kMostCandidates> parallax;
  const std::size_t count = std::min(piece.candidates.size(), parallax.size());
  for (std::size_t k = 0; k < count; ++k) parallax[k] = piece.seen[k].parallax[index];
  Found found;
  float least = kNever;
  while (count > 0) {
    const auto next = std::min_element(parallax.begin(), parallax.begin() + static_cast<std::ptrdiff_t>(count));
    if (*next >= least) break;
    float cost = *next;
    *next = kNever;
    const auto k = static_cast<std::size_t>(next - parallax.begin());
    const Moment& moment = timeline_.at(piece.candidates[k]);
    const std::uint32_t cell = piece.seen[k].cell[index];
    const float nearness = piece.seen[k].nearness[index];
    const LineOfSight look = look_at(moment, cell, nearness);
    // Where the point was is somewhere else at another moment, unless something as far away was there too.
    const bool has_left = moves && std::chrono::abs(point.time - moment.time) > kAtOnce &&
                          !(moment.glance && moment.glance->meets(cell, nearness));
    if (look == LineOfSight::Hidden || has_left) {
      found.is_hidden = true;
      continue;
    }
    cost += kStep * static_cast<float>(static_cast<int>(LineOfSight::Clear) - static_cast<int>(look));
    if (cost >= least) continue;
    Sight sight;
    if (!sees(moment, point, sight)) continue;
    found.moment = piece.candidates[k];
    found.sight = sight;
    found.look = look;
    least = cost;
  }
  return found;
}

/// Colours a point from the moment that owns it, or else from the nearest in time that sees its direction.
Colouring::Found Colouring::find_nearest(int owner, bool is_lost, Piece& piece, const ColouredPoint& point) const {
  Found found;
  if (!is_lost && sees(timeline_.at(owner), point, found.sight)) {
    found.moment = owner;
    return found;
  }
  const int per_side = is_lost ? config_.lost_image_neighbours : config_.neighbours;
  const nanoseconds reach = timeline_.interval() * per_side + timeline_.interval() / 2 + config_.window_slack;
  piece.candidates.clear();
  if (per_side > 0) timeline_.neighbours_of(point.time, reach, per_side, owner, piece.candidates);
  for (const int candidate : piece.candidates) {
    if (!sees(timeline_.at(candidate), point, found.sight)) continue;
    found.moment = candidate;
    return found;
  }
  return found;
}

bool Colouring::sees(const Moment& moment, const ColouredPoint& point, Sight& sight) const {
  if (!moment.viewpoint) return false;
  const auto [x, y, z] = moment.viewpoint->in_head(point.east, point.north, point.up);
  return projector_.see(x, y, z, moment.has_image.data(), moment.blind, sight);
}

void Colouring::colour_point(int owner, const PlacedBatch& batch, std::size_t index, Piece& piece,
                             ColouredPoint& point) const {
  // An owner without a pose is treated as a lost image.
  const bool is_lost = owner < 0 || !timeline_.at(owner).viewpoint;
  const Found found = config_.choice == ExposureChoice::Visible ? find_visible(batch, index, piece, point)
                                                                : find_nearest(owner, is_lost, piece, point);
  if (found.moment < 0) {
    const bool has_asked = !is_lost || !piece.candidates.empty();
    point.state = found.is_hidden ? ColourState::Hidden : has_asked ? ColourState::Outside : ColourState::NoExposure;
    return;
  }
  const Moment& moment = timeline_.at(found.moment);
  const bool is_own = found.moment == owner;
  paint(moment, found, is_own || is_lost ? nullptr : timeline_.at(owner).gain_of(moment.serial), point);
  point.state = is_own ? ColourState::Direct : ColourState::Neighbour;
}

void Colouring::find_candidates(PlacedBatch& batch, Piece& piece) const {
  const int owner = timeline_.owner_of(batch.batch.time);
  timeline_.neighbours_of(batch.batch.time, neighbour_reach(), config_.neighbours, owner, piece.candidates);
  if (owner >= 0) piece.candidates.push_back(owner);
  std::erase_if(piece.candidates, [&](int index) { return !timeline_.at(index).viewpoint; });
  piece.seen.resize(piece.candidates.size());
  for (std::size_t k = 0; k < piece.candidates.size(); ++k) {
    const Moment::Viewpoint& viewpoint = *timeline_.at(piece.candidates[k]).viewpoint;
    locate(grid_, viewpoint.relative_to(batch.placed.scanner_enu), batch.placed.places, piece.seen[k]);
  }
  ask_turns(batch, piece.asked);
}

void Colouring::colour_piece(PlacedBatch& placed_batch, Piece& piece, ColouredPoint* points) const {
  piece.by_state.fill(0);
  const StampedLaserBatch& batch = placed_batch.batch;
  const GeoreferencedBatch& placed = placed_batch.placed;
  // A batch lasts about a millisecond and a window at least a tenth of a second, so nearly always one moment owns the
  // whole batch.
  const int owner_of_first = timeline_.owner_of(batch.time), owner_of_last = timeline_.owner_of(placed_batch.last);
  const bool is_one_window = owner_of_first == owner_of_last && owner_of_first >= 0;
  // The candidates change with a point's time by less than matters within a batch.
  if (config_.choice == ExposureChoice::Visible) find_candidates(placed_batch, piece);
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
    point.moving = static_cast<std::uint8_t>(confidence_of_moving(placed_batch.free[i], placed_batch.occupied[i]));
    colour_point(is_one_window && r.time_offset_ns >= 0 ? owner_of_first : timeline_.owner_of(point.time), placed_batch,
                 i, piece, point);
    ++piece.by_state[static_cast<std::size_t>(point.state)];
  }
}

void Colouring::measure_gains(Moment& owner, int owner_index) {
  owner.gains.emplace();
  if (!owner.viewpoint) return;
  std::vector<int> neighbours;
  timeline_.neighbours_of(owner.time, neighbour_reach() + timeline_.interval(), config_.neighbours, owner_index,
                          neighbours);
  std::vector<const GeoreferencedBatch*> own;
  std::size_t returns = 0;
  for (const PlacedBatch& batch : placed_) {
    if (timeline_.owner_of(batch.batch.time) != owner_index) continue;
    own.push_back(&batch.placed);
    returns += batch.placed.places.size();
  }
  std::vector<ColourRatios> ratios(neighbours.size());
  const std::size_t stride = std::max<std::size_t>(1, returns / kGainSamples);
  std::size_t counter = 0;
  for (const GeoreferencedBatch* batch : own) {
    for (std::size_t i = 0; i < batch->places.size(); ++i) {
      if (counter++ % stride != 0) continue;
      const Eigen::Vector3d p =
          batch->scanner_enu +
          Eigen::Vector3f(batch->places.x[i], batch->places.y[i], batch->places.z[i]).cast<double>();
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
