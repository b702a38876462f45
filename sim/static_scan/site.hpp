#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sim/vec3.hpp"

/// A static scanner on a tripod in an open pit, with sphere targets on tripods, spheres that are none of them, trees,
/// walls and piles: the truth for the orientation of static scans. Own geometry; knows nothing of calibration/.
namespace hueline::sim {

enum class SphereKind { Orientation, Check, Decoy };

/// Coordinates in the site's frame: x east, y north, z up, origin at the scanner, m.
struct StaticSphere {
  std::string name;
  SphereKind kind = SphereKind::Orientation;
  Vec3 centre;
  double radius = 0;
  double common_range_error = 0;  ///< of all its points
  double stand_height = 0;        ///< of the pole under it
};
/// Upright; from the foot's height to the top's.
struct StaticWall {
  double x0 = 0, y0 = 0, x1 = 0, y1 = 0, bottom = 0, top = 0;
};
struct StaticPole {
  double x = 0, y = 0, radius = 0, bottom = 0, top = 0;
};
/// A ball of leaves: a beam goes on through them for 1 / density on average.
struct StaticCrown {
  Vec3 centre;
  double radius = 0, density = 0;
};

struct StaticSiteConfig {
  std::uint64_t seed = 1;
  int station = 0;           ///< which one of the site's stations: other targets, other ground
  double radius_m = 0.0725;  ///< of targets and decoys
  int orientation_targets = 4, check_targets = 2;
  double nearest_m = 70, farthest_m = 273;
  double decoy_share = 0.3;               ///< of all spheres
  double common_range_sigma_m = 0.00624;  ///< VZ-1000: 8 mm accuracy less 5 mm precision
  double survey_sigma_m = 0.003;          ///< of a target's coordinate
  double station_sigma_m = 0.010;         ///< of the station's
};

struct StaticSite {
  StaticSiteConfig config;
  std::string name;     ///< S01 ...
  Vec3 place_survey;    ///< true place of the scanner's origin
  Vec3 surveyed_place;  ///< as the surveyors have it
  Mat3 R_site_scanner;  ///< true heading and a tilt of up to 3 degrees
  std::vector<StaticSphere> spheres;
  std::vector<Vec3> surveyed;  ///< of each sphere, in the survey frame; of decoys meaningless
  std::vector<StaticWall> walls;
  std::vector<StaticPole> poles;
  std::vector<StaticCrown> crowns;

  /// Height of the ground.
  double ground(double x, double y) const;
};

StaticSite make_static_site(const StaticSiteConfig& config);

}  // namespace hueline::sim
