// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/scene.h"

#include <embree3/rtcore.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <string>
#include <utility>

#include "mono3d/core/error.h"

namespace mono3d::synthetic {
namespace {

struct ReleaseDevice {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
};
struct ReleaseScene {
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
};

RTCRay ToEmbree(const Ray& ray) {
  RTCRay out{};
  out.org_x = ray.origin.x();
  out.org_y = ray.origin.y();
  out.org_z = ray.origin.z();
  out.dir_x = ray.direction.x();
  out.dir_y = ray.direction.y();
  out.dir_z = ray.direction.z();
  out.tfar = std::numeric_limits<float>::infinity();
  out.mask = ~0U;
  return out;
}

void ThrowOnEmbreeError(RTCDevice device) {
  const RTCError code = rtcGetDeviceError(device);
  if (code != RTC_ERROR_NONE) {
    throw Error("Embree cannot build the scene, error code " + std::to_string(code));
  }
}

void AttachTriangles(RTCDevice device, RTCScene scene, const Mesh& mesh) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                               RTC_FORMAT_FLOAT3, 3 * sizeof(float),
                                                               mesh.vertices.size()));
  auto* indices = static_cast<std::uint32_t*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                              3 * sizeof(std::uint32_t), mesh.triangles.size()));
  ThrowOnEmbreeError(device);
  for (const Eigen::Vector3f& vertex : mesh.vertices) {
    vertices = std::copy_n(vertex.data(), 3, vertices);
  }
  for (const auto& triangle : mesh.triangles) {
    indices = std::copy_n(triangle.data(), 3, indices);
  }
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene, geometry);
  rtcReleaseGeometry(geometry);
}

}  // namespace

struct Scene::Impl {
  Mesh mesh;
  GroundMap ground;
  std::unique_ptr<RTCDeviceTy, ReleaseDevice> device;
  std::unique_ptr<RTCSceneTy, ReleaseScene> scene;
};

Scene::Scene(Mesh mesh, GroundMap ground) : impl_(std::make_unique<Impl>()) {
  impl_->mesh = std::move(mesh);
  impl_->ground = std::move(ground);
  // One thread builds the tree, so that it is the same tree each time.
  impl_->device.reset(rtcNewDevice("threads=1"));
  if (!impl_->device) throw Error("Embree cannot be started on this machine");
  impl_->scene.reset(rtcNewScene(impl_->device.get()));
  // Robust: no ray slips through between two triangles.
  rtcSetSceneFlags(impl_->scene.get(), RTC_SCENE_FLAG_ROBUST);
  AttachTriangles(impl_->device.get(), impl_->scene.get(), impl_->mesh);
  rtcCommitScene(impl_->scene.get());
  ThrowOnEmbreeError(impl_->device.get());
}

Scene::~Scene() = default;
Scene::Scene(Scene&&) noexcept = default;
Scene& Scene::operator=(Scene&&) noexcept = default;

std::optional<Hit> Scene::Intersect(const Ray& ray) const {
  RTCRayHit query{};
  query.ray = ToEmbree(ray);
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcIntersect1(impl_->scene.get(), &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;

  const Mesh& mesh = impl_->mesh;
  const Surface& surface = mesh.surfaces[mesh.triangle_surfaces[query.hit.primID]];
  Eigen::Vector3f normal(query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z);
  if (normal.dot(ray.direction) > 0) normal = -normal;
  if (surface.is_smooth) {
    const auto& [a, b, c] = mesh.triangles[query.hit.primID];
    const Eigen::Vector3f smooth = (1 - query.hit.u - query.hit.v) * mesh.normals[a] +
                                   query.hit.u * mesh.normals[b] + query.hit.v * mesh.normals[c];
    if (!smooth.isZero()) normal = smooth.dot(normal) < 0 ? Eigen::Vector3f(-smooth) : smooth;
  }
  return Hit{query.ray.tfar, ray.origin + query.ray.tfar * ray.direction, normal.normalized(),
             &surface};
}

bool Scene::IsOccluded(const Ray& ray) const {
  RTCRay query = ToEmbree(ray);
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcOccluded1(impl_->scene.get(), &context, &query);
  return query.tfar < 0;
}

const Mesh& Scene::mesh() const { return impl_->mesh; }
const GroundMap& Scene::ground() const { return impl_->ground; }

}  // namespace mono3d::synthetic
