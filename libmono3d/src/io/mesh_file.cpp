// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/io/mesh_file.h"

#include <bit>
#include <string>

#include "mono3d/core/error.h"
#include "mono3d/io/output_file.h"

namespace mono3d {
namespace {

static_assert(std::endian::native == std::endian::little, "values are written as they are");

constexpr std::size_t kBlockBytes = std::size_t{1} << 20;

template <typename T>
void Append(std::string& bytes, const T* values, std::size_t count) {
  bytes.append(reinterpret_cast<const char*>(values), count * sizeof(T));
}

void WriteWhenFull(AtomicFile& file, std::string& block) {
  if (block.size() < kBlockBytes) return;
  file.Write(block);
  block.clear();
}

}  // namespace

void WriteMeshPly(const std::filesystem::path& path, const TriangleMesh& mesh) {
  const std::size_t num_vertices = mesh.vertices.size();
  const bool with_colours = !mesh.colours.empty();
  if (mesh.normals.size() != num_vertices ||
      (with_colours && mesh.colours.size() != num_vertices)) {
    throw Error(ErrorParts{.what = "lists of the mesh differ in length",
                           .where = path,
                           .expected = std::to_string(num_vertices),
                           .found = std::to_string(mesh.normals.size())});
  }
  std::string block = "ply\nformat binary_little_endian 1.0\nelement vertex " +
                      std::to_string(num_vertices) +
                      "\nproperty float x\nproperty float y\nproperty float z\n"
                      "property float nx\nproperty float ny\nproperty float nz\n";
  if (with_colours) {
    block += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  }
  block += "element face " + std::to_string(mesh.triangles.size()) +
           "\nproperty list uchar uint vertex_indices\nend_header\n";
  AtomicFile file(path);
  for (std::size_t i = 0; i < num_vertices; ++i) {
    Append(block, mesh.vertices[i].data(), 3);
    Append(block, mesh.normals[i].data(), 3);
    if (with_colours) Append(block, mesh.colours[i].data(), 3);
    WriteWhenFull(file, block);
  }
  for (const auto& triangle : mesh.triangles) {
    block += '\3';
    Append(block, triangle.data(), 3);
    WriteWhenFull(file, block);
  }
  file.Write(block);
  file.Commit();
}

}  // namespace mono3d
