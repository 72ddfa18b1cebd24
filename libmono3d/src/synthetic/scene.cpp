// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/scene.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "mono3d/core/error.h"

namespace mono3d::synthetic {
namespace {

using Eigen::Isometry3f;
using Eigen::Vector3f;

struct ReleaseDevice {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
};
struct ReleaseScene {
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
};
struct ReleaseGeometry {
  void operator()(RTCGeometry geometry) const { rtcReleaseGeometry(geometry); }
};
using DevicePtr = std::unique_ptr<RTCDeviceTy, ReleaseDevice>;
using ScenePtr = std::unique_ptr<RTCSceneTy, ReleaseScene>;
using GeometryPtr = std::unique_ptr<RTCGeometryTy, ReleaseGeometry>;

constexpr float kJump_m = 50;

// A mesh on its way from one pose to another, in the time from 0 to 1.
struct Mover {
  MovingObject object;
  ScenePtr tree;
  GeometryPtr instance;
  Eigen::Affine3f begin = Eigen::Affine3f::Identity();
  Eigen::Affine3f end = Eigen::Affine3f::Identity();

  Eigen::Affine3f At(float time) const {
    return Eigen::Affine3f((1 - time) * begin.matrix() + time * end.matrix());
  }
};

RTCRay ToEmbree(const Ray& ray, float time) {
  RTCRay out{};
  out.org_x = ray.origin.x();
  out.org_y = ray.origin.y();
  out.org_z = ray.origin.z();
  out.dir_x = ray.direction.x();
  out.dir_y = ray.direction.y();
  out.dir_z = ray.direction.z();
  out.tfar = std::numeric_limits<float>::infinity();
  out.time = time;
  out.mask = ~0U;
  return out;
}

RTCIntersectContext CoherentContext() {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  return context;
}

constexpr std::size_t kPacketSize = 16;

struct PacketMask {
  alignas(64) int valid[kPacketSize];  // -1: there is a ray
};

void SetRay(RTCRay16& packet, std::size_t i, const Ray& ray, float time) {
  packet.org_x[i] = ray.origin.x();
  packet.org_y[i] = ray.origin.y();
  packet.org_z[i] = ray.origin.z();
  packet.dir_x[i] = ray.direction.x();
  packet.dir_y[i] = ray.direction.y();
  packet.dir_z[i] = ray.direction.z();
  packet.tfar[i] = std::numeric_limits<float>::infinity();
  packet.time[i] = time;
  packet.mask[i] = ~0U;
}

RTCHit HitInPacket(const RTCHit16& hits, std::size_t i) {
  RTCHit hit{};
  hit.Ng_x = hits.Ng_x[i];
  hit.Ng_y = hits.Ng_y[i];
  hit.Ng_z = hits.Ng_z[i];
  hit.u = hits.u[i];
  hit.v = hits.v[i];
  hit.primID = hits.primID[i];
  hit.geomID = hits.geomID[i];
  hit.instID[0] = hits.instID[0][i];
  return hit;
}

void RequireSameLength(std::size_t num_rays, std::size_t num_answers) {
  if (num_rays != num_answers) throw Error("a list of rays needs a list of answers of its length");
}

void ThrowOnEmbreeError(RTCDevice device) {
  const RTCError code = rtcGetDeviceError(device);
  if (code != RTC_ERROR_NONE) {
    throw Error("Embree cannot build the scene, error code " + std::to_string(code));
  }
}

ScenePtr NewScene(RTCDevice device) {
  ScenePtr scene(rtcNewScene(device));
  // Robust: no ray slips through between two triangles.
  rtcSetSceneFlags(scene.get(), RTC_SCENE_FLAG_ROBUST);
  return scene;
}

ScenePtr BuildTree(RTCDevice device, const Mesh& mesh) {
  ScenePtr scene = NewScene(device);
  const GeometryPtr geometry(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE));
  auto* vertices = static_cast<float*>(
      rtcSetNewGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                              3 * sizeof(float), mesh.vertices.size()));
  auto* indices = static_cast<std::uint32_t*>(
      rtcSetNewGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                              3 * sizeof(std::uint32_t), mesh.triangles.size()));
  ThrowOnEmbreeError(device);
  for (const Vector3f& vertex : mesh.vertices) {
    vertices = std::copy_n(vertex.data(), 3, vertices);
  }
  for (const auto& triangle : mesh.triangles) {
    indices = std::copy_n(triangle.data(), 3, indices);
  }
  rtcCommitGeometry(geometry.get());
  rtcAttachGeometry(scene.get(), geometry.get());
  rtcCommitScene(scene.get());
  ThrowOnEmbreeError(device);
  return scene;
}

