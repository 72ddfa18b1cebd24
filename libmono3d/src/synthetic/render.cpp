// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/render.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core/utility.hpp>
#include <optional>

#include "mono3d/core/error.h"
#include "mono3d/image/undistorter.h"
#include "synthetic/lens.h"
#include "synthetic/shading.h"
#include "synthetic/shutter.h"

namespace mono3d::synthetic {
namespace {

using Eigen::Vector3f;

// Samples of one pixel that see the same piece of surface, under the same light. It is shaded once,
// in their middle: detail finer than a pixel is not drawn anyway.
struct SurfacePatch {
  Ray ray;  // sums over the samples, by weight
  Hit hit;
  Hit first;
  float reach_m = 0;  // samples beyond it from the first one belong to another patch
  bool is_sunlit = false;
  float weight = 0;
};

constexpr float kSameNormal = 0.95F;  // cosine: 18 degrees
// How far the samples of a patch may be apart in footprints of a pixel. A surface that is seen
// under less than some 25 degrees is more than that long within a pixel and gets several patches.
constexpr float kReach = 1.25F;
constexpr float kSteepest = 0.1F;         // sine of the angle below which footprints grow no more
constexpr float kShadowOffset_m = 2e-3F;  // see shading.cpp

bool IsSunlit(const Scene& scene, const Hit& hit, float t_s) {
  const Vector3f& to_sun = scene.light().to_sun;
  return hit.normal.dot(to_sun) > 0 &&
         !scene.IsOccluded({hit.p + kShadowOffset_m * hit.normal, to_sun, t_s});
}

class PixelShader {
 public:
  PixelShader(const Scene& scene, float pixel_width) : scene_(scene), pixel_width_(pixel_width) {}

  void Add(const Ray& ray, float weight) {
    const std::optional<Hit> hit = scene_.Intersect(ray);
    if (!hit) {
      sum_ += weight * SkyRadiance(scene_.light(), ray.direction.normalized());
      return;
    }
    const bool is_sunlit = IsSunlit(scene_, *hit, ray.time_s);
    SurfacePatch* patch = Find(*hit, is_sunlit);
    if (patch == nullptr) patch = Open(ray, *hit, is_sunlit);
    patch->weight += weight;
    patch->ray.origin += weight * ray.origin;
    patch->ray.direction += weight * ray.direction;
    patch->ray.time_s += weight * ray.time_s;
    patch->hit.distance += weight * hit->distance;
    patch->hit.p += weight * hit->p;
    patch->hit.p_surface += weight * hit->p_surface;
    patch->hit.normal += weight * hit->normal;
  }

  // Of all samples since the last call.
  Vector3f Radiance() {
    while (num_patches_ > 0) Shade(patches_[--num_patches_]);
    const Vector3f radiance = sum_;
    sum_.setZero();
    return radiance;
  }

 private:
  SurfacePatch* Find(const Hit& hit, bool is_sunlit) {
    for (std::size_t i = 0; i < num_patches_; ++i) {
      SurfacePatch& patch = patches_[i];
      const bool is_same =
          patch.first.surface == hit.surface && patch.is_sunlit == is_sunlit &&
          patch.first.is_moving == hit.is_moving &&
          patch.first.normal.dot(hit.normal) > kSameNormal &&
          (patch.first.p_surface - hit.p_surface).squaredNorm() < patch.reach_m * patch.reach_m;
      if (is_same) return &patch;
    }
    return nullptr;
  }

  SurfacePatch* Open(const Ray& ray, const Hit& hit, bool is_sunlit) {
    if (num_patches_ == patches_.size()) Shade(patches_[--num_patches_]);
    SurfacePatch& patch = patches_[num_patches_++];
    const float slant = std::max(-hit.normal.dot(ray.direction) / ray.direction.norm(), kSteepest);
    patch.first = hit;
    patch.reach_m = kReach * hit.distance * pixel_width_ / std::sqrt(slant);
    patch.is_sunlit = is_sunlit;
    patch.weight = 0;
    patch.ray = {Vector3f::Zero(), Vector3f::Zero(), 0};
    patch.hit = hit;
    patch.hit.distance = 0;
    patch.hit.p.setZero();
    patch.hit.p_surface.setZero();
    patch.hit.normal.setZero();
    return &patch;
  }

  void Shade(SurfacePatch& patch) {
    const float scale = 1 / patch.weight;
    patch.ray.origin *= scale;
    patch.ray.direction *= scale;
    patch.ray.time_s *= scale;
    patch.hit.distance *= scale;
    patch.hit.p *= scale;
    patch.hit.p_surface *= scale;
    patch.hit.normal.normalize();
    sum_ += patch.weight * SurfaceRadiance(scene_, patch.ray, patch.hit, pixel_width_);
  }

