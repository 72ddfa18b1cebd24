// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/evaluation/true_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <unordered_set>

#include "evaluation/cloud_surface.h"
#include "geometry/cell_hash.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

constexpr double kReach = 2;  // in spacings, see the header
// Only to tell a spacing; planes are not asked for.
constexpr int kSpacingNeighbours = 3;

using Cell = std::array<std::int64_t, 3>;

// Which places have a point within reach, to the nearest cell of a grid whose edges are half of it:
// a lookup for each of many million pixels.
class CoveredPlaces {
 public:
  explicit CoveredPlaces(double reach) : edge_(reach / 2) {}

  bool Contains(const Eigen::Vector3d& p) const { return cells_.contains(CellOf(p)); }

  void Add(const Eigen::Vector3d& p) {
    const Cell middle = CellOf(p);
    for (int x = -kCells; x <= kCells; ++x) {
      for (int y = -kCells; y <= kCells; ++y) {
        for (int z = -kCells; z <= kCells; ++z) {
          if (x * x + y * y + z * z > kCells * kCells) continue;
          cells_.insert({middle[0] + x, middle[1] + y, middle[2] + z});
        }
      }
    }
  }

 private:
  static constexpr int kCells = 2;

  Cell CellOf(const Eigen::Vector3d& p) const {
    const auto index = [this](double coordinate) {
      return static_cast<std::int64_t>(std::floor(coordinate / edge_));
    };
    return {index(p.x()), index(p.y()), index(p.z())};
  }

  double edge_;
  std::unordered_set<Cell, CellHash<3>> cells_;
};

void RequireView(const TrueView& view) {
  if (view.camera.HasDistortion()) throw Error("a true view has a camera with distortion");
  if (view.depth.type() == CV_32FC1 && view.depth.cols == view.camera.width &&
      view.depth.rows == view.camera.height) {
    return;
  }
  throw Error(
      ErrorParts{.what = "the true depth does not fit its camera",
                 .where = {},
                 .expected = std::to_string(view.camera.width) + "x" +
                             std::to_string(view.camera.height) + ", one float a pixel",
                 .found = std::to_string(view.depth.cols) + "x" + std::to_string(view.depth.rows)});
}

// What the view shows where there is no point yet.
void AddMissing(const TrueView& view, double spacing, CoveredPlaces& covered, PointCloud& cloud) {
  const double max_depth = spacing * std::min(view.camera.fx, view.camera.fy);
  for (int y = 0; y < view.depth.rows; ++y) {
    const float* row = view.depth.ptr<float>(y);
    for (int x = 0; x < view.depth.cols; ++x) {
      const double depth = row[x];
      if (!(depth > 0 && depth <= max_depth)) continue;
      const Eigen::Vector3d p = view.T_world_cam * (depth * view.camera.Unproject({x, y}));
      if (covered.Contains(p)) continue;
      covered.Add(p);
      cloud.points.push_back(p.cast<float>());
    }
  }
}

double FarthestAround(const cv::Mat& depth, int x, int y) {
  float farthest = 0;
  for (int v = std::max(y - 1, 0); v <= std::min(y + 1, depth.rows - 1); ++v) {
    for (int u = std::max(x - 1, 0); u <= std::min(x + 1, depth.cols - 1); ++u) {
      farthest = std::max(farthest, depth.at<float>(v, u));
    }
  }
  return farthest;
}

bool Sees(const TrueView& view, const Eigen::Vector3d& p_cam, double reach) {
  if (p_cam.z() <= 0) return false;
  const Eigen::Vector2d pixel = view.camera.Project(p_cam);
  if (!view.camera.Contains(pixel)) return false;
  const double farthest = FarthestAround(view.depth, static_cast<int>(std::lround(pixel.x())),
                                         static_cast<int>(std::lround(pixel.y())));
  return farthest > 0 && p_cam.z() <= farthest + reach;
}

}  // namespace

