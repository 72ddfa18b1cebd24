// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <functional>

#include "mono3d/core/export.h"
#include "mono3d/geometry/point_cloud.h"
#include "mono3d/geometry/triangle_mesh.h"

namespace MONO3D_EXPORT mono3d {

// The surfels of a model that may be larger than the memory.
class SurfelSource {
 public:
  virtual ~SurfelSource() = default;

  // Hands out all surfels whose centre is in the box, and others as it likes, block by block: the
  // same ones each time, in the same order.
  virtual void Read(const Eigen::AlignedBox3d& box,
                    const std::function<void(const PointCloud&)>& take) = 0;
};

struct MeshTilesResult {
  std::size_t num_tiles = 0;
  std::size_t num_triangles = 0;  // of all tiles
  double median_radius_su = 0;    // of the surfels
};

// MeshSurfels of a model part by part: `take` is handed the triangles of each part, and of them all
// those of the mesh of the whole, each once and with the same bits; parts that meet have the
// vertices on the plane between them both. A part comes from at most `max_surfels`, and those near
// it. Pieces that are small in their part, but hang together with others, come last, in a part of
// their own. Beside one part at a time, memory holds four bytes a surfel. Throws Error as
// MeshSurfels does, and what the source throws.
MeshTilesResult MeshSurfelsInTiles(SurfelSource& surfels, std::size_t max_surfels,
                                   const MeshOptions& options,
                                   const std::function<void(TriangleMesh part)>& take);

}  // namespace mono3d
