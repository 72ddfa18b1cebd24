// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "geometry/surfel_grid.h"

#include <algorithm>
#include <cmath>

namespace mono3d {
namespace {

// A surfel speaks of corners up to so many cells, or radii where these are more, away: at least
// those of the cells that its surface cuts.
constexpr double kReach = 1.75;
// Bounds the work of a surfel that is far too large.
constexpr double kMaxReachInVoxels = kFarthestReach;

// No bounds.
constexpr GridBox kEverywhere = {{-kFarthestIndex, -kFarthestIndex, -kFarthestIndex},
                                 {kFarthestIndex, kFarthestIndex, kFarthestIndex}};

}  // namespace

SurfelGrid::SurfelGrid(const Eigen::Vector3d& origin, double voxel_su, const GridBox& box)
    : voxel_su_(voxel_su), origin_(origin), box_(box) {}

SurfelGrid::SurfelGrid(const PointCloud& surfels, double voxel_su)
    : SurfelGrid(surfels.points.front().cast<double>(), voxel_su, kEverywhere) {
  Add(surfels);
  Finish();
}

void SurfelGrid::Add(const PointCloud& surfels) {
  for (std::size_t i = 0; i < surfels.size(); ++i) Add(surfels, i);
}

void SurfelGrid::Finish() {
  for (GridCorner& corner : corners_) {
    corner.distance /= corner.weight;
    corner.colour /= corner.weight;
    corner.normal /= corner.weight;
  }
}

void SurfelGrid::Add(const PointCloud& surfels, std::size_t i) {
  const Eigen::Vector3d at = (surfels.points[i].cast<double>() - origin_) / voxel_su_;
  if (!(at.cwiseAbs().maxCoeff() < kFarthestIndex)) return;
  const double reach =
      std::min(kMaxReachInVoxels, kReach * std::max(1.0, surfels.radii[i] / voxel_su_));
  const Eigen::Vector3i first =
      (at.array() - reach)
          .ceil()
          .cast<int>()
          .max(Eigen::Array3i(box_.first[0], box_.first[1], box_.first[2]));
  const Eigen::Vector3i last = (at.array() + reach)
                                   .floor()
                                   .cast<int>()
                                   .min(Eigen::Array3i(box_.last[0], box_.last[1], box_.last[2]));
  // Never 0, so that every corner has a mean.
  const double confidence = surfels.confidences.empty() ? 1.0 : surfels.confidences[i] + 1e-3;
  Eigen::Vector3f colour = Eigen::Vector3f::Zero();
  if (!surfels.colours.empty()) {
    colour = {static_cast<float>(surfels.colours[i][0]), static_cast<float>(surfels.colours[i][1]),
              static_cast<float>(surfels.colours[i][2])};
  }
  for (int z = first.z(); z <= last.z(); ++z) {
    for (int y = first.y(); y <= last.y(); ++y) {
      for (int x = first.x(); x <= last.x(); ++x) {
        const Eigen::Vector3d offset = Eigen::Vector3d(x, y, z) - at;
        const double nearness = 1 - offset.squaredNorm() / (reach * reach);
        if (nearness <= 0) continue;
        const auto weight = static_cast<float>(confidence * nearness * nearness);
        const auto [entry, is_new] =
            place_of_.try_emplace({x, y, z}, static_cast<std::uint32_t>(corners_.size()));
        if (is_new) corners_.push_back({.index = {x, y, z}});
        GridCorner& corner = corners_[entry->second];
        const Eigen::Vector3f& normal = surfels.normals[i];
        corner.weight += weight;
        corner.distance +=
            weight * static_cast<float>(voxel_su_ * normal.cast<double>().dot(offset));
        corner.normal += weight * normal;
        corner.colour += weight * colour;
      }
    }
  }
}

std::optional<std::uint32_t> SurfelGrid::Find(const GridIndex& index) const {
  const auto found = place_of_.find(index);
  return found == place_of_.end() ? std::nullopt : std::optional(found->second);
}

bool SurfelGrid::IsLowest(const GridIndex& index) const {
  for (std::size_t k = 0; k < 3; ++k) {
    if (index[k] < box_.first[k] || index[k] >= box_.last[k]) return false;
  }
  return true;
}

bool SurfelGrid::IsOnBorder(const GridIndex& a, const GridIndex& b) const {
  for (std::size_t k = 0; k < 3; ++k) {
    if (a[k] == b[k] && (a[k] == box_.first[k] || a[k] == box_.last[k])) return true;
  }
  return false;
}

Eigen::Vector3f SurfelGrid::PointOf(const GridCorner& corner) const {
  const Eigen::Vector3d index(corner.index[0], corner.index[1], corner.index[2]);
  return (origin_ + voxel_su_ * index).cast<float>();
}

}  // namespace mono3d
