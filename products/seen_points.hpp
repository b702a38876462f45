#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "fusion/depth_map.hpp"
#include "fusion/worker_pool.hpp"
#include "products/image_tables.hpp"
#include "products/lens_picture.hpp"

namespace hueline::products {

/// Finds which points of a sample the pictures of a drive show. A point is seen if it has a pixel
/// (LensPicture::pixel()) and nothing in the cloud hides it: what stands still, at any time of the drive, and what
/// moves, around the time of the picture. Give it the cloud as it comes, then call find().
///
/// It remembers which cells of 0.16 m hold points. If they are more than Config::most_cells, cells become larger, so
/// what is near to the lenses may have gaps. The results depend on the points alone, not on their order or the number
/// of threads. Thread safety: none; one thread calls all functions.
class SeenPoints {
 public:
  struct Config {
    fusion::DepthMap::Config depth;  ///< for what stands still
    /// For what moves. Beams meet little of it, and it is not where they met it, so more around it is hidden.
    fusion::DepthMap::Config depth_of_moving{.gap = 0.03, .guard = 0.05};
    double farthest_m = 100;                               ///< points that are farther from a lens are not looked for
    nanoseconds glance{110'000'000};                       ///< how long what moves is taken to be where it was
    std::size_t most_cells = std::size_t{1} << 25;         ///< of what stands still; a quarter of what moves
    std::size_t most_observations = std::size_t{1} << 24;  ///< of all pictures
  };
  explicit SeenPoints(const Config& config);

  /// Takes points that may hide others.
  void add(const CloudBlock& block);
  /// Returns for each picture which of `points` it shows, in the order of the points. Each picture has the same share
  /// of Config::most_observations; in one that shows more points, the same points are left out as in others.
  std::vector<std::vector<Observation>> find(std::span<const ColouredPoint> points,
                                             std::span<const TakenPicture> pictures,
                                             std::span<const LensPicture> lenses, fusion::WorkerPool& pool);

 private:
  /// A cell of what moves, and when it was there, in steps of kTick.
  struct Passing {
    std::int64_t tick;
    std::uint64_t cell;
    auto operator<=>(const Passing&) const = default;
  };
  struct Placed {
    std::uint64_t cell;
    std::uint32_t point;
    auto operator<=>(const Placed&) const = default;
  };
  void thin_standing();
  void thin_moving();
  std::vector<Observation> look(const TakenPicture& picture, const LensPicture& lens,
                                std::span<const ColouredPoint> points, std::span<const Placed> placed,
                                std::size_t most) const;

  Config config_;
  std::shared_ptr<fusion::DepthMap::Memory> memory_;
  std::vector<std::uint64_t> standing_;
  std::vector<Passing> moving_;
  std::size_t thin_standing_at_, thin_moving_at_;  // sizes
  int standing_bits_, moving_bits_;                // steps of a cell's width are two to the power of this
};

}  // namespace hueline::products
