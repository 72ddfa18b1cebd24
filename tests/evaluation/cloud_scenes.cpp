// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "evaluation/cloud_scenes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <numbers>
#include <random>
#include <vector>

namespace mono3d {
namespace {

// A parallelogram: origin, two sides; its normal is the first times the second.
struct Face {
  Eigen::Vector3d origin;
  Eigen::Vector3d side_a;
  Eigen::Vector3d side_b;
};

void AddWalls(const Eigen::Vector3d& low, const Eigen::Vector3d& size, std::vector<Face>& faces) {
  const Eigen::Vector3d x(size.x(), 0, 0);
  const Eigen::Vector3d y(0, size.y(), 0);
  const Eigen::Vector3d z(0, 0, size.z());
  faces.push_back({low, x, z});
  faces.push_back({low + y, z, x});
  faces.push_back({low, z, y});
  faces.push_back({low + x, y, z});
}

std::vector<Face> HouseFaces() {
  std::vector<Face> faces;
  faces.push_back({{-10, -10, 0}, {20, 0, 0}, {0, 20, 0}});
  AddWalls({-4, -3, 0}, {8, 6, 4}, faces);
  faces.push_back({{-4, -3, 4}, {8, 0, 0}, {0, 3, 2.5}});  // roof, ridge along x
  faces.push_back({{-4, 0, 6.5}, {8, 0, 0}, {0, 3, -2.5}});
  AddWalls({5.5, 2, 0}, {2, 3, 2}, faces);  // shed with a lean-to roof
  faces.push_back({{5.5, 2, 2}, {2, 0, 0.7}, {0, 3, 0}});
  return faces;
}

}  // namespace

PointCloud HouseCloud(std::size_t num_points, std::uint32_t seed, bool with_normals) {
  const std::vector<Face> faces = HouseFaces();
  std::vector<double> areas(faces.size());
  std::ranges::transform(faces, areas.begin(),
                         [](const Face& face) { return face.side_a.cross(face.side_b).norm(); });
  std::mt19937 random(seed);
  std::discrete_distribution<std::size_t> face_of(areas.begin(), areas.end());
  std::uniform_real_distribution<double> along(0, 1);
  PointCloud cloud;
  for (std::size_t i = 0; i < num_points; ++i) {
    const std::size_t f = face_of(random);
    const double a = along(random);
    const double b = along(random);
    const Face& face = faces[f];
    cloud.points.push_back((face.origin + a * face.side_a + b * face.side_b).cast<float>());
    if (!with_normals) continue;
    cloud.normals.push_back(face.side_a.cross(face.side_b).normalized().cast<float>());
  }
  return cloud;
}

Similarity TestSimilarity(double angle_deg, double scale, const Eigen::Vector3d& shift) {
  const Eigen::Vector3d axis = Eigen::Vector3d(1, 2, 3).normalized();
  const double angle_rad = angle_deg * std::numbers::pi / 180;
  return {scale, Pose(RotationExp(angle_rad * axis), shift)};
}

double LargestCornerDistance(const Similarity& a, const Similarity& b) {
  double largest = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d point((corner & 1) != 0 ? 10 : -10, (corner & 2) != 0 ? 10 : -10,
                                (corner & 4) != 0 ? 6.5 : 0);
    largest = std::max(largest, (a * point - b * point).norm());
  }
  return largest;
}

}  // namespace mono3d
