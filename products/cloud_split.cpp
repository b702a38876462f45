#include "products/cloud_split.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <string_view>
#include <system_error>
#include <utility>

#include "core/calendar.hpp"
#include "products/laz_file.hpp"
#include "products/point_upgrade.hpp"
#include "products/points_at_once.hpp"
#include "storage/cloud_crs.hpp"
#include "storage/las_reader.hpp"

namespace hueline::products {
namespace {

using storage::Bytes;
using storage::LasPoint;

constexpr std::size_t kMostOpen = 32;  // files
constexpr std::size_t kMostTiles = 20'000;
/// The cloud is read this often at most. Each reading writes kMostOpen of the parts that have points at one place of
/// the cloud.
constexpr std::size_t kMostReadings = 100;
// Where fields are in a record.
constexpr std::size_t kUserData = 17;
std::size_t point_source_at(int point_format) { return point_format < 6 ? 18 : 20; }

/// How the name of a part ends from which an octree is made.
constexpr const char* kBeforeOctree = ".part.laz";

/// A strip's number, or column and row of a tile.
using Cell = std::pair<std::int64_t, std::int64_t>;

/// What is known of a part before it is written.
struct Plan {
  std::uint64_t points = 0, first_index = 0, last_index = 0;
  std::array<std::uint64_t, 15> by_return{};
  std::array<double, 3> minimum, maximum;
  GpsTime first{}, last{};

  void add(const LasPoint& point, std::uint64_t index, GpsTime time) {
    const std::array<double, 3> place{point.x, point.y, point.z};
    if (points == 0) {
      minimum = maximum = place;
      first = last = time;
      first_index = index;
    }
    ++points;
    last_index = index;
    if (point.return_number >= 1 && point.return_number <= by_return.size()) ++by_return[point.return_number - 1u];
    for (std::size_t k = 0; k < 3; ++k) {
      minimum[k] = std::min(minimum[k], place[k]);
      maximum[k] = std::max(maximum[k], place[k]);
    }
    first = std::min(first, time);
    last = std::max(last, time);
  }
};

class Splitter {
 public:
  /// `edge` is that of a tile in the unit of the cloud's CRS.
  Splitter(storage::LasReader reader, const std::filesystem::path& folder, const CloudSplit& split, double edge,
           const std::vector<GpsTime>& ends, bool is_copc, const CloudExport& options)
      : reader_(std::move(reader)),
        folder_(folder),
        split_(split),
        edge_(edge),
        ends_(ends),
        is_copc_(is_copc),
        options_(options),
        records_(lasting_records(reader_.records())) {}

  Result<SplitCloud> run() {
    if (Status counted = count(); !counted) return counted.error();
    remove_unfinished();
    // Parts whose points lie far from each other in the cloud would be open for long: what finds no place now is
    // written when the cloud is read once more.
    std::map<Cell, Plan*> left;
    for (auto& [key, plan] : plans_) left[key] = &plan;
    while (!left.empty()) {
      const std::vector<Cell> chosen = choose(left);
      if (Status written = write(chosen); !written) return written.error();
      for (const Cell& key : chosen) left.erase(key);
    }
    std::sort(done_.parts.begin(), done_.parts.end(), [](const auto& a, const auto& b) { return a.file < b.file; });
    return std::move(done_);
  }

 private:
  bool is_strip() const { return split_.kind != CloudSplit::Kind::Tile; }

  Result<Cell> key_of(const LasPoint& point, std::optional<GpsTime> time) const {
    if (!is_strip())
      return Cell{static_cast<std::int64_t>(std::floor(point.x / edge_)),
                  static_cast<std::int64_t>(std::floor(point.y / edge_))};
    if (!time)
      return Error{ErrorCode::Invalid,
                   "the times of the cloud have no week: it cannot be cut into strips (tile:100m can)"};
    if (split_.kind == CloudSplit::Kind::Time)
      return Cell{count_ns(*time) / std::max<std::int64_t>(1, from_seconds(split_.size).count()), 0};
    return Cell{std::upper_bound(ends_.begin(), ends_.end(), *time) - ends_.begin(), 0};
  }

  /// Calls use(point, its number, key, time) for every point. `use` returns a Status.
  template <class Use>
  Status for_each(const Use& use) {
    reader_.rewind();
    std::vector<LasPoint> points;
    for (std::uint64_t index = 0;;) {
      const Status read = reader_.next(points, kPointsAtOnce);
      if (!read && read.error().code != ErrorCode::Truncated) return source_error(read.error());
      if (!read) done_.source_was_cut = true;
      if (points.empty()) return {};
      for (const LasPoint& point : points) {
        const std::optional<GpsTime> time = reader_.gps_time(point);
        const Result<Cell> key = key_of(point, time);
        if (!key) return key.error();
        if (Status used = use(point, index++, *key, time.value_or(GpsTime{})); !used) return used;
      }
    }
  }

