#pragma once

#include "sim/noise.hpp"
#include "sim/scene.hpp"

/// Parts that scenes are put together from. Offsets are to the right of the centre line, m; `side` is 1 for its right
/// side, -1 for its left side.
namespace hueline::sim {

constexpr double kStreetBehind = 66.0, kStreetAhead = 86.0;  ///< m of scene before the start and after the halt

/// A ribbon along the centre line between two offsets, heights left and right; texture u = s, v = lateral offset, or
/// height above the lower edge where the ribbon is not level.
void add_ribbon(Mesh& mesh, const CentreLine& line, double from, double to, double left, double z_left, double right,
                double z_right, QuadTag tag);
/// Road, kerbs, pavements, grass behind them.
void add_road(Scene& scene, const StreetConfig& config, const CentreLine& line, double drive_length);
/// A level plain of 1 km, 8 cm below the road.
void add_plain(Scene& scene, const CentreLine& line, double drive_length, Material material);

FacadeStyle draw_facade(Draw& draw, double width, std::uint32_t least_storeys, std::uint32_t more_storeys);
/// Front between two ground points seen from the street with `a` on the left; walls go `depth` back.
void add_building(Scene& scene, Vec3 a, Vec3 b, double base, double depth, const FacadeStyle& style, bool furnished);
/// Houses side by side, their fronts `lateral` from the centre line, now and then a garden wall.
struct RowOfHouses {
  double side = 1, lateral_m = 6, base_m = 0.12;
  std::uint32_t least_storeys = 2, more_storeys = 3;  ///< upper limit: least + more - 1
};
void add_houses(Scene& scene, const Scenario& scenario, const CentreLine& line, double drive_length,
                const RowOfHouses& row);
/// A house across the street at `s`, seen from the side of smaller s if left < right.
void add_end(Scene& scene, const Scenario& scenario, const CentreLine& line, Draw& draw, double s, double left,
             double right);

std::vector<Albedo> usual_paints();
void add_tree(Scene& scene, Vec3 foot, int leaves, Draw& draw, std::uint32_t number);
void add_lamp(Scene& scene, Vec3 foot, Vec3 towards_road, std::uint32_t number);
/// One to a list of shapes.
void add_car(Mesh& mesh, const Pose& T, std::uint16_t surface, std::uint32_t paint);
void add_van(Mesh& mesh, const Pose& T, std::uint16_t surface, std::uint32_t paint);
void add_person(Mesh& mesh, const Pose& T, std::uint16_t surface, std::uint32_t clothes);
/// Trees, lamps, signs, parked cars and the street's oncoming cars.
void add_furniture(Scene& scene, const Scenario& scenario, const CentreLine& line, double drive_length);

/// Whole scenes.
Scene build_street(const Scenario& scenario, const CentreLine& line, double drive_length);
Scene build_square(const Scenario& scenario, const CentreLine& line, double drive_length);
Scene build_canyon(const Scenario& scenario, const CentreLine& line, double drive_length);
Scene build_alley(const Scenario& scenario, const CentreLine& line, double drive_length);
Scene build_traffic(const Scenario& scenario, const CentreLine& line, double drive_length);
Scene build_tunnel(const Scenario& scenario, const CentreLine& line, double drive_length);
Scene build_targets(const Scenario& scenario, const CentreLine& line, double drive_length);

}  // namespace hueline::sim
