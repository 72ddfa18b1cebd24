// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "drawing/model_picture.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "drawing/chart.h"
#include "mono3d/core/error.h"

namespace mono3d::tools {
namespace {

const cv::Vec3b kColourlessSurfel = {200, 200, 200};
constexpr double kEdgeOn = 1e-3;                // cosine below which a disc is a line
constexpr double kShareOfDepthsOutside = 0.01;  // of the depths, at each end of the colour scale

void RequireSurfels(const PointCloud& surfels, const CameraModel& camera) {
  CheckCloud(surfels, "model to render");
  Validate(camera, "camera of the picture");
  if (camera.HasDistortion()) throw Error("a model is rendered by cameras without distortion");
  if (surfels.normals.empty() || surfels.radii.empty()) {
    throw Error(ErrorParts{"no surfels", "model to render", "points with normals and radii",
                           surfels.normals.empty() ? "no normals" : "no radii"});
  }
}

// A surfel in the camera's frame.
struct Disc {
  Eigen::Vector3d centre;
  Eigen::Vector3d normal;  // towards the camera
  double radius = 0;
};

// Depth at which the ray of a pixel meets the disc; 0: it does not.
double DepthOn(const Disc& disc, const Eigen::Vector3d& ray) {
  const double along = disc.normal.dot(ray);
  if (along > -kEdgeOn * ray.norm()) return 0;
  const double depth = disc.normal.dot(disc.centre) / along;
  return (ray * depth - disc.centre).squaredNorm() <= disc.radius * disc.radius ? depth : 0;
}

class Painter {
 public:
  Painter(const PointCloud& surfels, const CameraModel& camera)
      : surfels_(surfels), camera_(camera) {
    const cv::Size size(camera.width, camera.height);
    rendering_.bgr = cv::Mat(size, CV_8UC3, cv::Scalar::all(0));
    rendering_.depth = cv::Mat(size, CV_32FC1, cv::Scalar(0));
    rendering_.normal = cv::Mat(size, CV_32FC3, cv::Scalar::all(0));
    rendering_.confidence = cv::Mat(size, CV_32FC1, cv::Scalar(0));
  }

  void Draw(const Disc& disc, std::size_t i) {
    const Eigen::Vector2d middle = camera_.Project(disc.centre);
    // A disc spans no more than the sphere around it, whose nearest point bounds its size.
    const double nearest = disc.centre.z() - disc.radius;
    if (!(nearest > 0)) return;  // the camera stands in it
    const double reach_x =
        camera_.fx * disc.radius / nearest * (1 + std::abs(disc.centre.x()) / disc.centre.z());
    const double reach_y =
        camera_.fy * disc.radius / nearest * (1 + std::abs(disc.centre.y()) / disc.centre.z());
    const int first_x = Inside(middle.x() - reach_x, camera_.width);
    const int last_x = Inside(middle.x() + reach_x, camera_.width);
    const int first_y = Inside(middle.y() - reach_y, camera_.height);
    const int last_y = Inside(middle.y() + reach_y, camera_.height);
    for (int y = first_y; y <= last_y; ++y) {
      for (int x = first_x; x <= last_x; ++x) {
        const double depth = DepthOn(disc, camera_.Unproject({x, y}));
        if (depth > 0) Put(x, y, depth, disc, i);
      }
    }
    const long x = std::lround(middle.x());
    const long y = std::lround(middle.y());
    if (x < 0 || y < 0 || x >= camera_.width || y >= camera_.height) return;
    Put(static_cast<int>(x), static_cast<int>(y), disc.centre.z(), disc, i);
  }

  ModelRendering Take() { return std::move(rendering_); }

 private:
  static int Inside(double at, int size) {
    return static_cast<int>(std::clamp(std::round(at), -1.0, static_cast<double>(size)));
  }

  void Put(int x, int y, double depth, const Disc& disc, std::size_t i) {
    if (x < 0 || y < 0 || x >= camera_.width || y >= camera_.height) return;
    float& nearest = rendering_.depth.at<float>(y, x);
    if (nearest > 0 && nearest <= static_cast<float>(depth)) return;
    nearest = static_cast<float>(depth);
    cv::Vec3b colour = kColourlessSurfel;
    if (!surfels_.colours.empty()) {
      const auto& [red, green, blue] = surfels_.colours[i];
      colour = {blue, green, red};
    }
    rendering_.bgr.at<cv::Vec3b>(y, x) = colour;
    const Eigen::Vector3f n = disc.normal.cast<float>();
    rendering_.normal.at<cv::Vec3f>(y, x) = {n.x(), n.y(), n.z()};
    rendering_.confidence.at<float>(y, x) =
        surfels_.confidences.empty() ? 1.0F : surfels_.confidences[i];
  }

