// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "view/surfel_block.h"

namespace mono3d::tools {

// The vertices of a model.ply, each to be had by its number without reading the others: the file is
// mapped into memory. Any number of threads may read.
class PlyVertices {
 public:
  // Throws Error where the file is none that WritePly would write: binary, little endian, its
  // vertices first, with the types of WritePly.
  explicit PlyVertices(const std::filesystem::path& path);
  ~PlyVertices();
  PlyVertices(const PlyVertices&) = delete;
  PlyVertices& operator=(const PlyVertices&) = delete;

  std::int64_t size() const { return num_vertices_; }
  Eigen::Vector3f Point(std::int64_t i) const;
  ViewSurfel At(std::int64_t i) const;
  // Of model_errors.ply, in metres.
  bool has_errors() const { return error_at_.has_value(); }
  float Error(std::int64_t i) const;

 private:
  template <typename T>
  T Read(std::int64_t i, std::size_t offset) const;
  void ReadHeader(const std::string& header, const std::filesystem::path& path);

  const char* bytes_ = nullptr;
  std::size_t num_bytes_ = 0;
  std::size_t vertices_at_ = 0;
  std::size_t stride_ = 0;
  std::int64_t num_vertices_ = 0;
  std::size_t point_at_ = 0;  // within a vertex
  std::optional<std::size_t> normal_at_, colour_at_, radius_at_, confidence_at_, observations_at_,
      first_frame_at_, error_at_;
};

}  // namespace mono3d::tools
