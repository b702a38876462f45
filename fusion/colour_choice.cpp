#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "core/portable_math.hpp"
#include "fusion/agreement.hpp"
#include "fusion/colouring.hpp"
#include "fusion/colouring_piece.hpp"
#include "fusion/sight_judge.hpp"

/// Chooses the exposure that gives a point its colour.
namespace hueline::fusion {
namespace {

constexpr float kLostLight = 0.25f;       // what a saturated pixel costs, rad
constexpr float kPerNanosecond = 1e-10f;  // what poses and light drift apart between firing and exposure, rad/ns
constexpr float kSameLine = 0.02f;        // nothing fits between two lines with this parallax, rad
constexpr float kElsewhere = 0.02f;       // an exposure that sees a point so far from where it is shows another, rad
constexpr float kBeside_m = 0.15f, kBesideShare = 0.02f;  // so far apart may two points of one place be, in distance
constexpr float kNever = 1e30f;
// On each side so many moments, the nearest, may colour a point even if they are no steps of the timeline.
constexpr int kNearest = 3;
constexpr std::size_t kAhead = 8;           // points for which the maps' memory is asked before they are looked at
constexpr int kKnownMoments = 3;            // earlier ones, and later ones, that may give a provisional colour
constexpr nanoseconds kAtOnce{20'000'000};  // nothing moves far in this time
// An exposure this near shows what moves at a place that it filled at the firing too.
constexpr nanoseconds kOwnMoment{100'000'000};
// A surface in a place's cell is before the place, or far behind it, if its nearness over that of the place is not
// between these.
constexpr float kBeforePlace = 1.02f, kBehindPlace = 0.9f;
constexpr float kOddsOfCost = 2.0f;            // log-odds that a radian less of cost is worth
constexpr std::uint32_t kFewestWitnesses = 3;  // fewer images say nothing about which of them sees a point
// By LineOfSight: what a line costs, as an angle of parallax, rad; how far an image is trusted to show a point; and how
// far the laser points vouch for its colour.
constexpr std::array<float, 7> kCost{kNever, 0.51f, 0.51f, 0.34f, 0.17f, 0.17f, 0.0f};
constexpr std::array<float, 7> kTrust{0.2f, 0.25f, 0.7f, 0.95f, 0.98f, 0.98f, 1.0f};
constexpr std::array<float, 7> kVouched{0.0f, 0.3f, 0.4f, 0.6f, 0.7f, 0.8f, 1.0f};

float drift(const Moment& moment, GpsTime time) {
  return kPerNanosecond * static_cast<float>(std::abs((time - moment.time).count()));
}

/// Returns what a moment costs for a point if nothing lies between, rad; kNever if a leap of the POS lies between the
/// two, by which the image shows the point elsewhere.
float least_cost(const Moment& moment, const SeenPlaces& seen, std::size_t index, const LeapBetween& leap,
                 const ColouredPoint& point) {
  const float off = leap.position_m * seen.nearness[index] + leap.angle;
  if (off > kElsewhere) return kNever;
  return seen.parallax[index] + drift(moment, point.time) + off;
}

LeapBetween leap_between(const Moment& moment, const GeoreferencedBatch& placed) {
  const Leap& leapt = moment.viewpoint->leapt;
  return {static_cast<float>((leapt.position - placed.leapt.position).norm()),
          static_cast<float>((leapt.attitude - placed.leapt.attitude).norm())};
}

/// Whether something was at the place of a point that moves at a moment near its firing too.
bool was_there(const Moment& moment, GpsTime fired, std::uint32_t cell, float nearness) {
  if (!moment.glance || !moment.standing) return false;
  return moment.met.was_met(moment.glance->grid(), fired < moment.time, cell, nearness, kBeside_m, kBesideShare) ||
         (moment.glance->meets(cell, nearness) && moment.standing->meets(cell, nearness));
}

/// Returns what is known about the line of sight from a moment to a point.
LineOfSight line_of_sight(const Moment& moment, const SeenPlaces& seen, std::size_t index, bool moves, GpsTime time,
                          bool is_provisional) {
  const std::uint32_t cell = seen.cell[index];
  const float nearness = seen.nearness[index];
  // Where a point was that moves is somewhere else at another moment, unless something as far away was there too.
  const nanoseconds away = std::chrono::abs(time - moment.time);
  if (moves && away > kAtOnce && !(away <= kOwnMoment && was_there(moment, time, cell, nearness)))
    return LineOfSight::Hidden;
  LineOfSight look = is_provisional && moment.early ? moment.early->look_among_points(cell, nearness)
                                                    : Visibility::look(moment, cell, nearness);
  // No beam watched this line then: something may have come and gone, as a car so near that all beams pass over it.
  if (look == LineOfSight::Clear && moment.glance && moment.glance->is_blank(cell)) look = LineOfSight::Unwatched;
  // The scanner saw the point, and nothing fits between.
  return look == LineOfSight::Hidden && seen.parallax[index] < kSameLine ? LineOfSight::Behind : look;
}

float cost_of(LineOfSight look) { return kCost[static_cast<std::size_t>(look)]; }
float vouched_by(LineOfSight look) { return kVouched[static_cast<std::size_t>(look)]; }

const std::optional<DepthMap>& standing_of(const Moment& moment, bool is_provisional) {
  return is_provisional && moment.early ? moment.early : moment.standing;
}

/// Whether the laser points leave it open if a moment sees a place: the line is not clear, or the surface in the
/// place's cell is another one.
bool is_doubtful(const Moment& moment, const SeenPlaces& seen, std::size_t index, LineOfSight look,
                 bool is_provisional) {
  if (look != LineOfSight::Clear) return true;
  const std::uint32_t cell = seen.cell[index];
  const float nearness = seen.nearness[index];
  const auto& standing = standing_of(moment, is_provisional);
  if (standing && standing->surface(cell) > kBeforePlace * nearness) return true;
  const float at_once = moment.glance ? moment.glance->surface(cell) : 0.0f;
  return at_once > kBeforePlace * nearness || (at_once > 0.0f && at_once < kBehindPlace * nearness);
}

/// Returns what is known of the line of sight from a moment to a point but for what the images say.
SightEvidence evidence_of(const Moment& moment, const SeenPlaces& seen, std::size_t index, bool is_provisional) {
  const std::uint32_t cell = seen.cell[index];
  const float nearness = seen.nearness[index], distance = 1.0f / nearness;
  SightEvidence out{seen.parallax[index], distance};
  const auto tell = [&](const std::optional<DepthMap>& map, Evidence first) {
    if (!map) return;
    const DepthMap::Around around = map->look_around(cell, nearness);
    float* const to = &out[static_cast<std::size_t>(first)];
    to[0] = map->surface(cell) * distance;
    to[1] = map->nearest_point(cell) * distance;
    to[2] = around.nearest * distance;
    to[3] = static_cast<float>(around.before);
    to[4] = static_cast<float>(around.there);
  };
  tell(standing_of(moment, is_provisional), Evidence::Surface);
  tell(moment.glance, Evidence::GlanceSurface);
  return out;
}

}  // namespace

/// Chooses the moment that sees a point most nearly as the scanner did, for the scanner did see it. What may lie
/// between grows with the angle between the two lines. `index` is that of the point in piece.seen.
Colouring::Found Colouring::find_visible(std::size_t index, bool moves, Piece& piece,
                                         const ColouredPoint& point) const {
  std::vector<float>& costs = piece.costs;
  costs.resize(piece.candidates.size());
  for (std::size_t k = 0; k < costs.size(); ++k)
    costs[k] = least_cost(timeline_.at(piece.candidates[k]), piece.seen[k], index, piece.leaps[k], point);
  Found found;
  float least = kNever;
  while (!costs.empty()) {
    const auto next = std::min_element(costs.begin(), costs.end());
    if (*next >= least) break;
    float cost = *next;
    *next = kNever;
    const auto k = static_cast<std::size_t>(next - costs.begin());
    const Moment& moment = timeline_.at(piece.candidates[k]);
    const LineOfSight look = line_of_sight(moment, piece.seen[k], index, moves, point.time, piece.is_provisional);
    if (look == LineOfSight::Hidden) {
      found.is_hidden = true;
      continue;
    }
    cost += cost_of(look);
    if (cost >= least) continue;
    Sight sight;
    if (!sees(moment, point, sight)) continue;
    const FloatLens& lens = projector_.lenses()[sight.lens];
    if (is_dimmed(gains_of(moment, piece), sight.lens) &&
        is_saturated(sample_lens(lens, moment.pictures[lens.camera].view, sight.x, sight.y)))
      cost += kLostLight;
    if (cost >= least) continue;
    found.moment = piece.candidates[k];
    found.sight = sight;
    found.look = look;
    found.vouched = vouched_by(look);
    found.is_doubtful = is_doubtful(moment, piece.seen[k], index, look, piece.is_provisional);
    least = cost;
  }
  return found;
}

/// Where the laser points leave open whether even the best moment sees a point, all that is known of each is weighed:
/// how far something lies before it, and the images, for those that see the point show one colour, the others what
/// happens to be in front. Replaces what was found for piece.doubtful by the view that most probably sees the point, as
/// the scanner did; if none does so with certainty enough, the point stays without a colour. piece.places are those of
/// piece.rest, and are not kept.
void Colouring::judge_doubtful(const PlacedBatch& batch, ColouredPoint* points, Piece& piece) const {
  const std::size_t count = piece.doubtful.size(), most = piece.candidates.size();
  if (count == 0) return;
  for (std::size_t d = 0; d < count; ++d) {
    const std::size_t k = piece.doubtful[d];
    piece.places.set(d, {piece.places.x[k], piece.places.y[k], piece.places.z[k]});
  }
  piece.places.resize(count);
  piece.witnesses.resize(count * most);
  piece.views.resize(count * most);
  piece.rows.resize(count * most);
  piece.evidence.clear();
  piece.view_costs.resize(count * most);
  piece.witness_count.assign(count, 0);
  for (std::size_t c = 0; c < most; ++c) {
    const Moment& moment = timeline_.at(piece.candidates[c]);
    const HeadGains* gains = gains_of(moment, piece);
    const SeenPlaces& seen = piece.seen[c];
    Sights& sights = piece.sights;
    projector_.see_each(moment.viewpoint->relative_to(batch.placed.scanner_enu), moment.viewpoint->motion, piece.places,
                        moment.has_image.data(), moment.blind, sights);
    piece.costs.resize(count);
    for (std::size_t d = 0; d < count; ++d) {
      const std::size_t k = piece.doubtful[d];
      const ColouredPoint& point = points[piece.rest[k]];
      piece.costs[d] = least_cost(moment, seen, k, piece.leaps[c], point);
      if (piece.costs[d] >= kNever) {
        sights.lens[d] = kNoLens;
      } else if (Sight sight; sights.lens[d] == kNoLens && sees(moment, point, sight)) {
        sights.set(d, sight);
      }
    }
    piece.sampler.sample(projector_.lenses(), moment, sights, piece.pixels);
    piece.rendered.clear();
    piece.group.clear();
    for (std::size_t d = 0; d < count; ++d) {
      if (d + kAhead < count) {
        const std::uint32_t ahead = seen.cell[piece.doubtful[d + kAhead]];
        Visibility::prefetch(moment, ahead);
        for (const auto* map : {&moment.glance, &standing_of(moment, piece.is_provisional)})
          if (*map) (*map)->prefetch_around(ahead);
      }
      if (sights.lens[d] == kNoLens) continue;
      const FloatLens& lens = projector_.lenses()[sights.lens[d]];
      if (is_dimmed(gains, sights.lens[d]) && is_saturated(piece.pixels[d])) continue;
      const std::size_t k = piece.doubtful[d];
      const std::uint32_t i = piece.rest[k];
      const LineOfSight look = line_of_sight(moment, seen, k, false, points[i].time, piece.is_provisional);
      const std::size_t at = d * most + piece.witness_count[d]++;
      piece.witnesses[at] = {{}, kTrust[static_cast<std::size_t>(look)]};
      piece.views[at] = {piece.candidates[c], sights.at(d)};
      piece.view_costs[at] = piece.costs[d];
      piece.rows[at] =
          static_cast<std::uint32_t>(piece.evidence.add(evidence_of(moment, seen, k, piece.is_provisional)));
      piece.group.push_back(static_cast<std::uint32_t>(at));
      piece.rendered.add(piece.pixels[d], sights.lens[d], lens.off_axis(sights.x[d], sights.y[d]));
    }
    render(gains, piece);
    for (std::size_t n = 0; n < piece.group.size(); ++n)
      piece.witnesses[piece.group[n]].colour = piece.rendered.colours[n];
  }
  for (std::size_t d = 0; d < count; ++d) {
    if (piece.witness_count[d] < kFewestWitnesses) continue;
    weigh_agreement(std::span(&piece.witnesses[d * most], piece.witness_count[d]), piece.agreement);
    for (std::size_t v = 0; v < piece.witness_count[d]; ++v)
      piece.evidence.set(piece.rows[d * most + v], Evidence::Agreement, piece.agreement[v]);
  }
  log_odds_of_sights(piece.evidence, piece.log_odds);
  for (std::size_t d = 0; d < count; ++d) {
    if (piece.witness_count[d] < kFewestWitnesses) continue;
    const std::uint32_t i = piece.rest[piece.doubtful[d]];
    Found& found = piece.found[i];
    found = {};
    float most_worth = -kNever, log_odds_of_best = 0;
    for (std::size_t v = 0; v < piece.witness_count[d]; ++v) {
      const std::size_t at = d * most + v;
      if (piece.keeps_judged) keep_judged(i, piece.views[at], piece.evidence[piece.rows[at]], piece);
      const float log_odds = piece.log_odds[piece.rows[at]], worth = log_odds - kOddsOfCost * piece.view_costs[at];
      if (log_odds < kSeen || worth <= most_worth) continue;
      most_worth = worth;
      log_odds_of_best = log_odds;
      found = piece.views[at];
    }
    if (found.moment < 0) {
      points[i].state = ColourState::Hidden;
    } else {
      found.vouched = static_cast<float>(1.0 / (1.0 + portable::exp(-static_cast<double>(log_odds_of_best))));
    }
  }
}

void Colouring::keep_judged(std::uint32_t point, const Found& view, const SightEvidence& evidence, Piece& piece) const {
  const std::uint8_t lens = view.sight.lens;
  const Moment::Picture& picture = timeline_.at(view.moment).pictures[projector_.lenses()[lens].camera];
  piece.judged.push_back({point, picture.exposure, lens, evidence});
}

/// Chooses for each point between the nearest moments before and after it, where no other can be better: along the way,
/// the angle to the scanner's line and the time only grow. Points for which another may be better, or for which
/// something may lie between, keep -1.
void Colouring::choose_beside(const PlacedBatch& batch, const ColouredPoint* points, Piece& piece) const {
  // The nearest candidates before and after the batch, and those after them.
  std::array<std::array<const Moment*, 2>, 2> beside{};
  std::array<int, 2> nearest{-1, -1};
  std::array<LeapBetween, 2> leap{};
  for (const int candidate : piece.candidates) {
    const Moment& moment = timeline_.at(candidate);
    const auto side = static_cast<std::size_t>(moment.time > batch.batch.time);
    if (beside[side][0] == nullptr) {
      beside[side][0] = &moment;
      nearest[side] = candidate;
    } else if (beside[side][1] == nullptr) {
      beside[side][1] = &moment;
    }
  }
  for (std::size_t side = 0; side < 2; ++side)
    if (beside[side][0] != nullptr) {
      leap[side] = leap_between(*beside[side][0], batch.placed);
      locate(visibility_.grid(), beside[side][0]->viewpoint->relative_to(batch.placed.scanner_enu), batch.placed.places,
             piece.beside[side]);
    }
  for (std::size_t i = 0; i < batch.placed.size(); ++i) {
    if (i + kAhead < batch.placed.size())
      for (std::size_t side = 0; side < 2; ++side)
        if (beside[side][0] != nullptr) Visibility::prefetch(*beside[side][0], piece.beside[side].cell[i + kAhead]);
    const ColouredPoint& point = points[i];
    const bool moves = piece.sightings[i].is_moving();
    std::array<float, 2> cost{kNever, kNever};
    for (std::size_t side = 0; side < 2; ++side)
      if (beside[side][0] != nullptr)
        cost[side] = least_cost(*beside[side][0], piece.beside[side], i, leap[side], point);
    Found& found = piece.found[i];
    float least = kNever, least_beyond = kNever;
    const std::size_t cheaper = cost[1] < cost[0] ? 1 : 0;
    for (const std::size_t side : {cheaper, 1 - cheaper}) {
      if (beside[side][0] == nullptr || cost[side] >= least) break;
      const LineOfSight look =
          line_of_sight(*beside[side][0], piece.beside[side], i, moves, point.time, piece.is_provisional);
      if (look != LineOfSight::Clear && beside[side][1] != nullptr)
        least_beyond = std::min(least_beyond, piece.beside[side].parallax[i] + drift(*beside[side][1], point.time));
      const float whole = cost[side] + cost_of(look);
      if (look == LineOfSight::Hidden || whole >= least) continue;
      least = whole;
      found.moment = nearest[side];
      found.look = look;
      found.vouched = vouched_by(look);
      found.is_doubtful = is_doubtful(*beside[side][0], piece.beside[side], i, look, piece.is_provisional);
    }
    if (least_beyond < least || found.is_doubtful) found.moment = -1;
  }
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
  if (per_side > 0) timeline_.neighbours_of(point.time, reach, per_side, per_side, owner, piece.candidates);
  for (const int candidate : piece.candidates) {
    if (timeline_.at(candidate).time > point.time + reach_ahead()) continue;
    if (!sees(timeline_.at(candidate), point, found.sight)) continue;
    found.moment = candidate;
    return found;
  }
  return found;
}

bool Colouring::sees(const Moment& moment, const ColouredPoint& point, Sight& sight) const {
  if (!moment.viewpoint) return false;
  const auto [x, y, z] = moment.viewpoint->in_head(point.east, point.north, point.up);
  return projector_.see(x, y, z, moment.has_image.data(), moment.blind, sight, moment.viewpoint->motion);
}

/// Chooses for the points of piece.rest from any candidate.
void Colouring::choose_rest(const PlacedBatch& batch, ColouredPoint* points, Piece& piece) const {
  const bool is_visible = config_.choice == ExposureChoice::Visible;
  piece.gather(batch.placed.places, piece.rest);
  piece.doubtful.clear();
  if (is_visible) {
    piece.seen.resize(std::max(piece.seen.size(), piece.candidates.size()));
    piece.leaps.clear();
    for (std::size_t k = 0; k < piece.candidates.size(); ++k) {
      const Moment& moment = timeline_.at(piece.candidates[k]);
      piece.leaps.push_back(leap_between(moment, batch.placed));
      locate(visibility_.grid(), moment.viewpoint->relative_to(batch.placed.scanner_enu), piece.places, piece.seen[k]);
    }
  }
  for (std::size_t k = 0; k < piece.rest.size(); ++k) {
    if (is_visible && k + 1 < piece.rest.size())
      for (std::size_t c = 0; c < piece.candidates.size(); ++c)
        Visibility::prefetch(timeline_.at(piece.candidates[c]), piece.seen[c].cell[k + 1]);
    const std::uint32_t i = piece.rest[k];
    ColouredPoint& point = points[i];
    const bool moves = piece.sightings[i].is_moving();
    const int owner = timeline_.owner_of(point.time);
    // An owner without a pose is treated as a lost image.
    const bool is_lost = owner < 0 || !timeline_.at(owner).viewpoint;
    Found& found = piece.found[i];
    found = is_visible ? find_visible(k, moves, piece, point) : find_nearest(owner, is_lost, piece, point);
    if (found.moment < 0) {
      const bool has_asked = !is_lost || !piece.candidates.empty();
      point.state = found.is_hidden ? ColourState::Hidden : has_asked ? ColourState::Outside : ColourState::NoExposure;
    }
    // What moves is somewhere else at other moments, so their images bear no witness.
    const bool is_open = found.moment < 0 ? found.is_hidden : found.is_doubtful;
    if (is_visible && !moves && is_open) piece.doubtful.push_back(static_cast<std::uint32_t>(k));
  }
  judge_doubtful(batch, points, piece);
}

/// Finds the moments that may colour the points of a batch. They change with a point's time by less than matters within
/// a batch, which lasts about a millisecond.
void Colouring::find_candidates(const PlacedBatch& batch, Piece& piece) const {
  const int owner = timeline_.owner_of(batch.batch.time);
  timeline_.neighbours_of(batch.batch.time, reach_behind(), config_.neighbours, kNearest, owner, piece.candidates);
  if (owner >= 0) piece.candidates.insert(piece.candidates.begin(), owner);
  const GpsTime end = batch.batch.time + reach_ahead();
  std::erase_if(piece.candidates,
                [&](int index) { return !timeline_.at(index).viewpoint || timeline_.at(index).time > end; });
}

/// Finds the moments that may colour a batch before all of its exposures have come: the nearest of those that have
/// maps.
void Colouring::find_known(const PlacedBatch& batch, Piece& piece) const {
  timeline_.neighbours_of(batch.batch.time, neighbour_reach() + timeline_.interval(), kKnownMoments, kKnownMoments, -1,
                          piece.candidates);
  std::erase_if(piece.candidates, [&](int index) {
    const Moment& moment = timeline_.at(index);
    return !moment.viewpoint || (config_.choice == ExposureChoice::Visible && !moment.standing && !moment.early);
  });
}

void Colouring::colour_piece(const PlacedBatch& batch, Piece& piece, ColouredPoint* points) const {
  const GeoreferencedBatch& placed = batch.placed;
  piece.by_state.fill(0);
  piece.sightings = visibility_.sightings(batch);
  piece.adaptation = radiometry_.adaptation(batch.batch.time);
  piece.found.assign(placed.size(), {});
  for (std::size_t i = 0; i < placed.size(); ++i) {
    const LaserReturn& r = batch.batch.returns[placed.source[i]];
    ColouredPoint& point = points[i];
    point = {};
    point.east = placed.east[i];
    point.north = placed.north[i];
    point.up = placed.up[i];
    point.sigma_m = placed.sigma_m[i];
    point.time = batch.batch.time + nanoseconds(r.time_offset_ns);
    point.reflectivity = r.reflectivity;
    point.return_number = r.return_number;
    point.return_count = r.return_count;
    point.channel = r.channel;
    point.sensor = batch.batch.sensor;
    point.moving = static_cast<std::uint8_t>(piece.sightings[i].confidence_of_moving());
  }
  // Nearly always one moment owns the whole batch.
  const int first_owner = timeline_.owner_of(batch.batch.time), last_owner = timeline_.owner_of(batch.last);
  const auto owner_of = [&](std::size_t i) {
    const bool is_one_window = first_owner == last_owner && points[i].time >= batch.batch.time;
    return is_one_window ? first_owner : timeline_.owner_of(points[i].time);
  };
  if (config_.choice == ExposureChoice::Visible) {
    if (piece.is_provisional) {
      find_known(batch, piece);
    } else {
      find_candidates(batch, piece);
    }
    choose_beside(batch, points, piece);
  } else {
    piece.candidates.clear();
    if (piece.is_provisional) find_known(batch, piece);
    const int known = piece.candidates.empty() ? -1 : piece.candidates.front();
    piece.candidates.clear();
    for (std::size_t i = 0; i < placed.size(); ++i) {
      const int owner = piece.is_provisional ? known : owner_of(i);
      if (owner < 0 || !timeline_.at(owner).viewpoint) continue;
      piece.found[i].moment = owner;
      if (std::find(piece.candidates.begin(), piece.candidates.end(), owner) == piece.candidates.end())
        piece.candidates.push_back(owner);
    }
  }
  paint_chosen(batch, points, piece);
  piece.rest.clear();
  for (std::size_t i = 0; i < placed.size(); ++i)
    if (piece.found[i].moment < 0) piece.rest.push_back(static_cast<std::uint32_t>(i));
  choose_rest(batch, points, piece);
  paint_rest(points, piece);
  for (std::size_t i = 0; i < placed.size(); ++i) {
    ColouredPoint& point = points[i];
    if (piece.found[i].moment >= 0)
      point.state = piece.found[i].moment == owner_of(i) ? ColourState::Direct : ColourState::Neighbour;
    ++piece.by_state[static_cast<std::size_t>(point.state)];
  }
}

}  // namespace hueline::fusion
