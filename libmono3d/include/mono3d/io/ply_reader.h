// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <memory>

#include "mono3d/core/export.h"
#include "mono3d/geometry/point_cloud.h"

namespace MONO3D_EXPORT mono3d {

// The vertices of a PLY file, as ReadPly takes it, some at a time: of a model that is larger than
// the memory. For one thread at a time.
class PlyReader {
 public:
  // Throws Error on another form and when the file is too short for its vertices.
  explicit PlyReader(const std::filesystem::path& path);
  ~PlyReader();
  PlyReader(const PlyReader&) = delete;
  PlyReader& operator=(const PlyReader&) = delete;

  std::size_t size() const;  // vertices of the file

  // The next vertices, at most so many, in place of what `cloud` held. Returns how many; 0 at the
  // end. Throws Error (kIo).
  std::size_t Read(std::size_t max_count, PointCloud& cloud);
  // The vertex that is read next; from `size()` on: none.
  void Seek(std::size_t index);

 private:
  class Sink;
  struct Form;

  std::filesystem::path path_;
  std::ifstream file_;
  std::unique_ptr<Form> form_;
  std::size_t next_ = 0;
};

}  // namespace mono3d
