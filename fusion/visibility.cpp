#include "fusion/visibility.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "fusion/worker_pool.hpp"

namespace hueline::fusion {
namespace {
constexpr float kGroundStep_m = 0.1f, kGround_m = 2.5f;
constexpr std::uint64_t kSumEvery = 4;           // new turns, after which the earlier ones are summed again
constexpr unsigned kOutvoted = 3;                // times as many sightings outvote those of a point
constexpr nanoseconds kLateTurn{1'000'000'000};  // a turn of another scanner may be complete so much later
constexpr std::size_t kSkinPiece = 4096;         // points of a skin that a thread asks about at a time
constexpr std::array<float, 9> kEnuAxes{1, 0, 0, 0, 1, 0, 0, 0, 1};
static_assert((1 + TurnSkin::kMostNeighbours) * PresenceCount::kMost < 1U << 16);
}  // namespace

int Sightings::confidence_of_moving() const {
  const int f = kFreeWeight * free, o = kOccupiedWeight * occupied, balance = 127 * (f - o) / (f + o + kFreeWeight);
  return is_moving() ? 128 + balance : free > 0 ? std::clamp(127 + balance, 1, 127) : 0;
}

void Visibility::add(std::deque<PlacedBatch>& placed, bool everything, WorkerPool& pool) {
  const std::uint64_t first_new = first_turn_ + turns_.size();
  const auto begin = std::partition_point(placed.begin(), placed.end(),
                                          [&](const PlacedBatch& batch) { return batch.number < next_batch_; });
  for (auto batch = begin; batch != placed.end(); ++batch) {
    next_batch_ = batch->number + 1;
    // Batches without a pose may be stamped out of all time.
    if (batch->placed.size() == 0) continue;
    for (auto& [sensor, open] : open_)
      if (!open.batches.empty() && batch->batch.time >= open.begin + config_.turn) complete(open);
    OpenTurn& open = open_[batch->batch.sensor];
    if (open.batches.empty()) open.begin = batch->batch.time;
    open.batches.push_back(&*batch);
  }
  if (everything)
    for (auto& [sensor, open] : open_)
      if (!open.batches.empty()) complete(open);
  if (first_turn_ + turns_.size() > first_new) ask_around(pool, first_new, everything);
}

void Visibility::complete(OpenTurn& open) {
  thread_local std::vector<SeenPlaces> seen;
  if (!skin_) skin_.emplace(grid_);
  seen.resize(std::max(seen.size(), open.batches.size()));
  Turn turn(beam_grid_);
  turn.time = open.begin + config_.turn / 2;
  turn.centre_enu = open.batches[open.batches.size() / 2]->placed.scanner_enu;
  const auto offset = [&](const PlacedBatch& batch) {
    const Eigen::Vector3f from = (batch.placed.scanner_enu - turn.centre_enu).cast<float>();
    return std::array<float, 3>{from.x(), from.y(), from.z()};
  };
  std::size_t points = 0;
  for (std::size_t b = 0; b < open.batches.size(); ++b) {
    const PlacedBatch& batch = *open.batches[b];
    locate_cells(grid_, skin_->order(), {kEnuAxes, offset(batch)}, batch.placed.places, seen[b]);
    skin_->add(seen[b]);
    points += batch.placed.places.size();
  }
  thread_local RelativePlaces skin;  // with room for all points
  for (std::vector<float>* axis : {&skin.x, &skin.y, &skin.z}) axis->assign(points, 0);
  const std::uint64_t number = first_turn_ + turns_.size();
  for (std::size_t b = 0; b < open.batches.size(); ++b) {
    PlacedBatch& batch = *open.batches[b];
    const RelativePlaces& places = batch.placed.places;
    const std::array<float, 3> from = offset(batch);
    batch.turn = number;
    batch.on_skin.resize(places.size());
    for (std::size_t i = 0; i < places.size(); ++i) {
      const auto [index, is_on_skin] = skin_->stand_in(seen[b].cell[i], seen[b].nearness[i]);
      batch.on_skin[i] = index;
      if (is_on_skin) skin.set(index, {places.x[i] + from[0], places.y[i] + from[1], places.z[i] + from[2]});
    }
  }
  const auto taken = static_cast<std::ptrdiff_t>(skin_->size());
  turn.skin.x.assign(skin.x.begin(), skin.x.begin() + taken);
  turn.skin.y.assign(skin.y.begin(), skin.y.begin() + taken);
  turn.skin.z.assign(skin.z.begin(), skin.z.begin() + taken);
  if (!spare_neighbours_.empty()) {
    turn.neighbours = std::move(spare_neighbours_.back());
    spare_neighbours_.pop_back();
  }
  skin_->neighbours(turn.neighbours);
  skin_->clear();
  turn.own.resize(turn.skin.size());
  turn.sightings.resize(turn.skin.size());
  for (std::size_t b = 0; b < open.batches.size(); ++b) {
    const PlacedBatch& batch = *open.batches[b];
    locate_cells(beam_grid_, {kEnuAxes, offset(batch)}, batch.placed.places, seen[b]);
    for (std::size_t i = 0; i < seen[b].cell.size(); ++i) turn.beams.add(seen[b].cell[i], seen[b].nearness[i]);
  }
  turn.beams.finish();
  newest_ = std::max(newest_, turn.time);
  turns_.push_back(std::move(turn));
  open.batches.clear();
}

void Visibility::ask(Turn& turn, const Turn& beams, std::size_t begin, std::size_t end) const {
  thread_local SeenPlaces seen;
  const Eigen::Vector3f from = (turn.centre_enu - beams.centre_enu).cast<float>();
  locate_cells(beam_grid_, {kEnuAxes, {from.x(), from.y(), from.z()}}, turn.skin, begin, end, seen);
  beams.beams.count(seen, turn.own.data() + begin);
}

void Visibility::sum_sightings(Turn& turn) const {
  thread_local std::vector<PresenceCount> sums;
  if (sums.size() < turn.own.size()) sums.resize(turn.own.size());
  skin_->sum_around(turn.neighbours, turn.own.data(), sums.data());
  for (std::size_t i = 0; i < turn.own.size(); ++i) {
    const PresenceCount own = turn.own[i], sum = sums[i];
    const auto sightings = [](PresenceCount count) {
      return Sightings{static_cast<std::uint16_t>(count.free()), static_cast<std::uint16_t>(count.occupied())};
    };
    // Where a surface meets another one, as a wheel the road, a point that moves by itself is outvoted by less.
    const bool keeps_own = sightings(own).is_moving() && kOutvoted * sum.free() > sum.occupied();
    turn.sightings[i] = sightings(keeps_own ? own : sum);
  }
}

/// Asks the turns from `first` on about all turns, and the earlier turns about those. `everything`: none will follow.
void Visibility::ask_around(WorkerPool& pool, std::uint64_t first, bool everything) {
  struct Piece {
    std::size_t turn, begin, end;
  };
  std::vector<Piece> pieces;
  const auto is_near = [&](const Turn& a, const Turn& b) {
    const nanoseconds away = std::chrono::abs(a.time - b.time);
    // A turn would only find its own points.
    return away >= config_.turn && away <= config_.turn_reach;
  };
  const auto first_new = static_cast<std::size_t>(first - first_turn_);
  for (std::size_t t = 0; t < turns_.size(); ++t) {
    if (turns_[t].own.empty() || turns_[t].time + config_.turn_reach < turns_[first_new].time) continue;
    for (std::size_t begin = 0; begin < turns_[t].skin.size(); begin += kSkinPiece)
      pieces.push_back({t, begin, std::min(turns_[t].skin.size(), begin + kSkinPiece)});
  }
  pool.run(pieces.size(), [&](std::size_t i) {
    const Piece& piece = pieces[i];
    for (std::size_t b = piece.turn >= first_new ? 0 : first_new; b < turns_.size(); ++b)
      if (is_near(turns_[piece.turn], turns_[b])) ask(turns_[piece.turn], turns_[b], piece.begin, piece.end);
  });
  const bool is_due = everything || first / kSumEvery != (first_turn_ + turns_.size()) / kSumEvery;
  const auto is_over = [&](const Turn& turn) {
    return turn.time + config_.turn_reach + kLateTurn < turns_[first_new].time;
  };
  pool.run(turns_.size(), [&](std::size_t t) {
    if (!turns_[t].own.empty() && (is_due || is_over(turns_[t]) || t >= first_new)) sum_sightings(turns_[t]);
  });
  for (Turn& turn : turns_) {
    if (turn.own.empty() || !is_over(turn)) continue;
    // Nothing is added to its sightings any more.
    turn.own = {};
    spare_neighbours_.push_back(std::move(turn.neighbours));
  }
}

/// Adds what stands still in the turns from number `first` on.
void Visibility::add_turns(const Moment& moment, std::uint64_t first, DepthMap& map) const {
  thread_local SeenPlaces seen;
  for (std::uint64_t number = std::max(first_turn_, first); number < first_turn_ + turns_.size(); ++number) {
    const Turn& turn = turns_[static_cast<std::size_t>(number - first_turn_)];
    if (std::chrono::abs(turn.time - moment.time) > config_.depth_reach) continue;
    const RelativeHead head = moment.viewpoint->relative_to(turn.centre_enu);
    for (std::size_t begin = 0; begin < turn.skin.size(); begin += kSkinPiece) {
      locate_cells(grid_, head, turn.skin, begin, std::min(turn.skin.size(), begin + kSkinPiece), seen);
      map.add(seen, [&](std::uint32_t i) { return !turn.sightings[begin + i].is_moving(); });
    }
  }
}

void Visibility::map_early(const std::vector<Moment*>& moments, WorkerPool& pool) const {
  pool.run(moments.size(), [&](std::size_t i) {
    Moment& moment = *moments[i];
    moment.early.emplace(config_.depth, memory_);
    add_turns(moment, 0, *moment.early);
    moment.early->close();
  });
}

void Visibility::map(const std::vector<Moment*>& moments, const std::deque<PlacedBatch>& placed,
                     WorkerPool& pool) const {
  // The batches before this one are in turns that are complete.
  std::uint64_t end = next_batch_;
  for (const auto& [sensor, open] : open_)
    if (!open.batches.empty()) end = std::min(end, open.batches.front()->number);
  const auto add_standing = [&](Moment& moment) {
    if (!moment.standing) moment.standing.emplace(config_.depth, memory_);
    add_turns(moment, moment.next_turn, *moment.standing);
    moment.next_turn = first_turn_ + turns_.size();
    moment.newest_turn = newest_;
    moment.standing->close();
    moment.early.reset();
  };
  const auto add_glance = [&](Moment& moment) {
    thread_local SeenPlaces seen;
    RelativePlaces below;
    if (!moment.glance) moment.glance.emplace(config_.depth, memory_);
    auto batch = std::partition_point(placed.begin(), placed.end(),
                                      [&](const PlacedBatch& b) { return b.number < moment.next_glance; });
    moment.next_glance = end;
    for (; batch != placed.end() && batch->number < end; ++batch) {
      const RelativePlaces& places = batch->placed.places;
      const auto is_within = [&](nanoseconds reach) {
        return batch->last >= moment.time - reach && batch->batch.time <= moment.time + reach;
      };
      if (!is_within(config_.moving_glance)) continue;
      const bool is_near = is_within(config_.glance);
      const RelativeHead head = moment.viewpoint->relative_to(batch->placed.scanner_enu);
      const OfBatch sighted = sightings(*batch);
      locate_cells(grid_, head, places, seen);
      for (std::size_t i = 0; i < places.size(); ++i) {
        if (!is_near && !sighted[i].is_moving()) continue;
        if (sighted[i].is_moving()) moment.met.add(batch->batch.time > moment.time, seen.cell[i], seen.nearness[i]);
        moment.glance->add(seen.cell[i], seen.nearness[i]);
        if (!sighted[i].is_moving()) continue;
        // What moves stands on the ground, but the beams may have met only its upper part.
        for (float down = kGroundStep_m; down < kGround_m; down += kGroundStep_m) {
          below.x.push_back(places.x[i]);
          below.y.push_back(places.y[i]);
          below.z.push_back(places.z[i] - down);
        }
      }
      if (below.size() == 0) continue;
      locate_cells(grid_, head, below, seen);
      for (std::size_t i = 0; i < below.size(); ++i) moment.glance->add(seen.cell[i], seen.nearness[i]);
      below = {};
    }
    moment.glance->close();
    moment.met.sort();
  };
  std::vector<std::pair<Moment*, bool>> due;  // and whether it is the map of what stands
  for (Moment* moment : moments) {
    if (!moment->newest_turn || newest_ >= *moment->newest_turn + config_.renewal) due.emplace_back(moment, true);
    if (!moment->glance || moment->next_glance < end) due.emplace_back(moment, false);
  }
  if (due.empty()) return;  // as in most calls
  pool.run(due.size(), [&](std::size_t i) {
    const auto [moment, is_standing] = due[i];
    if (is_standing) {
      add_standing(*moment);
    } else {
      add_glance(*moment);
    }
  });
}

Visibility::OfBatch Visibility::sightings(const PlacedBatch& batch) const {
  OfBatch out;
  if (batch.turn < first_turn_ || batch.turn == 0) return out;
  out.sightings_ = turns_[static_cast<std::size_t>(batch.turn - first_turn_)].sightings.data();
  out.on_skin_ = batch.on_skin.data();
  return out;
}

void Visibility::forget_before(GpsTime time) {
  while (!turns_.empty() && turns_.front().time + config_.turn < time - config_.depth_reach) {
    turns_.pop_front();
    ++first_turn_;
  }
}

}  // namespace hueline::fusion