// The shaded surface's normal at a hit, not yet of unit length; it leaves the side that the ray
// comes from.
Vector3f NormalAt(const Mesh& mesh, const RTCHit& hit, const Vector3f& direction) {
  Vector3f flat(hit.Ng_x, hit.Ng_y, hit.Ng_z);
  if (flat.dot(direction) > 0) flat = -flat;
  if (!mesh.surfaces[mesh.triangle_surfaces[hit.primID]].is_smooth) return flat;
  const auto& [a, b, c] = mesh.triangles[hit.primID];
  const Vector3f smooth =
      (1 - hit.u - hit.v) * mesh.normals[a] + hit.u * mesh.normals[b] + hit.v * mesh.normals[c];
  if (smooth.isZero()) return flat;
  return smooth.dot(flat) < 0 ? Vector3f(-smooth) : smooth;
}

}  // namespace

struct Scene::Impl {
  Mesh mesh;
  GroundMap ground;
  Light light;
  DevicePtr device;  // released last
  ScenePtr still;
  std::vector<Mover> movers;
  ScenePtr moving;  // one instance per mover, its geometry's number that of the mover
  double begin_s = 0;
  double end_s = 0;

  void AddMover(MovingObject object);
  float TimeOf(const Ray& ray) const;
  Hit HitOf(const Ray& ray, float distance, const RTCHit& query) const;
};

void Scene::Impl::AddMover(MovingObject object) {
  Mover mover;
  mover.tree = BuildTree(device.get(), object.mesh);
  mover.object = std::move(object);
  mover.instance.reset(rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_INSTANCE));
  rtcSetGeometryInstancedScene(mover.instance.get(), mover.tree.get());
  rtcSetGeometryTimeStepCount(mover.instance.get(), 2);
  rtcAttachGeometryByID(moving.get(), mover.instance.get(),
                        static_cast<unsigned int>(movers.size()));
  movers.push_back(std::move(mover));
}

float Scene::Impl::TimeOf(const Ray& ray) const {
  if (end_s <= begin_s) return 0;
  const double share = (static_cast<double>(ray.time_s) - begin_s) / (end_s - begin_s);
  return static_cast<float>(std::clamp(share, 0.0, 1.0));
}

Hit Scene::Impl::HitOf(const Ray& ray, float distance, const RTCHit& query) const {
  Hit hit;
  hit.distance = distance;
  hit.p = ray.origin + distance * ray.direction;
  hit.is_moving = query.instID[0] != RTC_INVALID_GEOMETRY_ID;
  const Mesh& seen = hit.is_moving ? movers[query.instID[0]].object.mesh : mesh;
  hit.surface = &seen.surfaces[seen.triangle_surfaces[query.primID]];
  if (hit.is_moving) {
    const Eigen::Affine3f T_world_object = movers[query.instID[0]].At(TimeOf(ray));
    const Eigen::Affine3f T_object_world = T_world_object.inverse();
    hit.p_surface = T_object_world * hit.p;
    const Vector3f direction_object = T_object_world.linear() * ray.direction;
    hit.normal = T_world_object.linear() * NormalAt(seen, query, direction_object);
  } else {
    hit.p_surface = hit.p;
    hit.normal = NormalAt(seen, query, ray.direction);
  }
  hit.normal.normalize();
  return hit;
}

Scene::Scene(Mesh mesh, GroundMap ground, std::vector<MovingObject> moving)
    : impl_(std::make_unique<Impl>()) {
  impl_->mesh = std::move(mesh);
  impl_->ground = std::move(ground);
  // One thread builds the tree, so that it is the same tree each time.
  impl_->device.reset(rtcNewDevice("threads=1"));
  if (!impl_->device) throw Error("Embree cannot be started on this machine");
  impl_->still = BuildTree(impl_->device.get(), impl_->mesh);
  impl_->moving = NewScene(impl_->device.get());
  for (MovingObject& object : moving) impl_->AddMover(std::move(object));
  SetTimeSpan(0, 0);
}

Scene::~Scene() = default;
Scene::Scene(Scene&&) noexcept = default;
Scene& Scene::operator=(Scene&&) noexcept = default;