double CloudSpacing(const PointCloud& cloud) {
  CheckCloud(cloud, "truth");
  return CloudSurface(cloud, std::min(kSpacingNeighbours, static_cast<int>(cloud.size())))
      .spacing();
}

PointCloud CompleteTrueCloud(const PointCloud& cloud, std::size_t num_views,
                             const TrueViewReader& view) {
  const double spacing = CloudSpacing(cloud);
  PointCloud complete;
  complete.points = cloud.points;
  if (spacing <= 0) return complete;  // a single point tells no spacing
  CoveredPlaces covered(kReach * spacing);
  for (const Eigen::Vector3f& p : cloud.points) covered.Add(p.cast<double>());
  for (std::size_t i = 0; i < num_views; ++i) {
    const TrueView shown = view(i);
    RequireView(shown);
    AddMissing(shown, spacing, covered, complete);
  }
  return complete;
}

std::vector<std::uint32_t> CountViews(const PointCloud& cloud, double spacing_m,
                                      std::size_t num_views, const TrueViewReader& view) {
  std::vector<std::uint32_t> counts(cloud.size(), 0);
  for (std::size_t i = 0; i < num_views; ++i) {
    const TrueView shown = view(i);
    RequireView(shown);
    const Pose T_cam_world = shown.T_world_cam.Inverse();
    for (std::size_t k = 0; k < cloud.size(); ++k) {
      const Eigen::Vector3d p_cam = T_cam_world * cloud.points[k].cast<double>();
      if (Sees(shown, p_cam, kReach * spacing_m)) ++counts[k];
    }
  }
  return counts;
}

double CompletenessOfSeen(std::span<const double> truth_distances_m,
                          std::span<const std::uint32_t> num_views, std::uint32_t min_views,
                          double threshold_m) {
  if (truth_distances_m.size() != num_views.size()) {
    throw Error(ErrorParts{.what = "true points seen by views",
                           .where = {},
                           .expected = std::to_string(truth_distances_m.size()) + " counts",
                           .found = std::to_string(num_views.size())});
  }
  std::size_t num_seen = 0;
  std::size_t num_within = 0;
  for (std::size_t i = 0; i < num_views.size(); ++i) {
    if (num_views[i] < min_views) continue;
    ++num_seen;
    if (truth_distances_m[i] <= threshold_m) ++num_within;
  }
  return num_seen == 0 ? 0 : static_cast<double>(num_within) / static_cast<double>(num_seen);
}

cv::Mat RenderTrueDepth(const PointCloud& cloud, double spacing_m, const CameraModel& camera,
                        const Pose& T_world_cam) {
  cv::Mat depth(camera.height, camera.width, CV_32FC1, cv::Scalar(0));
  const Pose T_cam_world = T_world_cam.Inverse();
  for (const Eigen::Vector3f& p : cloud.points) {
    const Eigen::Vector3d p_cam = T_cam_world * p.cast<double>();
    if (p_cam.z() <= 0) continue;
    const Eigen::Vector2d pixel = camera.Project(p_cam);
    // Half a point's width; no point is seen that is nearer than it is wide.
    const double radius_px = kReach / 2 * spacing_m * std::max(camera.fx, camera.fy) / p_cam.z();
    if (radius_px > std::max(camera.width, camera.height)) continue;
    const auto first = [&](double at) { return static_cast<int>(std::max(0.0, std::ceil(at))); };
    const auto last = [&](double at, int size) {
      return static_cast<int>(std::clamp(std::floor(at), -1.0, size - 1.0));
    };
    for (int y = first(pixel.y() - radius_px); y <= last(pixel.y() + radius_px, camera.height);
         ++y) {
      for (int x = first(pixel.x() - radius_px); x <= last(pixel.x() + radius_px, camera.width);
           ++x) {
        float& nearest = depth.at<float>(y, x);
        const auto z = static_cast<float>(p_cam.z());
        if (nearest == 0 || z < nearest) nearest = z;
      }
    }
  }
  return depth;
}

}  // namespace mono3d