  Status count() {
    const std::size_t most = is_strip() ? std::numeric_limits<std::uint16_t>::max() : kMostTiles;
    Status counted = for_each([&](const LasPoint& point, std::uint64_t index, const Cell& key, GpsTime time) -> Status {
      plans_[key].add(point, index, time);
      if (plans_.size() <= most) return {};
      return Error{ErrorCode::Invalid,
                   fmt::format("there would be more than {} {}: give a greater size", most, name_of_parts())};
    });
    if (!counted) return counted;
    if (plans_.empty() && done_.source_was_cut)
      return Error{ErrorCode::Truncated, "the cloud ends before its first point"};
    if (plans_.empty()) return Error{ErrorCode::EndOfData, "the cloud has no points: there is nothing to export"};
    if (is_strip() && plans_.rbegin()->first.first - plans_.begin()->first.first >= static_cast<std::int64_t>(most))
      return Error{
          ErrorCode::Invalid,
          fmt::format("the strips would have numbers above {}, which LAS does not have: give a greater size", most)};
    if (const std::size_t together = most_together(); together > kMostOpen * kMostReadings)
      return Error{ErrorCode::Invalid,
                   fmt::format("of {} {}, {} have points at one place of the cloud, which would have to be read {} "
                               "times to write them: give a greater size",
                               plans_.size(), name_of_parts(), together, (together + kMostOpen - 1) / kMostOpen)};
    return {};
  }

  const char* name_of_parts() const { return is_strip() ? "strips" : "tiles"; }

  /// Returns how many parts have both begun and not ended at the place of the cloud where these are most.
  std::size_t most_together() const {
    std::vector<std::uint64_t> begins, ends;
    for (const auto& [key, plan] : plans_) {
      begins.push_back(plan.first_index);
      ends.push_back(plan.last_index);
    }
    std::ranges::sort(begins);
    std::ranges::sort(ends);
    std::size_t most = 0, ended = 0;
    for (std::size_t begun = 0; begun < begins.size(); ++begun) {
      while (ends[ended] < begins[begun]) ++ended;
      most = std::max(most, begun + 1 - ended);
    }
    return most;
  }

  /// Returns the parts that one reading can write: at no place of the cloud are more than kMostOpen of them open.
  static std::vector<Cell> choose(const std::map<Cell, Plan*>& left) {
    std::vector<std::pair<Cell, const Plan*>> in_order(left.begin(), left.end());
    std::sort(in_order.begin(), in_order.end(),
              [](const auto& a, const auto& b) { return a.second->first_index < b.second->first_index; });
    std::vector<Cell> out;
    std::vector<std::uint64_t> open;  // where each open part ends
    for (const auto& [key, plan] : in_order) {
      const std::uint64_t begin = plan->first_index;
      std::erase_if(open, [begin](std::uint64_t end) { return end < begin; });
      if (open.size() >= kMostOpen) continue;
      open.push_back(plan->last_index);
      out.push_back(key);
    }
    std::sort(out.begin(), out.end());
    return out;
  }

  /// Removes what a run that was killed has left of parts: NAME.laz.part, and NAME.part.laz of a part that was to
  /// become an octree.
  void remove_unfinished() {
    std::vector<std::filesystem::path> left;
    std::error_code error;
    for (std::filesystem::directory_iterator at(folder_, error), end; !error && at != end; at.increment(error)) {
      const std::string name = at->path().filename();
      const bool is_ours = name.starts_with("tile_") || name.starts_with("strip_");
      if (is_ours && (name.ends_with(".laz.part") || name.ends_with(kBeforeOctree)) && at->is_regular_file(error))
        left.push_back(at->path());
    }
    for (const std::filesystem::path& one : left) done_.unfinished_removed += std::filesystem::remove(one, error);
  }

  struct Open {
    LazFile file;
    CloudPart part;
    Bytes records;
    std::uint64_t left = 0;
  };

  Status write(const std::vector<Cell>& chosen) {
    std::map<Cell, Open> open;
    return for_each([&](const LasPoint& point, std::uint64_t index, const Cell& key, GpsTime) -> Status {
      const Plan& plan = plans_.at(key);
      auto at = open.find(key);
      if (at == open.end()) {
        if (index != plan.first_index || !std::binary_search(chosen.begin(), chosen.end(), key)) return {};
        auto created = create(key, plan);
        if (!created) return created.error();
        at = open.emplace(key, std::move(*created)).first;
      }
      Open& to = at->second;
      const std::size_t begin = to.records.size();
      storage::append(to.records, point.record);
      if (is_strip()) {
        to.records[begin + kUserData] = static_cast<std::byte>(std::min<std::uint16_t>(point.source, 255));
        storage::put(to.records, begin + point_source_at(reader_.header().point_format), to.part.strip);
      }
      --to.left;
      if (to.records.size() == storage::kLazChunkPoints * point.record.size() || to.left == 0)
        if (Status added = to.file.add(std::exchange(to.records, {})); !added) return added;
      if (to.left > 0) return {};
      Status closed = close(to);
      open.erase(at);
      return closed;
    });
  }