void Scene::SetTimeSpan(double begin_s, double end_s) {
  if (!std::isfinite(begin_s) || !std::isfinite(end_s) || end_s < begin_s) {
    throw Error("the time span of a scene must be finite and not end before it begins; found " +
                std::to_string(begin_s) + " to " + std::to_string(end_s) + " s");
  }
  impl_->begin_s = begin_s;
  impl_->end_s = end_s;
  if (impl_->movers.empty()) return;
  for (Mover& mover : impl_->movers) {
    mover.begin = mover.object.T_world_object(begin_s);
    mover.end = mover.object.T_world_object(end_s);
    // One that is put elsewhere, to begin its way again, does not fly there.
    if ((mover.end.translation() - mover.begin.translation()).norm() > kJump_m) {
      mover.end = mover.begin;
    }
    for (const unsigned int step : {0U, 1U}) {
      const Eigen::Affine3f& pose = step == 0 ? mover.begin : mover.end;
      rtcSetGeometryTransform(mover.instance.get(), step, RTC_FORMAT_FLOAT4X4_COLUMN_MAJOR,
                              pose.matrix().data());
    }
    rtcCommitGeometry(mover.instance.get());
  }
  rtcCommitScene(impl_->moving.get());
  ThrowOnEmbreeError(impl_->device.get());
}

std::optional<Hit> Scene::Intersect(const Ray& ray) const {
  const float time = impl_->TimeOf(ray);
  RTCRayHit query{};
  query.ray = ToEmbree(ray, time);
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  RTCIntersectContext context = CoherentContext();
  rtcIntersect1(impl_->still.get(), &context, &query);
  if (HasMovingObjects()) rtcIntersect1(impl_->moving.get(), &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  return impl_->HitOf(ray, query.ray.tfar, query.hit);
}

void Scene::Intersect(std::span<const Ray> rays, std::span<std::optional<Hit>> hits) const {
  RequireSameLength(rays.size(), hits.size());
  RTCIntersectContext context = CoherentContext();
  for (std::size_t begin = 0; begin < rays.size(); begin += kPacketSize) {
    const std::size_t num = std::min(kPacketSize, rays.size() - begin);
    RTCRayHit16 packet{};
    PacketMask mask{};
    for (std::size_t i = 0; i < num; ++i) {
      mask.valid[i] = -1;
      SetRay(packet.ray, i, rays[begin + i], impl_->TimeOf(rays[begin + i]));
      packet.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
      packet.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
    }
    rtcIntersect16(mask.valid, impl_->still.get(), &context, &packet);
    if (HasMovingObjects()) rtcIntersect16(mask.valid, impl_->moving.get(), &context, &packet);
    for (std::size_t i = 0; i < num; ++i) {
      hits[begin + i].reset();
      if (packet.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) continue;
      hits[begin + i] =
          impl_->HitOf(rays[begin + i], packet.ray.tfar[i], HitInPacket(packet.hit, i));
    }
  }
}

void Scene::AreOccluded(std::span<const Ray> rays, std::span<char> occluded) const {
  RequireSameLength(rays.size(), occluded.size());
  RTCIntersectContext context = CoherentContext();
  for (std::size_t begin = 0; begin < rays.size(); begin += kPacketSize) {
    const std::size_t num = std::min(kPacketSize, rays.size() - begin);
    RTCRay16 packet{};
    PacketMask mask{};
    for (std::size_t i = 0; i < num; ++i) {
      mask.valid[i] = -1;
      SetRay(packet, i, rays[begin + i], impl_->TimeOf(rays[begin + i]));
    }
    rtcOccluded16(mask.valid, impl_->still.get(), &context, &packet);
    if (HasMovingObjects()) rtcOccluded16(mask.valid, impl_->moving.get(), &context, &packet);
    for (std::size_t i = 0; i < num; ++i) {
      occluded[begin + i] = packet.tfar[i] < 0 ? 1 : 0;
    }
  }
}

bool Scene::IsOccluded(const Ray& ray) const {
  const float time = impl_->TimeOf(ray);
  RTCIntersectContext context = CoherentContext();
  RTCRay query = ToEmbree(ray, time);
  rtcOccluded1(impl_->still.get(), &context, &query);
  if (query.tfar >= 0 && HasMovingObjects()) rtcOccluded1(impl_->moving.get(), &context, &query);
  return query.tfar < 0;
}

const Mesh& Scene::mesh() const { return impl_->mesh; }
const GroundMap& Scene::ground() const { return impl_->ground; }
bool Scene::HasMovingObjects() const { return !impl_->movers.empty(); }
const Light& Scene::light() const { return impl_->light; }
void Scene::set_light(const Light& light) { impl_->light = light; }

}  // namespace mono3d::synthetic
