// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <cmath>
#include <cstdio>
#include <string>

#include "io/binary_block.h"
#include "mono3d/io/output_file.h"
#include "mono3d/products/las_file.h"

namespace mono3d {
namespace {

// Whole thousands, as people write them down.
Eigen::Vector3d LocalPlyOffset(const MapSurfels& surfels, const MapAxes& axes) {
  if (axes.system() == nullptr) return Eigen::Vector3d::Zero();
  const Eigen::Vector3d centre = surfels.bounds().center();
  return {1000 * std::floor(centre.x() / 1000), 1000 * std::floor(centre.y() / 1000), 0};
}

std::string LocalPlyHeader(const MapSurfels& surfels, const MapAxes& axes,
                           const Eigen::Vector3d& offset, const PointCloud& form) {
  std::string header = "ply\nformat binary_little_endian 1.0\n";
  if (axes.system() != nullptr) {
    char text[120];
    std::snprintf(text, sizeof text, "comment offset %.0f %.0f %.0f\n", offset.x(), offset.y(),
                  offset.z());
    header += "comment crs " + axes.system()->name() + '\n' + text +
              "comment coordinates of the crs = those of this file + offset\n";
  }
  header += "element vertex " + std::to_string(surfels.size()) +
            "\nproperty float x\nproperty float y\nproperty float z\n";
  if (!form.normals.empty()) {
    header += "property float nx\nproperty float ny\nproperty float nz\n";
  }
  if (!form.colours.empty()) {
    header += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  }
  if (!form.radii.empty()) header += "property float radius\n";
  if (!form.confidences.empty()) header += "property float confidence\n";
  if (!form.observations.empty()) header += "property uint observations\n";
  return header + "end_header\n";
}

}  // namespace

void WriteLocalPly(const std::filesystem::path& path, MapSurfels& surfels, const MapAxes& axes) {
  const Eigen::Vector3d offset = LocalPlyOffset(surfels, axes);
  const double radius_scale = 1 / axes.ModelUnitsPerUnit();
  MapSurfelBlock block;
  surfels.Read(0, block);
  AtomicFile file(path);
  std::string bytes = LocalPlyHeader(surfels, axes, offset, block.cloud);
  for (std::size_t index = 0; index < surfels.num_blocks(); ++index) {
    surfels.Read(index, block);
    const PointCloud& cloud = block.cloud;
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      const Eigen::Vector3f place = (block.points[i] - offset).cast<float>();
      AppendBytes(bytes, place.data(), 3);
      if (!cloud.normals.empty()) AppendBytes(bytes, block.normals[i].data(), 3);
      if (!cloud.colours.empty()) AppendBytes(bytes, cloud.colours[i].data(), 3);
      const auto radius =
          cloud.radii.empty() ? 0.F : static_cast<float>(cloud.radii[i] * radius_scale);
      if (!cloud.radii.empty()) AppendBytes(bytes, &radius, 1);
      if (!cloud.confidences.empty()) AppendBytes(bytes, &cloud.confidences[i], 1);
      if (!cloud.observations.empty()) AppendBytes(bytes, &cloud.observations[i], 1);
      WriteWhenFull(file, bytes);
    }
  }
  file.Write(bytes);
  file.Commit();
}

}  // namespace mono3d