  std::string name_of(const Cell& key, const Plan& plan, std::uint16_t strip) const {
    if (!is_strip())
      return fmt::format("tile_{}_{}_{:g}m", fmt::format("{:.10g}", static_cast<double>(key.first) * edge_),
                         fmt::format("{:.10g}", static_cast<double>(key.second) * edge_), split_.size);
    const UtcTime utc = to_utc(plan.first);
    return fmt::format("strip_{:05}_{:04}{:02}{:02}T{:02}{:02}{:02}Z", strip, utc.year, utc.month, utc.day, utc.hour,
                       utc.minute, utc.second);
  }

  Result<Open> create(const Cell& key, const Plan& plan) {
    CloudPart part;
    if (is_strip()) part.strip = static_cast<std::uint16_t>(key.first - plans_.begin()->first.first + 1);
    part.file = name_of(key, plan, part.strip) + (is_copc_ ? kBeforeOctree : ".laz");
    part.points = plan.points;
    part.minimum = plan.minimum;
    part.maximum = plan.maximum;
    part.first = plan.first;
    part.last = plan.last;
    storage::LasHeader header = reader_.header();
    header.file_source_id = part.strip;
    header.minimum = plan.minimum;
    header.maximum = plan.maximum;
    header.point_count = plan.points;
    header.points_by_return = plan.by_return;
    auto file = LazFile::create(folder_ / part.file, header, records_, storage::kLazChunkPoints, options_.threads);
    if (!file) return file.error();
    return Open{std::move(*file), std::move(part), {}, plan.points};
  }

  Status close(Open& one) {
    if (Status ended = one.file.end_chunks(); !ended) return ended;
    one.part.bytes = one.file.size();
    if (Status closed = one.file.close(); !closed) return closed;
    if (is_copc_) {
      const std::filesystem::path whole = folder_ / one.part.file;
      one.part.file.replace_extension().replace_extension(".copc.laz");
      const auto made = export_copc(whole, folder_ / one.part.file, options_);
      std::error_code error;
      std::filesystem::remove(whole, error);
      if (!made) return made.error();
      one.part.bytes = made->bytes;
    }
    done_.parts.push_back(std::move(one.part));
    return {};
  }

  storage::LasReader reader_;
  std::filesystem::path folder_;
  CloudSplit split_;
  double edge_;
  std::vector<GpsTime> ends_;
  bool is_copc_;
  CloudExport options_;
  std::vector<storage::LasVlr> records_;
  std::map<Cell, Plan> plans_;
  SplitCloud done_;
};

}  // namespace

Result<CloudSplit> CloudSplit::parse(const std::string& text) {
  const Error wrong{ErrorCode::Invalid,
                    "'" + text + "' is no way to cut a cloud; allowed: time:60s, distance:500m, tile:100m"};
  const std::size_t colon = text.find(':');
  if (colon == std::string::npos) return wrong;
  const std::string_view word = std::string_view(text).substr(0, colon);
  CloudSplit out;
  if (word == "time")
    out.kind = Kind::Time;
  else if (word == "distance")
    out.kind = Kind::Distance;
  else if (word == "tile")
    out.kind = Kind::Tile;
  else
    return wrong;
  const char* const end = text.data() + text.size();
  const auto [next, error] = std::from_chars(text.data() + colon + 1, end, out.size);
  const std::string_view unit(next, static_cast<std::size_t>(end - next));
  if (error != std::errc{} || (!unit.empty() && unit != (out.kind == Kind::Time ? "s" : "m"))) return wrong;
  if (!(out.size >= 0.1 && out.size <= 1e6))
    return Error{ErrorCode::Invalid, "'" + text + "': the size must be from 0.1 to 1000000"};
  return out;
}

Result<SplitCloud> split_cloud(const std::filesystem::path& cloud, const std::filesystem::path& folder,
                               const CloudSplit& split, const std::vector<GpsTime>& ends, bool is_copc,
                               const CloudExport& options) {
  auto reader = storage::LasReader::open(cloud);
  if (!reader) return source_error(reader.error());
  if (is_copc)
    if (const auto upgrade = PointUpgrade::create(*reader); !upgrade)
      return Error{upgrade.error().code, cloud.string() + ": " + upgrade.error().message};
  double edge = split.size;
  if (split.kind == CloudSplit::Kind::Tile) {
    const Result<storage::CrsUnit> unit = storage::crs_unit(*reader);
    if (!unit) return unit.error();
    if (unit->is_angle)
      return Error{ErrorCode::Unsupported,
                   cloud.string() + ": its coordinates are longitude and latitude; tiles are squares of a map"};
    edge = split.size / unit->metres;
  }
  return Splitter(std::move(*reader), folder, split, edge, ends, is_copc, options).run();
}

void PathStrips::add(GpsTime time, const std::array<double, 3>& place) {
  constexpr double kStep_m = 0.5;
  constexpr std::size_t kMostEnds = 100'000;  // more strips than a cloud can have
  if (last_) {
    const double step = std::hypot(place[0] - (*last_)[0], place[1] - (*last_)[1], place[2] - (*last_)[2]);
    if (step < kStep_m) return;
    driven_m_ += step;
  }
  last_ = place;
  while (ends_.size() < kMostEnds && driven_m_ >= length_m_ * static_cast<double>(ends_.size() + 1))
    ends_.push_back(time);
}

}  // namespace hueline::products
