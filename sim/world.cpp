#include "sim/world.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "sim/own_vehicle.hpp"
#include "sim/world_contact.hpp"

namespace hueline::sim {
namespace {

RTCScene load(RTCDevice device, const Mesh& mesh) {
  RTCScene scene = rtcNewScene(device);
  rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);  // no light passes between neighbouring quads
  rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_HIGH);
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_QUAD);
  auto* vertices = static_cast<float*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, mesh.vertices().size()));
  for (const auto& v : mesh.vertices())
    for (const float x : v) *vertices++ = x;
  auto* corners = static_cast<unsigned*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT4, 16, mesh.faces().size()));
  for (const auto& f : mesh.faces())
    for (const auto c : f.corner) *corners++ = c;
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene);
  return scene;
}

Vec3 wide(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }

}  // namespace

World::Embree::~Embree() {
  if (still) rtcReleaseScene(still);
  if (sheer) rtcReleaseScene(sheer);
  for (RTCScene shape : shapes) rtcReleaseScene(shape);
  if (device) rtcReleaseDevice(device);
}

World::World(const Scenario& scenario, const Motion& motion)
    : motion_(motion),
      config_(scenario.street),
      glass_(scenario.glass),
      begin_(scenario.sensors_begin_gps_ns()),
      scene_(build_scene(scenario, motion.centre_line(), motion.length_m())),
      surroundings_(scenario.surroundings),
      embree_(std::make_unique<Embree>()) {
  const double az = radians(config_.sun_azimuth_deg), el = radians(config_.sun_elevation_deg);
  to_sun_ = {std::sin(az) * std::cos(el), std::cos(az) * std::cos(el), std::sin(el)};
  is_moving_.resize(scene_.surfaces.size());
  for (const Mover& mover : scene_.movers) is_moving_[mover.surface] = 1;
  // one thread builds the tree, so that it is the same every time
  embree_->device = rtcNewDevice("threads=1,set_affinity=0");
  embree_->still = load(embree_->device, scene_.still);
  if (!scene_.sheer.faces().empty()) embree_->sheer = load(embree_->device, scene_.sheer);
  if (!scene_.movers.empty())
    for (const MovingShape& shape : scene_.shapes) embree_->shapes.push_back(load(embree_->device, shape.mesh));
}

World::~World() = default;

bool World::is_moving(std::uint16_t surface) const { return surface < is_moving_.size() && is_moving_[surface] != 0; }

Moment World::moment(GpsNs t) const {
  Moment m;
  m.gps_ns = t;
  m.T_enu_body = motion_.T_enu_body(t);
  m.T_body_enu = inverse(m.T_enu_body);
  const CentreLine& line = motion_.centre_line();
  const double seconds = static_cast<double>(t - begin_) * 1e-9;
  for (const Mover& mover : scene_.movers) {
    const double s = mover.s_m + mover.along * mover.speed * seconds;
    // A mover that is outside its stretch waits underground.
    const bool is_out = s > mover.from_s && s < mover.to_s;
    const double clipped = std::clamp(s, line.from_m(), line.to_m());
    const double turn = mover.across != 0 ? mover.across * kPi / 2 : (mover.along < 0 ? kPi : 0.0);
    const double lateral = mover.lateral_m + mover.across * mover.speed * seconds;
    m.T_enu_mover.push_back(
        {R_enu_body(0, 0, line.heading(clipped) + turn), line.place(clipped, lateral, is_out ? 0.0 : -50.0)});
    m.T_mover_enu.push_back(inverse(m.T_enu_mover.back()));
  }
  return m;
}

Moment World::moment(const Moment& base, GpsNs t, const Pose& T_enu_body) const {
  Moment m = base;
  m.gps_ns = t;
  m.T_enu_body = T_enu_body;
  m.T_body_enu = inverse(T_enu_body);
  const double seconds = static_cast<double>(t - base.gps_ns) * 1e-9;
  for (std::size_t i = 0; i < m.T_enu_mover.size(); ++i) {
    m.T_enu_mover[i].p = m.T_enu_mover[i].p + scene_.movers[i].speed * seconds * (m.T_enu_mover[i].R * Vec3{0, 1, 0});
    m.T_mover_enu[i] = inverse(m.T_enu_mover[i]);
  }
  return m;
}

