#pragma once

#include <vector>

#include "sim/noise.hpp"
#include "sim/scene.hpp"

/// Parts from which scenes are built. Lateral offsets are to the right of the centre line, in m; `side` is 1 for its
/// right side and -1 for its left.
namespace hueline::sim {

/// Length of the scene before the start and after the halt, m.
constexpr double kStreetBehind = 66.0, kStreetAhead = 86.0;

/// Adds a ribbon along the centre line from s = `from` to `to`, between two lateral offsets with their heights.
/// Texture: u = s; v is the lateral offset, or the height above the lower edge where the ribbon is not level.
void add_ribbon(Mesh& mesh, const CentreLine& line, double from, double to, double left, double z_left, double right,
                double z_right, QuadTag tag);
/// Adds road, kerbs, pavements and the grass behind them.
void add_road(Scene& scene, const StreetConfig& config, const CentreLine& line, double drive_length);
/// Adds a level plain of 1 km, 8 cm below the road.
void add_plain(Scene& scene, const CentreLine& line, double drive_length, Material material);

/// Draws the look of a front. It has `least_storeys` to `least_storeys + more_storeys - 1` storeys.
FacadeStyle draw_facade(Draw& draw, double width, std::uint32_t least_storeys, std::uint32_t more_storeys);
/// Adds a building whose front stands between two ground points, `a` on the left seen from the street; its walls reach
/// `depth` back.
void add_building(Scene& scene, Vec3 a, Vec3 b, double base, double depth, const FacadeStyle& style, bool furnished);
/// A row of houses side by side, with a garden wall now and then. `lateral_m` is the distance of their fronts from the
/// centre line.
struct RowOfHouses {
  double side = 1, lateral_m = 6, base_m = 0.12;
  std::uint32_t least_storeys = 2, more_storeys = 3;  ///< a house has at most least_storeys + more_storeys - 1
};
/// Adds a row of houses along the whole street.
void add_houses(Scene& scene, const Scenario& scenario, const CentreLine& line, double drive_length,
                const RowOfHouses& row);
/// Adds a house across the street at `s`. Its front faces smaller s if left < right.
void add_end(Scene& scene, const Scenario& scenario, const CentreLine& line, Draw& draw, double s, double left,
             double right);

/// Returns the colours of Scene::paints.
std::vector<Albedo> usual_paints();
/// Returns the paint of a car that has the paint `usual` where cars have their usual colours.
std::uint32_t car_paint(const StreetConfig& street, std::uint32_t usual);
/// Adds a tree with its foot at `foot`. `number` is a part of the names of its surfaces and decides its tint.
void add_tree(Scene& scene, Vec3 foot, int leaves, Draw& draw, std::uint32_t number);
/// Adds a wire that hangs from `a` to `b` with its middle `sag` below the straight line.
void add_wire(Scene& scene, Vec3 a, Vec3 b, double sag, double radius_m, std::uint16_t surface);
/// Adds the wires, fences and stakes that the street has.
void add_thin_things(Scene& scene, const StreetConfig& config, const CentreLine& line, double drive_length);
/// Adds the room behind the panes of a house, and the panes. T is the frame of the house (add_building()), the opening
/// reaches from `x0` to `x1` and from `z0` to `z1` in it.
void add_showroom(Scene& scene, const Pose& T, double x0, double x1, double z0, double z1, std::uint32_t number);

/// Adds a lamp post with its foot at `foot` and its arm in the direction `towards_road`.
void add_lamp(Scene& scene, const StreetConfig& street, Vec3 foot, Vec3 towards_road, std::uint32_t number);
/// Adds the headlights of the own vehicle and of all vehicles that move.
void add_headlights(Scene& scene, const Scenario& scenario);
/// Add one car, van, lorry or person to the mesh of a shape, in the frame T.
constexpr double kCarFront = 2.17, kVanFront = 2.75, kLorryFront = 6.26;  ///< y of their headlights, m
void add_car(Mesh& mesh, const Pose& T, std::uint16_t surface, std::uint32_t paint);
void add_van(Mesh& mesh, const Pose& T, std::uint16_t surface, std::uint32_t paint);
void add_lorry(Mesh& mesh, const Pose& T, std::uint16_t surface, std::uint32_t paint);
void add_person(Mesh& mesh, const Pose& T, std::uint16_t surface, std::uint32_t clothes);
/// Adds trees, lamps, signs, parked cars and the oncoming cars of the street.
void add_furniture(Scene& scene, const Scenario& scenario, const CentreLine& line, double drive_length);

/// Adds the road users that the scenario lists.
void add_road_users(Scene& scene, const Scenario& scenario, double drive_length);

/// Build whole scenes, one function for each SceneKind.
Scene build_street(const Scenario& scenario, const CentreLine& line, double drive_length);
Scene build_square(const Scenario& scenario, const CentreLine& line, double drive_length);
Scene build_canyon(const Scenario& scenario, const CentreLine& line, double drive_length);
Scene build_alley(const Scenario& scenario, const CentreLine& line, double drive_length);
Scene build_traffic(const Scenario& scenario, const CentreLine& line, double drive_length);
Scene build_tunnel(const Scenario& scenario, const CentreLine& line, double drive_length);
Scene build_targets(const Scenario& scenario, const CentreLine& line, double drive_length);

}  // namespace hueline::sim
