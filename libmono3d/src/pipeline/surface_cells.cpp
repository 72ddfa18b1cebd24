// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/surface_cells.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "mono3d/core/statistics.h"

namespace mono3d {
namespace {

constexpr double kMaxGridCells = 400'000;
constexpr double kShareBeyondGrid = 0.005;  // of the surfels, at each side
// Discs of surfels over the area of a cell's side, from which it counts as surface: those of a
// closed surface overlap.
constexpr double kMinCover = 0.3;
constexpr std::size_t kMaxSurfelsForRange = 100'000;

double RangeOfAxis(const PointCloud& model, int axis, double share) {
  const std::size_t step = model.size() / kMaxSurfelsForRange + 1;
  std::vector<float> values;
  for (std::size_t i = 0; i < model.size(); i += step) values.push_back(model.points[i][axis]);
  return Quantile(std::move(values), share);
}

}  // namespace

CellGrid::CellGrid(const PointCloud& model, double cell_su) : cell_su_(cell_su) {
  Eigen::Vector3d high;
  for (int axis = 0; axis < 3; ++axis) {
    low_[axis] = RangeOfAxis(model, axis, kShareBeyondGrid);
    high[axis] = RangeOfAxis(model, axis, 1 - kShareBeyondGrid);
  }
  const Eigen::Vector3d range = high - low_;
  const auto num_at = [&range](double cell) { return (range.array() / cell + 3).prod(); };
  while (num_at(cell_su_) > kMaxGridCells) cell_su_ *= 1.1;
  // A cell around all.
  low_.array() -= cell_su_;
  size_ = (range / cell_su_).array().floor().cast<int>() + 3;
  touched_.resize(static_cast<std::size_t>(size_.prod()));

  struct Sum {
    SurfaceCell cell;
    double area_su2 = 0;
    double num = 0;
  };
  std::map<std::size_t, Sum> sums;
  for (std::size_t i = 0; i < model.size(); ++i) {
    const Eigen::Vector3d point = model.points[i].cast<double>();
    const Eigen::Vector3i at = CellAt(point);
    if (!Contains(at)) continue;
    touched_[Index(at)] = 1;
    Sum& sum = sums[Index(at)];
    const double radius_su = model.radii.empty() ? cell_su_ : model.radii[i];
    sum.area_su2 += std::numbers::pi * radius_su * radius_su;
    sum.num += 1;
    sum.cell.centre += point;
    if (!model.normals.empty()) sum.cell.normal += model.normals[i].cast<double>();
    sum.cell.confidence += model.confidences.empty() ? 1 : model.confidences[i];
    sum.cell.observations += model.observations.empty() ? 2 : model.observations[i];
    sum.cell.inferred += IsInferred(model, i) ? 1 : 0;
  }
  for (auto& [index, sum] : sums) {
    SurfaceCell& cell = sum.cell;
    if (sum.area_su2 < kMinCover * cell_su_ * cell_su_ || !(cell.normal.norm() > 0)) continue;
    cell.centre /= sum.num;
    cell.normal.normalize();
    cell.confidence /= sum.num;
    cell.observations /= sum.num;
    cell.inferred /= sum.num;
    surface_.push_back(cell);
  }
}

std::size_t CellGrid::Index(const Eigen::Vector3i& cell) const {
  return static_cast<std::size_t>((cell.z() * size_.y() + cell.y()) * size_.x() + cell.x());
}

bool CellGrid::Contains(const Eigen::Vector3i& cell) const {
  return (cell.array() >= 0).all() && (cell.array() < size_.array()).all();
}

Eigen::Vector3i CellGrid::CellAt(const Eigen::Vector3d& p) const {
  const Eigen::Array3d at = ((p - low_) / cell_su_).array().floor();
  return at.max(-1).min(size_.array().cast<double>()).cast<int>();
}

Eigen::Vector3d CellGrid::Centre(const Eigen::Vector3i& cell) const {
  return low_ + cell_su_ * (cell.cast<double>().array() + 0.5).matrix();
}

PinholeView::PinholeView(const CameraModel& camera, const Pose& T_world_cam)
    : camera_(camera),
      R_(T_world_cam.rotation().toRotationMatrix().transpose()),
      t_(-(R_ * T_world_cam.translation())),
      left_(-camera.cx),
      right_(camera.width - 1 - camera.cx),
      top_(-camera.cy),
      bottom_(camera.height - 1 - camera.cy) {}

CellPicture::CellPicture(const CameraModel& camera, const Pose& T_world_cam)
    : view_(camera, T_world_cam),
      depths_(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height),
              std::numeric_limits<float>::infinity()) {
  rays_x_.reserve(static_cast<std::size_t>(camera.width));
  for (int x = 0; x < camera.width; ++x) rays_x_.push_back((x - camera.cx) / camera.fx);
}

