// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>

#include "view/ply_vertices.h"

namespace mono3d::tools {

// How far the vertices of a model are from the truth: model_errors.ply of `mono3d-evaluate run`.
class ModelErrors {
 public:
  // Null where there is no such file, or it is one of another model.
  static std::unique_ptr<const ModelErrors> Beside(const std::filesystem::path& model_path,
                                                   const PlyVertices& model);

  // Where the scale of its colours ends: one in fifty is further off.
  double largest_m() const { return largest_m_; }
  // From 0 to 1 of that.
  float ShareAt(std::int64_t i) const;

 private:
  explicit ModelErrors(const std::filesystem::path& path);
  bool AreOf(const PlyVertices& model) const;
  void FindLargest();

  PlyVertices vertices_;
  double largest_m_ = 0;
};

}  // namespace mono3d::tools
