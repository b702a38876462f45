#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace hueline::calibration {

/// A pixel of a lens image that shows something which other images have shown too.
struct PredictedPixel {
  std::uint16_t x = 0, y = 0;                   ///< pixel of the lens image
  std::array<std::uint8_t, 3> predicted, seen;  ///< the colour that the other images gave it, and its own
};

/// Learns which part of a lens image is the own vehicle: what stays the same while the world moves.
///
/// What the images of other places showed of the world is predicted for an image again and again. Where a lens sees
/// the world, its pixels follow the predictions: they correlate over time, after the mean of their surroundings in
/// each image is taken away (light and shade reach vehicle and world alike) and the mean of each cell over time (the
/// vehicle's pattern, the lens's vignetting). Where it sees the vehicle they do not, though the predictions change.
/// Where the predictions have no texture, an even road say, the colours themselves decide if they are the same or
/// clearly differ; otherwise nothing is known.
///
/// Depends on nothing but the views, and their order. Memory: 56 bytes a cell, of which there are at most
/// kMostColumns in a row. Thread safety: none.
class VehicleMask {
 public:
  static constexpr int kMostColumns = 640;
  enum class Cell : std::uint8_t { Unknown, World, Vehicle };

  struct Found {
    int cell_px = 1, columns = 0, rows = 0;
    std::vector<Cell> cells;    ///< by rows, as the views decided; Unknown where they said too little
    std::vector<bool> vehicle;  ///< by rows, without gaps and specks
    /// Closed polygons of the lens image, px, pixel centres at whole numbers: whole cells. None contains another; the
    /// world inside a part of the vehicle is masked with it. Empty: the lens does not see the vehicle.
    std::vector<std::vector<Eigen::Vector2d>> polygons;
    std::vector<std::array<std::uint8_t, 3>> mean;  ///< the mean of what each cell showed, by rows
    std::uint64_t compared = 0;                     ///< pixels
    int views = 0;
    /// Whether the views suffice: kFewestViews from different places, and an eighth of the cells decided.
    bool is_determined = false;
  };
  static constexpr int kFewestViews = 8;

  VehicleMask(int width, int height);
  /// Adds what one image showed. The head must have moved since the view before.
  void add(std::span<const PredictedPixel> view);
  Found find() const;

 private:
  struct Evidence {
    std::uint32_t compared = 0, alike = 0;  // pixels, and those of the colour that was predicted
    std::array<std::uint32_t, 3> sum{};     // of the colours seen
    // Of the brightness without the mean of its surroundings: sums of what was seen (s) and predicted (p).
    float local = 0, s = 0, p = 0, ss = 0, pp = 0, sp = 0;
  };
  struct Brightness {
    float count = 0, seen = 0, predicted = 0;
  };
  std::vector<Cell> decide() const;

  int width_, height_, cell_px_, columns_, rows_;
  std::vector<Evidence> cells_;
  std::vector<Brightness> view_;  // of each cell, of the view that is added
  std::uint64_t compared_ = 0;
  int views_ = 0;
};

}  // namespace hueline::calibration