namespace {

/// Returns the hit of a moving thing's shape that is nearer than `far_m`, or nothing.
std::optional<RTCRayHit> hit_by(const Pose& T_mover_enu, const World::Ray& ray, double far_m, RTCScene shape) {
  RTCRayHit out{};
  set(out.ray, T_mover_enu * ray.origin, T_mover_enu.R * ray.direction, static_cast<float>(ray.near_m),
      static_cast<float>(far_m));
  out.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  RTCIntersectContext alone;
  rtcInitIntersectContext(&alone);
  rtcIntersect1(shape, &alone, &out);
  if (out.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
  return out;
}

}  // namespace

void World::Contact::set_hit(const Mesh& mesh, unsigned prim, float hu, float hv, double distance, Seen& seen) {
  const Mesh::Face& f = mesh.faces()[prim];
  // Embree divides a quad into the triangles (0, 1, 3) and (2, 3, 1); hu + hv says which one was hit.
  const auto& t = mesh.texture();
  const bool first = hu + hv <= 1;
  const auto &a = t[f.corner[first ? 0 : 2]], &b = t[f.corner[first ? 1 : 3]], &d = t[f.corner[first ? 3 : 1]];
  const float p = first ? hu : 1 - hu, q = first ? hv : 1 - hv;
  face = &f;
  u = a[0] + p * (b[0] - a[0]) + q * (d[0] - a[0]);
  v = a[1] + p * (b[1] - a[1]) + q * (d[1] - a[1]);
  grad_u = wide(f.grad_u);
  grad_v = wide(f.grad_v);
  seen.is_hit = true;
  seen.distance_m = distance;
  seen.surface = f.tag.surface;
  seen.material = f.tag.material;
  seen.face = prim;
  seen.normal = wide(f.normal);
}

void World::trace(const Moment& at, std::span<const Ray> rays, std::span<Seen> seen,
                  std::span<Contact> contacts) const {
  static constexpr Seen kNothing{};  // copying constants is faster than making them anew
  static constexpr Contact kNoContact{};
  alignas(32) RTCRayHit8 packet{};
  alignas(32) std::array<int, 8> valid{};
  for (std::size_t i = 0; i < rays.size(); ++i) {
    valid[i] = -1;
    packet.ray.org_x[i] = static_cast<float>(rays[i].origin.x);
    packet.ray.org_y[i] = static_cast<float>(rays[i].origin.y);
    packet.ray.org_z[i] = static_cast<float>(rays[i].origin.z);
    packet.ray.dir_x[i] = static_cast<float>(rays[i].direction.x);
    packet.ray.dir_y[i] = static_cast<float>(rays[i].direction.y);
    packet.ray.dir_z[i] = static_cast<float>(rays[i].direction.z);
    packet.ray.tnear[i] = static_cast<float>(rays[i].near_m);
    packet.ray.tfar[i] = static_cast<float>(rays[i].far_m);
    packet.ray.mask[i] = 0xFFFFFFFFu;
    packet.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
  }
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcIntersect8(valid.data(), embree_->still, &context, &packet);

  for (std::size_t i = 0; i < rays.size(); ++i) {
    const Ray& ray = rays[i];
    Seen& s = seen[i];
    Contact& c = contacts[i];
    s = kNothing;
    c = kNoContact;
    if (packet.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID)
      c.set_hit(scene_.still, packet.hit.primID[i], packet.hit.u[i], packet.hit.v[i], packet.ray.tfar[i], s);
    for (std::size_t k = 0; k < at.T_enu_mover.size(); ++k) {
      const std::size_t shape = scene_.movers[k].shape;
      if (!passes(scene_.shapes[shape], at.T_enu_mover[k], ray.origin, ray.direction)) continue;
      const auto hit = hit_by(at.T_mover_enu[k], ray, s.is_hit ? s.distance_m : ray.far_m, embree_->shapes[shape]);
      if (!hit) continue;
      c.set_hit(scene_.shapes[shape].mesh, hit->hit.primID, hit->hit.u, hit->hit.v, hit->ray.tfar, s);
      c.mover = static_cast<int>(k);
      s.surface = scene_.movers[k].surface;
      s.face += 0x40000000u;
      const Mat3& R = at.T_enu_mover[k].R;
      s.normal = R * s.normal;
      c.grad_u = R * c.grad_u;
      c.grad_v = R * c.grad_v;
    }
    if (const auto own = own_vehicle_on_ray(at.T_body_enu * ray.origin, at.T_body_enu.R * ray.direction);
        own && own->distance_m < (s.is_hit ? s.distance_m : ray.far_m)) {
      s = kNothing;
      c = kNoContact;
      s.is_hit = true;
      s.distance_m = own->distance_m;
      s.surface = 1;
      s.material = Material::CarPaint;
      s.face = 0x80000000u + static_cast<std::uint32_t>(own->part);
      s.normal = at.T_enu_body.R * own->normal_body;
      c.own_part = own->part;
    }
    if (s.is_hit && dot(s.normal, ray.direction) > 0) s.normal = -1.0 * s.normal;
  }
}

void World::find_shadows(const Moment& at, std::span<const Ray> rays, std::span<const Seen> seen,
                         std::span<Contact> contacts) const {
  alignas(32) RTCRay8 packet{};
  alignas(32) std::array<int, 8> valid{};
  std::array<Vec3, kBatch> origin;
  bool any = false;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (!seen[i].is_hit || (dot(seen[i].normal, to_sun_) <= 0 && seen[i].material != Material::Leaf)) continue;
    any = true;
    valid[i] = -1;
    origin[i] = rays[i].origin + seen[i].distance_m * rays[i].direction + kShadowBias * seen[i].normal;
    packet.org_x[i] = static_cast<float>(origin[i].x);
    packet.org_y[i] = static_cast<float>(origin[i].y);
    packet.org_z[i] = static_cast<float>(origin[i].z);
    packet.dir_x[i] = static_cast<float>(to_sun_.x);
    packet.dir_y[i] = static_cast<float>(to_sun_.y);
    packet.dir_z[i] = static_cast<float>(to_sun_.z);
    packet.tnear[i] = 0.004f;
    packet.tfar[i] = 300.0f;
    packet.mask[i] = 0xFFFFFFFFu;
  }
  if (!any) return;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcOccluded8(valid.data(), embree_->still, &context, &packet);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (valid[i] == 0 || packet.tfar[i] < 0) continue;
    bool lit = true;
    for (std::size_t k = 0; lit && k < at.T_enu_mover.size(); ++k) {
      const std::size_t shape = scene_.movers[k].shape;
      if (!passes(scene_.shapes[shape], at.T_enu_mover[k], origin[i], to_sun_)) continue;
      RTCRay single;
      set(single, at.T_mover_enu[k] * origin[i], at.T_mover_enu[k].R * to_sun_, 0.004f, 100.0f);
      RTCIntersectContext alone;
      rtcInitIntersectContext(&alone);
      rtcOccluded1(embree_->shapes[shape], &alone, &single);
      lit = !(single.tfar < 0);
    }
    if (lit) lit = !own_vehicle_on_ray(at.T_body_enu * origin[i], at.T_body_enu.R * to_sun_);
    contacts[i].in_sun = lit;
  }
}

void World::look_at_solids(const Moment& at, std::span<const Ray> rays, float cone, std::span<Seen> seen) const {
  std::array<Contact, kBatch> contacts;
  trace(at, rays, seen, contacts);
  find_shadows(at, rays, seen, contacts);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    Seen& s = seen[i];
    s.own = shade(rays[i], s, contacts[i], cone);
    if (!scene_.night_lamps.empty()) s.own = with_lamps(at, rays[i], s, contacts[i], cone, s.own);
    s.colour = s.own;
  }
}

void World::look(const Moment& at, std::span<const Ray> rays, float cone, std::span<Seen> seen) const {
  look_at_solids(at, rays, cone, seen);
  if (config_.wetness > 0)
    for (std::size_t i = 0; i < rays.size(); ++i) add_water(at, rays[i], cone, seen[i]);
  if (embree_->sheer)
    for (std::size_t i = 0; i < rays.size(); ++i) look_through(at, rays[i], cone, seen[i]);
}

}  // namespace hueline::sim
