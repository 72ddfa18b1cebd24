// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/render.h"

#include <opencv2/core/utility.hpp>
#include <optional>
#include <vector>

#include "mono3d/core/error.h"
#include "mono3d/image/undistorter.h"
#include "synthetic/exposure.h"
#include "synthetic/lens.h"
#include "synthetic/pixel_shader.h"
#include "synthetic/sensor.h"
#include "synthetic/shading.h"
#include "synthetic/shutter.h"

namespace mono3d::synthetic {
namespace {

using Eigen::Vector3f;

// The camera's lines of sight. At z = 1, but of a fisheye lens: a hit's distance is then the depth.
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

// What the rays of one row of the image meet, and whether the sun shines there.
class RowOfRays {
 public:
  void Clear() { rays_.clear(); }
  void Add(const Ray& ray) { rays_.push_back(ray); }

  void Trace(const Scene& scene) {
    hits_.resize(rays_.size());
    scene.Intersect(rays_, hits_);
    shadow_rays_.clear();
    asked_.clear();
    for (std::size_t i = 0; i < rays_.size(); ++i) {
      if (!hits_[i]) continue;
      hits_[i]->is_sunlit = hits_[i]->normal.dot(scene.light().to_sun) > 0;
      if (!*hits_[i]->is_sunlit) continue;
      asked_.push_back(i);
      shadow_rays_.push_back(ShadowRay(scene, *hits_[i], rays_[i].time_s));
    }
    occluded_.resize(shadow_rays_.size());
    scene.AreOccluded(shadow_rays_, occluded_);
    for (std::size_t k = 0; k < asked_.size(); ++k) {
      hits_[asked_[k]]->is_sunlit = occluded_[k] == 0;
    }
  }

  const Ray& ray(std::size_t i) const { return rays_[i]; }
  const std::optional<Hit>& hit(std::size_t i) const { return hits_[i]; }

 private:
  std::vector<Ray> rays_;
  std::vector<std::optional<Hit>> hits_;
  std::vector<std::size_t> asked_;  // the hit of each shadow ray
  std::vector<Ray> shadow_rays_;
  std::vector<char> occluded_;
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
    std::vector<Ray> rays(static_cast<std::size_t>(camera.width));
    std::vector<std::optional<Hit>> hits(rays.size());
    for (int y = rows.start; y < rows.end; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        const Vector3f direction_cam = sights.Direction(x, y, Eigen::Vector2f::Zero());
        rays[static_cast<std::size_t>(x)] = {instant.origin, instant.R_world_cam * direction_cam,
                                             instant.t_s};
      }
      scene.Intersect(rays, hits);
      for (int x = 0; x < camera.width; ++x) {
        const std::optional<Hit>& hit = hits[static_cast<std::size_t>(x)];
        if (hit) depth.at<float>(y, x) = hit->distance;
      }
    }
  });
  return depth;
}

}  // namespace

cv::Mat RenderRadiance(const Scene& scene, const CameraModel& camera, const Shot& shot,
                       const RenderOptions& options) {
  Check(camera, shot, options);
  const Sights sights(camera);
  const ShutterPlan plan = PlanShutter(scene, camera, shot, options);
  const auto pixel_width = static_cast<float>(1 / camera.fx);
  cv::Mat radiance(camera.height, camera.width, CV_32FC3);
  cv::parallel_for_(cv::Range(0, camera.height), [&](const cv::Range& rows) {
    PixelShader shader(scene, pixel_width);
    RowOfRays row;
    for (int y = rows.start; y < rows.end; ++y) {
      row.Clear();
      for (int x = 0; x < camera.width; ++x) {
        for (const PixelSample& sample : plan.samples) {
          const Instant& instant = plan.At(x, y, sample.slice);
          const Vector3f direction_cam = sights.Direction(x, y, sample.shift_px);
          row.Add({instant.origin, instant.R_world_cam * direction_cam, instant.t_s});
        }
      }
      row.Trace(scene);
      std::size_t i = 0;
      for (int x = 0; x < camera.width; ++x) {
        for (const PixelSample& sample : plan.samples) {
          shader.Add(row.ray(i), row.hit(i), sample.weight);
          ++i;
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
  const cv::Mat radiance = RenderRadiance(scene, camera, shot, options);
  out.bgr = Develop(radiance, options.sensor, shot.t_s, shot.frame);
  out.exposure = ExposureFactor(radiance, options.sensor, shot.t_s);
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
