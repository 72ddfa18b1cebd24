// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/io/mesh_file.h"

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "io/binary_block.h"
#include "io/ply_header.h"
#include "io/text.h"
#include "mono3d/core/error.h"
#include "mono3d/io/output_file.h"
#include "mono3d/io/ply_file.h"

namespace mono3d {
namespace {

[[noreturn]] void ThrowBadFaces(const std::filesystem::path& path, const std::string& expected,
                                const std::string& found) {
  throw Error(ErrorParts{
      .what = "bad faces of a mesh", .where = path, .expected = expected, .found = found});
}

// `bytes`: those behind the vertices.
std::vector<std::array<std::uint32_t, 3>> ParseTriangles(const std::filesystem::path& path,
                                                         std::string_view bytes,
                                                         const PlyFaces& faces,
                                                         std::size_t num_vertices) {
  const std::size_t count_bytes = PlyScalarBytes(faces.count_type);
  const std::size_t vertex_bytes = PlyScalarBytes(faces.vertex_type);
  const std::size_t available = bytes.size() / (count_bytes + 3 * vertex_bytes);
  if (available < faces.count) {
    ThrowBadFaces(path, std::to_string(faces.count) + " triangles", std::to_string(available));
  }
  std::vector<std::array<std::uint32_t, 3>> triangles(faces.count);
  const char* data = bytes.data();
  for (auto& triangle : triangles) {
    const double num_corners = ReadPlyScalar(faces.count_type, data);
    if (num_corners != 3) ThrowBadFaces(path, "3 corners each", ToText(num_corners));
    data += count_bytes;
    for (std::uint32_t& corner : triangle) {
      const double vertex = ReadPlyScalar(faces.vertex_type, data);
      if (!(vertex >= 0 && vertex < static_cast<double>(num_vertices))) {
        ThrowBadFaces(path, "one of " + std::to_string(num_vertices) + " vertices", ToText(vertex));
      }
      corner = static_cast<std::uint32_t>(vertex);
      data += vertex_bytes;
    }
  }
  return triangles;
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
    AppendBytes(block, mesh.vertices[i].data(), 3);
    AppendBytes(block, mesh.normals[i].data(), 3);
    if (with_colours) AppendBytes(block, mesh.colours[i].data(), 3);
    WriteWhenFull(file, block);
  }
  for (const auto& triangle : mesh.triangles) {
    block += '\3';
    AppendBytes(block, triangle.data(), 3);
    WriteWhenFull(file, block);
  }
  file.Write(block);
  file.Commit();
}

TriangleMesh ReadMeshPly(const std::filesystem::path& path) {
  PointCloud vertices = ReadPly(path);
  TriangleMesh mesh;
  mesh.vertices = std::move(vertices.points);
  mesh.normals = std::move(vertices.normals);
  mesh.colours = std::move(vertices.colours);
  const std::string bytes = ReadBytes(path);
  const PlyHeader header = ParsePlyHeader(path, bytes);
  if (!header.faces) {
    ThrowBadFaces(path, "faces with a list vertex_indices alone, behind the vertices", "none");
  }
  const std::size_t begin = header.num_bytes + header.num_vertices * header.VertexBytes();
  mesh.triangles = ParseTriangles(path, std::string_view(bytes).substr(begin), *header.faces,
                                  mesh.vertices.size());
  return mesh;
}

}  // namespace mono3d
