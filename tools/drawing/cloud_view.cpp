// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "drawing/cloud_view.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "mono3d/core/error.h"
#include "mono3d/core/statistics.h"

namespace mono3d::tools {
namespace {

constexpr std::size_t kMaxSamples = 100000;  // points that a view is chosen from
constexpr double kShareOutside = 0.005;      // at each side of a picture
constexpr double kViewMargin = 1.08;         // picture over what it shows
constexpr double kShareForAxes = 0.9;        // the points nearest to the middle give the axes
constexpr double kElevation_rad = 35 * std::numbers::pi / 180;
constexpr int kMinAspect = 4;  // a picture is at least this part of its width high

// Right-handed, from x to z: along the cloud, across it and up.
struct Axes {
  Eigen::Vector3d along;
  Eigen::Vector3d back;
  Eigen::Vector3d up;
};

std::vector<double> Along(const Eigen::Vector3d& axis, std::span<const Eigen::Vector3d> points) {
  std::vector<double> values(points.size());
  std::ranges::transform(points, values.begin(),
                         [&](const Eigen::Vector3d& point) { return axis.dot(point); });
  return values;
}

// The points around the middle, without what lies far out.
std::vector<Eigen::Vector3d> InnerPoints(std::span<const Eigen::Vector3d> points) {
  Eigen::Vector3d middle;
  for (int axis = 0; axis < 3; ++axis) {
    middle[axis] = Quantile(Along(Eigen::Vector3d::Unit(axis), points), 0.5);
  }
  std::vector<double> distances(points.size());
  std::ranges::transform(points, distances.begin(),
                         [&](const Eigen::Vector3d& point) { return (point - middle).norm(); });
  const double limit = Quantile(distances, kShareForAxes);
  std::vector<Eigen::Vector3d> inner;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (distances[i] <= limit) inner.push_back(points[i] - middle);
  }
  return inner;
}

// Which way along `axis` is up: where the normals point to, else where things stick out to.
double UpSign(const PointCloud& cloud, const Eigen::Vector3d& axis,
              std::span<const Eigen::Vector3d> inner) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3f& normal : cloud.normals) sum += normal.cast<double>();
  double sense = axis.dot(sum);
  if (cloud.normals.empty()) {
    const double ground = Quantile(Along(axis, inner), 0.5);
    for (const Eigen::Vector3d& point : inner) sense += std::pow(axis.dot(point) - ground, 3);
  }
  return sense < 0 ? -1 : 1;
}

Axes FindAxes(const PointCloud& cloud, std::span<const Eigen::Vector3d> points,
              const std::optional<Eigen::Vector3d>& up_world) {
  const std::vector<Eigen::Vector3d> inner = InnerPoints(points);
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& point : inner) mean += point / static_cast<double>(inner.size());
  for (const Eigen::Vector3d& point : inner) {
    scatter += (point - mean) * (point - mean).transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(scatter);
  Axes axes;
  axes.up = up_world ? up_world->normalized() : Eigen::Vector3d(solver.eigenvectors().col(0));
  if (!up_world) axes.up *= UpSign(cloud, axes.up, inner);
  Eigen::Vector3d along = solver.eigenvectors().col(2);
  along -= axes.up.dot(along) * axes.up;
  // A tower is longest upwards: any direction across it will do.
  axes.along = along.norm() > 1e-3 ? along.normalized() : axes.up.unitOrthogonal();
  Eigen::Index largest = 0;
  axes.along.cwiseAbs().maxCoeff(&largest);
  if (axes.along[largest] < 0) axes.along = -axes.along;  // eigenvectors come with either sign
  axes.back = axes.up.cross(axes.along);
  return axes;
}

// Looking along `forward`, with `up` upwards in the picture.
CloudView MakeView(const std::string& name, const Eigen::Vector3d& forward,
                   const Eigen::Vector3d& up, std::span<const Eigen::Vector3d> points,
                   int width_px) {
  CloudView view;
  view.name = name;
  const Eigen::Vector3d right = forward.cross(up).normalized();
  view.R_view_world.row(0) = right;
  view.R_view_world.row(1) = forward.cross(right);
  view.R_view_world.row(2) = forward;
  Eigen::Vector3d middle;
  Eigen::Vector3d extent;
  for (int axis = 0; axis < 3; ++axis) {
    const std::vector<double> values = Along(view.R_view_world.row(axis), points);
    const double low = Quantile(values, kShareOutside);
    const double high = Quantile(values, 1 - kShareOutside);
    middle[axis] = (low + high) / 2;
    extent[axis] = kViewMargin * (high - low);
  }
  view.centre_world = view.R_view_world.transpose() * middle;
  const double side = std::max(extent.x(), extent.y());
  if (side > 0) view.pixel_su = side / width_px;
  const int height = static_cast<int>(std::ceil(extent.y() / view.pixel_su));
  view.size = {width_px, std::clamp(height, std::max(1, width_px / kMinAspect), width_px)};
  return view;
}

}  // namespace

std::vector<CloudView> StandardCloudViews(const PointCloud& cloud, int width_px,
                                          const std::optional<Eigen::Vector3d>& up_world) {
  CheckCloud(cloud, "cloud to view");
  if (width_px < 1 || (up_world && !(up_world->allFinite() && up_world->norm() > 0))) {
    throw Error(ErrorParts{"cannot choose views",
                           "StandardCloudViews",
                           "a width of 1 or more and an upward direction",
                           {}});
  }
  const std::size_t step = (cloud.size() + kMaxSamples - 1) / kMaxSamples;
  std::vector<Eigen::Vector3d> points;
  for (std::size_t i = 0; i < cloud.size(); i += step) {
    points.push_back(cloud.points[i].cast<double>());
  }
  const Axes axes = FindAxes(cloud, points, up_world);
  const auto oblique = [&](const Eigen::Vector3d& horizontal) -> Eigen::Vector3d {
    return std::cos(kElevation_rad) * horizontal - std::sin(kElevation_rad) * axes.up;
  };
  return {MakeView("from above", -axes.up, axes.back, points, width_px),
          MakeView("from one side", oblique(axes.back), axes.up, points, width_px),
          MakeView("a quarter turn on", oblique(-axes.along), axes.up, points, width_px)};
}

}  // namespace mono3d::tools