  const PointCloud& surfels_;
  const CameraModel& camera_;
  ModelRendering rendering_;
};

uchar Channel(double share) { return cv::saturate_cast<uchar>(255 * share); }

cv::Vec3b NormalColour(double x, double y, double z) {
  return {Channel((z + 1) / 2), Channel((y + 1) / 2), Channel((x + 1) / 2)};
}

cv::Mat DepthColours(const cv::Mat& depth) {
  std::vector<float> inverse;
  for (int y = 0; y < depth.rows; ++y) {
    for (int x = 0; x < depth.cols; ++x) {
      if (depth.at<float>(y, x) > 0) inverse.push_back(1 / depth.at<float>(y, x));
    }
  }
  cv::Mat share(depth.size(), CV_8UC1, cv::Scalar(0));
  if (!inverse.empty()) {
    std::sort(inverse.begin(), inverse.end());
    const auto outside =
        static_cast<std::size_t>(kShareOfDepthsOutside * static_cast<double>(inverse.size()));
    const double far = inverse[outside];
    const double range = std::max(1e-6 * far, inverse[inverse.size() - 1 - outside] - far);
    for (int y = 0; y < depth.rows; ++y) {
      for (int x = 0; x < depth.cols; ++x) {
        const float z = depth.at<float>(y, x);
        if (z > 0) share.at<uchar>(y, x) = Channel((1 / z - far) / range);
      }
    }
  }
  cv::Mat colours;
  cv::applyColorMap(share, colours, cv::COLORMAP_TURBO);
  return colours;
}

}  // namespace

ModelRendering RenderModel(const PointCloud& surfels, const CameraModel& camera,
                           const Pose& T_world_cam) {
  RequireSurfels(surfels, camera);
  const Pose T_cam_world = T_world_cam.Inverse();
  Painter painter(surfels, camera);
  for (std::size_t i = 0; i < surfels.size(); ++i) {
    Disc disc;
    disc.centre = T_cam_world * surfels.points[i].cast<double>();
    disc.normal = T_cam_world.rotation() * surfels.normals[i].cast<double>();
    if (disc.normal.dot(disc.centre) > 0) disc.normal = -disc.normal;
    disc.radius = surfels.radii[i];
    painter.Draw(disc, i);
  }
  return painter.Take();
}

ModelAspect ToModelAspect(const std::string& name) {
  if (name == "colour") return ModelAspect::kColour;
  if (name == "normal") return ModelAspect::kNormal;
  if (name == "confidence") return ModelAspect::kConfidence;
  if (name == "depth") return ModelAspect::kDepth;
  throw UsageError(ErrorParts{"no such aspect of a model", "aspect",
                              "colour, normal, confidence or depth", name});
}

cv::Mat ToPicture(const ModelRendering& rendering, ModelAspect aspect) {
  cv::Mat picture;
  if (aspect == ModelAspect::kColour) {
    picture = rendering.bgr.clone();
  } else if (aspect == ModelAspect::kDepth) {
    picture = DepthColours(rendering.depth);
  } else if (aspect == ModelAspect::kConfidence) {
    cv::Mat grey;
    rendering.confidence.convertTo(grey, CV_8UC1, 255);
    cv::cvtColor(grey, picture, cv::COLOR_GRAY2BGR);
  } else {
    picture = cv::Mat(rendering.normal.size(), CV_8UC3);
    for (int y = 0; y < picture.rows; ++y) {
      for (int x = 0; x < picture.cols; ++x) {
        const auto& n = rendering.normal.at<cv::Vec3f>(y, x);
        picture.at<cv::Vec3b>(y, x) = NormalColour(n[0], n[1], n[2]);
      }
    }
  }
  picture.setTo(kChartBackground, rendering.depth == 0);
  return picture;
}

PointCloud Recoloured(const PointCloud& cloud, ModelAspect aspect) {
  const bool is_known = aspect == ModelAspect::kColour ||
                        (aspect == ModelAspect::kNormal && !cloud.normals.empty()) ||
                        (aspect == ModelAspect::kConfidence && !cloud.confidences.empty());
  if (!is_known) throw UsageError("the model says nothing of this aspect without a camera");
  PointCloud result = cloud;
  if (aspect == ModelAspect::kColour) return result;
  result.colours.clear();
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    cv::Vec3b bgr;
    if (aspect == ModelAspect::kNormal) {
      const Eigen::Vector3d n = cloud.normals[i].cast<double>();
      bgr = NormalColour(n.x(), n.y(), n.z());
    } else {
      bgr = cv::Vec3b::all(Channel(cloud.confidences[i]));
    }
    result.colours.push_back({bgr[2], bgr[1], bgr[0]});
  }
  return result;
}

}  // namespace mono3d::tools
