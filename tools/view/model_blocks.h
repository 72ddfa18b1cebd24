// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "view/model_errors.h"
#include "view/ply_vertices.h"
#include "view/surfel_block.h"

namespace mono3d::tools {

// A model cut into blocks of about the same number of surfels that lie together: the cells of a
// k-d tree over a sample of them.
class ModelBlocks {
 public:
  // Reads some 200,000 vertices, whatever the size of the model; `vertices`, and `errors` where
  // they are known, must outlive it.
  explicit ModelBlocks(const PlyVertices& vertices, const ModelErrors* errors = nullptr);

  // The blocks made of the sample alone: a first picture.
  std::vector<SurfelBlock> Preview() const;
  // The same blocks with all surfels. Takes a second for some five million.
  std::vector<SurfelBlock> All() const;
  // Of the sample.
  std::vector<Eigen::Vector3f> Normals() const;

 private:
  struct Split {
    int axis = 0;
    float value = 0;
  };
  ViewSurfel At(std::int64_t i) const;
  void TakeSample();
  void Build(std::size_t node, std::span<Eigen::Vector3f> points);
  std::size_t BlockOf(const Eigen::Vector3f& point) const;

  const PlyVertices& vertices_;
  const ModelErrors* errors_;
  std::size_t num_levels_ = 0;
  std::vector<Split> splits_;  // children of i: 2 i + 1 (below the value) and 2 i + 2
  std::vector<ViewSurfel> sample_;
};

}  // namespace mono3d::tools