  const Scene& scene_;
  float pixel_width_;
  Vector3f sum_ = Vector3f::Zero();
  std::array<SurfacePatch, 8> patches_;
  std::size_t num_patches_ = 0;
};

// The camera's lines of sight, at z = 1: a hit's distance is then the depth.
class Sights {
 public:
  explicit Sights(const CameraModel& camera)
      : camera_(camera), inverse_f_(1 / camera.fx, 1 / camera.fy) {
    if (camera.HasDistortion()) lens_.emplace(camera);
  }

  Vector3f Direction(int x, int y, const Eigen::Vector2f& shift_px) const {
    if (lens_) return lens_->Direction(x, y, shift_px);
    const Eigen::Vector2d pixel = Eigen::Vector2d(x, y) + shift_px.cast<double>();
    const Eigen::Vector2d off = pixel - Eigen::Vector2d(camera_.cx, camera_.cy);
    const Eigen::Vector2f point = off.cwiseProduct(inverse_f_).cast<float>();
    return {point.x(), point.y(), 1};
  }

 private:
  const CameraModel& camera_;
  Eigen::Vector2d inverse_f_;
  std::optional<Lens> lens_;
};

void Check(const CameraModel& camera, const Shot& shot, const RenderOptions& options) {
  Validate(camera, "synthetic camera");
  options.Validate();
  if (!shot.motion) throw Error("a shot needs the motion of its camera");
}

cv::Mat RenderDepth(const Scene& scene, const CameraModel& camera, const Shot& shot) {
  const Sights sights(camera);
  const Instant instant = InstantOf(shot.motion(shot.t_s), shot.t_s);
  cv::Mat depth = cv::Mat::zeros(camera.height, camera.width, CV_32FC1);
  cv::parallel_for_(cv::Range(0, camera.height), [&](const cv::Range& rows) {
    for (int y = rows.start; y < rows.end; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        const Vector3f direction_cam = sights.Direction(x, y, Eigen::Vector2f::Zero());
        const std::optional<Hit> hit =
            scene.Intersect({instant.origin, instant.R_world_cam * direction_cam, instant.t_s});
        if (hit) depth.at<float>(y, x) = hit->distance;
      }
    }
  });
  return depth;
}

}  // namespace

void RenderOptions::Visit(OptionVisitor& visit) {
  visit("samples_per_side", samples_per_side, "samples a pixel, squared");
  visit("with_depth", with_depth, "render the depth image as well");
  visit.Group("sensor", sensor);
}

void RenderOptions::Validate() const {
  RequireOption(samples_per_side >= 1 && samples_per_side <= 16, "samples_per_side", "1 to 16",
                samples_per_side);
  sensor.Validate();
}

cv::Mat RenderRadiance(const Scene& scene, const CameraModel& camera, const Shot& shot,
                       const RenderOptions& options) {
  Check(camera, shot, options);
  const Sights sights(camera);
  const ShutterPlan plan = PlanShutter(scene, camera, shot, options);
  const auto pixel_width = static_cast<float>(1 / camera.fx);
  cv::Mat radiance(camera.height, camera.width, CV_32FC3);
  cv::parallel_for_(cv::Range(0, camera.height), [&](const cv::Range& rows) {
    PixelShader shader(scene, pixel_width);
    for (int y = rows.start; y < rows.end; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        for (const PixelSample& sample : plan.samples) {
          const Instant& instant = plan.At(y, sample.slice);
          const Vector3f direction_cam = sights.Direction(x, y, sample.shift_px);
          shader.Add({instant.origin, instant.R_world_cam * direction_cam, instant.t_s},
                     sample.weight);
        }
        const Vector3f rgb = shader.Radiance();
        radiance.at<cv::Vec3f>(y, x) = {rgb.z(), rgb.y(), rgb.x()};
      }
    }
  });
  return radiance;
}

Rendering Render(const Scene& scene, const CameraModel& camera, const Shot& shot,
                 const RenderOptions& options) {
  Rendering out;
  out.bgr =
      Develop(RenderRadiance(scene, camera, shot, options), options.sensor, shot.t_s, shot.frame);
  if (options.with_depth) out.depth = RenderDepth(scene, DepthCamera(camera), shot);
  return out;
}

Rendering Render(const Scene& scene, const CameraModel& camera, const Pose& T_world_cam,
                 const RenderOptions& options) {
  return Render(scene, camera, Shot{[&](double) { return T_world_cam; }}, options);
}

CameraModel DepthCamera(const CameraModel& camera) { return Undistorter(camera).camera(); }

TimeSpan ShutterSpan(const SensorOptions& options, double t_s) {
  const double half_s = (options.readout_s + options.exposure_s) / 2;
  return {t_s - half_s, t_s + half_s};
}

}  // namespace mono3d::synthetic