void CellPicture::Draw(std::span<const SurfaceCell> surface, double cell_su, double min_depth_su,
                       double max_depth_su) {
  // As far as the corners of a cell are from its middle.
  const double radius_su = 0.87 * cell_su;
  min_depth_su = std::max(min_depth_su, cell_su);
  for (const SurfaceCell& cell : surface) {
    const Eigen::Vector3d centre = view_.InCamera(cell.centre);
    if (!(centre.z() > min_depth_su && centre.z() <= max_depth_su)) continue;
    const cv::Rect pixels = PixelsOfDisc(centre, radius_su);
    if (!pixels.empty()) DrawDisc(pixels, centre, view_.Turned(cell.normal), radius_su);
  }
}

cv::Rect CellPicture::PixelsOfDisc(const Eigen::Vector3d& centre_cam, double radius_su) const {
  const CameraModel& camera = view_.camera();
  // Most are beside the picture: that is told without a division.
  const auto is_beside = [&centre_cam](double middle, double half, double centre, int end) {
    return middle + half < -centre * centre_cam.z() ||
           middle - half > (end - centre) * centre_cam.z();
  };
  const double middle_x = camera.fx * centre_cam.x(), half_x = camera.fx * radius_su;
  const double middle_y = camera.fy * centre_cam.y(), half_y = camera.fy * radius_su;
  if (is_beside(middle_x, half_x, camera.cx, camera.width) ||
      is_beside(middle_y, half_y, camera.cy, camera.height)) {
    return {};
  }
  const double per_depth = 1 / centre_cam.z();
  // From the first pixel within `half` of `middle` to behind the last, of pixels from 0 to `end`.
  const auto within = [](double middle, double half, int end) {
    const double last = middle + half;
    const double first = std::max(middle - half, 0.0);
    const int before = static_cast<int>(first);
    return cv::Range(before < first ? before + 1 : before,
                     last < end ? static_cast<int>(last) + 1 : end);
  };
  const cv::Range columns =
      within(middle_x * per_depth + camera.cx, half_x * per_depth, camera.width);
  const cv::Range rows =
      within(middle_y * per_depth + camera.cy, half_y * per_depth, camera.height);
  return {columns.start, rows.start, std::max(columns.size(), 0), std::max(rows.size(), 0)};
}

void CellPicture::DrawDisc(const cv::Rect& pixels, const Eigen::Vector3d& centre_cam,
                           const Eigen::Vector3d& normal_cam, double radius_su) {
  const CameraModel& camera = view_.camera();
  // The ray r meets the disc's plane at depth a / q, where a = n.c and q = n.r, and within its
  // radius where |a / q r - c|^2 <= radius^2: a (a r.r - 2 q c.r) + (c.c - radius^2) q^2 <= 0.
  const double a = normal_cam.dot(centre_cam);
  const double beyond = centre_cam.squaredNorm() - radius_su * radius_su;
  const auto nearest_of_disc = static_cast<float>(centre_cam.z() - radius_su);
  for (int y = pixels.y; y < pixels.y + pixels.height; ++y) {
    const double ray_y = (y - camera.cy) / camera.fy;
    const double normal_of_row = normal_cam.y() * ray_y + normal_cam.z();
    const double centre_of_row = centre_cam.y() * ray_y + centre_cam.z();
    const double square_of_row = ray_y * ray_y + 1;
    float* const row = depths_.data() + static_cast<std::ptrdiff_t>(y) * camera.width;
    for (int x = pixels.x; x < pixels.x + pixels.width; ++x) {
      if (row[x] <= nearest_of_disc) continue;
      const double ray_x = rays_x_[static_cast<std::size_t>(x)];
      const double q = normal_cam.x() * ray_x + normal_of_row;
      const double along = centre_cam.x() * ray_x + centre_of_row;
      const double square = ray_x * ray_x + square_of_row;
      if (!(a * (a * square - 2 * q * along) + beyond * q * q <= 0) || q == 0) continue;
      row[x] = std::min(row[x], static_cast<float>(a / q));
    }
  }
}

CellPicture::Depths CellPicture::At(const Eigen::Vector3d& p_world) const {
  const Eigen::Vector3d p_cam = view_.InCamera(p_world);
  if (!view_.Sees(p_cam)) return {};
  const CameraModel& camera = view_.camera();
  const Eigen::Vector2d pixel = camera.Project(p_cam);
  const int x = std::clamp(static_cast<int>(pixel.x() + 0.5), 0, camera.width - 1);
  const int y = std::clamp(static_cast<int>(pixel.y() + 0.5), 0, camera.height - 1);
  return {p_cam.z(), depths_[static_cast<std::size_t>(y * camera.width + x)]};
}

void CellPicture::OpenSky(const Eigen::Vector3d& up_world) {
  constexpr double kUpright = 0.5;
  constexpr float kFarAway = 1e30F;
  if (-view_.Turned(up_world).y() < kUpright) return;
  const int width = view_.camera().width;
  for (int x = 0; x < width; ++x) {
    for (int y = 0; y < view_.camera().height; ++y) {
      float& depth = depths_[static_cast<std::size_t>(y * width + x)];
      if (std::isfinite(depth)) break;
      depth = kFarAway;
    }
  }
}

double CellPicture::ShareCovered() const {
  const auto num = std::ranges::count_if(depths_, [](float depth) { return depth < 1e30F; });
  return static_cast<double>(num) / static_cast<double>(depths_.size());
}

}  // namespace mono3d
