#include "sim/scene.hpp"

#include "sim/scene_parts.hpp"

namespace hueline::sim {
namespace {

Scene build(const Scenario& c, const CentreLine& line, double drive_length) {
  switch (c.scene) {
    case SceneKind::Street:
      return build_street(c, line, drive_length);
    case SceneKind::Square:
      return build_square(c, line, drive_length);
    case SceneKind::Canyon:
      return build_canyon(c, line, drive_length);
    case SceneKind::Alley:
      return build_alley(c, line, drive_length);
    case SceneKind::Traffic:
      return build_traffic(c, line, drive_length);
    case SceneKind::Tunnel:
      return build_tunnel(c, line, drive_length);
    case SceneKind::Targets:
      return build_targets(c, line, drive_length);
  }
  return {};
}

}  // namespace

std::uint16_t add_surface(Scene& scene, const std::string& name) {
  scene.surfaces.push_back(name);
  return static_cast<std::uint16_t>(scene.surfaces.size() - 1);
}

Scene build_scene(const Scenario& c, const CentreLine& line, double drive_length) {
  Scene scene = build(c, line, drive_length);
  add_road_users(scene, c, drive_length);
  add_headlights(scene, c);
  scene.paints = usual_paints();
  scene.road_half_width_m = c.street.road_width_m / 2;
  scene.zebra_at_m = c.street.zebra_at_m;
  return scene;
}

}  // namespace hueline::sim
