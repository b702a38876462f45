#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

/// Finds the direction in which points lie from the head, as cells of a grid, for whole batches at once.
namespace hueline::fusion {

/// A grid of directions around the head. Columns go around the head's z axis, rows from straight down to straight up.
/// The steps are equal angles within 10 %, for the angles are calculated without trigonometry.
struct DirectionGrid {
  /// `cell` is the width of a cell in rad.
  explicit DirectionGrid(double cell);
  int columns, rows;
  std::size_t size() const { return static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows); }
};

/// Places relative to an origin near them, m, with axes parallel to ENU. Single precision keeps 0.01 mm at 100 m.
struct RelativePlaces {
  std::vector<float> x, y, z;
  std::size_t size() const { return x.size(); }
  void resize(std::size_t size) {
    x.resize(size);
    y.resize(size);
    z.resize(size);
  }
  void set(std::size_t index, const std::array<float, 3>& place) {
    x[index] = place[0];
    y[index] = place[1];
    z[index] = place[2];
  }
};

/// Where a lens looks from and to, in the head's frame.
struct LensEye {
  std::array<float, 3> axis;    ///< of unit length
  std::array<float, 3> centre;  ///< m
};

/// The head at one moment, as seen from the origin of RelativePlaces.
struct RelativeHead {
  std::array<float, 9> R_head_enu;  ///< row by row
  std::array<float, 3> origin;      ///< of the places, in ENU axes, from the head's centre, m
  /// The lenses of the head, at most kMostLenses; empty: places are seen from its centre. A place is seen by the lens
  /// whose axis is nearest.
  std::span<const LensEye> eyes{};
  /// Returns a place in the head's frame.
  std::array<float, 3> place(float x, float y, float z) const {
    const float dx = x + origin[0], dy = y + origin[1], dz = z + origin[2];
    const auto& R = R_head_enu;
    return {R[0] * dx + R[1] * dy + R[2] * dz, R[3] * dx + R[4] * dy + R[5] * dz, R[6] * dx + R[7] * dy + R[8] * dz};
  }
};

/// How a user of a grid numbers its cells: a cell has the index column * per_column + row * per_row + first.
struct CellOrder {
  std::int32_t per_column, per_row, first;
};

/// Where the head sees places, one element for each place; from the lens that sees them (RelativeHead::eyes).
struct SeenPlaces {
  std::vector<std::uint32_t> cell;  ///< index in the grid: row * columns + column, where no other order is given
  std::vector<float> nearness;      ///< 1 / distance, 1/m
  /// Angle between the lines to the place from the lens and from the places' origin, as a chord, rad. The origin is a
  /// scanner, and the scanner saw the place. Empty if locate_cells() found the places.
  std::vector<float> parallax;
};

/// Calculates where the head sees the places. Places at the lens's centre get a nearness of 0. Uses the widest vector
/// instructions that the processor has; the results have the same bits with each of them.
void locate(const DirectionGrid& grid, const RelativeHead& head, const RelativePlaces& places, SeenPlaces& out);
/// The same without the parallax, which costs half of the time, for all places, in another order of the cells, and for
/// the places from index `begin` to `end`.
void locate_cells(const DirectionGrid& grid, const RelativeHead& head, const RelativePlaces& places, SeenPlaces& out);
void locate_cells(const DirectionGrid& grid, const CellOrder& order, const RelativeHead& head,
                  const RelativePlaces& places, SeenPlaces& out);
void locate_cells(const DirectionGrid& grid, const RelativeHead& head, const RelativePlaces& places, std::size_t begin,
                  std::size_t end, SeenPlaces& out);

}  // namespace hueline::fusion
