#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sim/vec3.hpp"

/// A static scanner on a tripod in an open pit, with sphere targets on tripods, spheres that are not targets, trees,
/// walls and piles: the truth for the orientation of static scans. It has its own geometry and uses nothing of
/// calibration/.
namespace hueline::sim {

/// What a sphere is for: a target that orients the scan, a target that checks the orientation, or no target at all.
enum class SphereKind { Orientation, Check, Decoy };

/// A sphere. Coordinates are in the site's frame: x east, y north, z up, origin at the scanner, m.
struct StaticSphere {
  std::string name;
  SphereKind kind = SphereKind::Orientation;
  Vec3 centre;
  double radius = 0;
  double common_range_error = 0;  ///< range error that all its points share
  double stand_height = 0;        ///< height of the pole under it
};
/// An upright wall from height `bottom` to height `top`.
struct StaticWall {
  double x0 = 0, y0 = 0, x1 = 0, y1 = 0, bottom = 0, top = 0;
};
/// An upright pole.
struct StaticPole {
  double x = 0, y = 0, radius = 0, bottom = 0, top = 0;
};
/// A ball of leaves, in which a beam travels 1 / density on average.
struct StaticCrown {
  Vec3 centre;
  double radius = 0, density = 0;
};

/// The properties of a site.
struct StaticSiteConfig {
  std::uint64_t seed = 1;
  int station = 0;           ///< number of the station on the site; each has its own targets and ground
  double radius_m = 0.0725;  ///< radius of targets and decoys
  int orientation_targets = 4, check_targets = 2;
  double nearest_m = 70, farthest_m = 273;
  double decoy_share = 0.3;               ///< share of all spheres that are decoys
  double common_range_sigma_m = 0.00624;  ///< VZ-1000: 8 mm accuracy without its 5 mm precision
  double survey_sigma_m = 0.003;          ///< sigma of a target's surveyed coordinate
  double station_sigma_m = 0.010;         ///< sigma of the station's surveyed coordinate
};

/// A site with its truth and with what surveyors measured.
struct StaticSite {
  StaticSiteConfig config;
  std::string name;     ///< S01, S02, ...
  Vec3 place_survey;    ///< true place of the scanner's origin, in the survey frame
  Vec3 surveyed_place;  ///< the same as the surveyors measured it
  Mat3 R_site_scanner;  ///< true heading, and a tilt of up to 3 degrees
  std::vector<StaticSphere> spheres;
  std::vector<Vec3> surveyed;  ///< surveyed centre of each sphere, in the survey frame; meaningless for decoys
  std::vector<StaticWall> walls;
  std::vector<StaticPole> poles;
  std::vector<StaticCrown> crowns;

  /// Returns the height of the ground.
  double ground(double x, double y) const;
};

/// Builds a site. Equal configurations give equal sites.
StaticSite make_static_site(const StaticSiteConfig& config);

}  // namespace hueline::sim
