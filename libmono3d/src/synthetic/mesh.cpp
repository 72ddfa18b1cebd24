// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/mesh.h"

#include <Eigen/Geometry>

namespace mono3d::synthetic {
namespace {

std::uint32_t AddSurface(Mesh& mesh, const Parallelogram& frame, const Finish& finish,
                         bool is_smooth) {
  Surface surface;
  surface.material = finish.material;
  surface.colour = finish.colour;
  surface.seed = finish.seed;
  surface.is_smooth = is_smooth;
  surface.origin = frame.p;
  surface.u_axis = frame.a.normalized();
  const Eigen::Vector3f normal = frame.a.cross(frame.b).normalized();
  surface.v_axis = normal.cross(surface.u_axis);
  mesh.surfaces.push_back(surface);
  return static_cast<std::uint32_t>(mesh.surfaces.size() - 1);
}

std::uint32_t AddVertex(Mesh& mesh, const Eigen::Vector3f& p, const Eigen::Vector3f& normal) {
  mesh.vertices.push_back(p);
  mesh.normals.push_back(normal);
  return static_cast<std::uint32_t>(mesh.vertices.size() - 1);
}

void Connect(Mesh& mesh, const std::array<std::uint32_t, 3>& triangle, std::uint32_t surface) {
  mesh.triangles.push_back(triangle);
  mesh.triangle_surfaces.push_back(surface);
}

// Area-weighted mean of the triangles' normals, for the vertices from `first` on.
void SmoothNormals(Mesh& mesh, std::size_t first_vertex, std::size_t first_triangle) {
  for (std::size_t i = first_triangle; i < mesh.triangles.size(); ++i) {
    const auto& [a, b, c] = mesh.triangles[i];
    const Eigen::Vector3f normal =
        (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]);
    for (const std::uint32_t vertex : {a, b, c}) mesh.normals[vertex] += normal;
  }
  for (std::size_t i = first_vertex; i < mesh.normals.size(); ++i) mesh.normals[i].normalize();
}

}  // namespace

void AddParallelogram(Mesh& mesh, const Parallelogram& shape, const Finish& finish) {
  const std::uint32_t surface = AddSurface(mesh, shape, finish, false);
  const Eigen::Vector3f normal = shape.a.cross(shape.b).normalized();
  const std::uint32_t v0 = AddVertex(mesh, shape.p, normal);
  const std::uint32_t v1 = AddVertex(mesh, shape.p + shape.a, normal);
  const std::uint32_t v2 = AddVertex(mesh, shape.p + shape.a + shape.b, normal);
  const std::uint32_t v3 = AddVertex(mesh, shape.p + shape.b, normal);
  Connect(mesh, {v0, v1, v2}, surface);
  Connect(mesh, {v0, v2, v3}, surface);
}

void AddTriangle(Mesh& mesh, const std::array<Eigen::Vector3f, 3>& p, const Finish& finish) {
  const Parallelogram frame{p[0], p[1] - p[0], p[2] - p[0]};
  const std::uint32_t surface = AddSurface(mesh, frame, finish, false);
  const Eigen::Vector3f normal = frame.a.cross(frame.b).normalized();
  const std::uint32_t v0 = AddVertex(mesh, p[0], normal);
  const std::uint32_t v1 = AddVertex(mesh, p[1], normal);
  const std::uint32_t v2 = AddVertex(mesh, p[2], normal);
  Connect(mesh, {v0, v1, v2}, surface);
}

void AddBlock(Mesh& mesh, const Block& block, const Finish& finish) {
  const auto& [p, a, b, c] = block;
  AddParallelogram(mesh, {p + c, a, b}, finish);       // top
  AddParallelogram(mesh, {p, b, a}, finish);           // bottom
  AddParallelogram(mesh, {p, a, c}, finish);           // front
  AddParallelogram(mesh, {p + a, b, c}, finish);       // right
  AddParallelogram(mesh, {p + a + b, -a, c}, finish);  // back
  AddParallelogram(mesh, {p + b, -b, c}, finish);      // left
}

Block CentredBlock(const Eigen::Vector3f& centre, const Eigen::Vector3f& a,
                   const Eigen::Vector3f& b, const Eigen::Vector3f& c) {
  return {centre - (a + b + c) / 2, a, b, c};
}

void AddSheet(Mesh& mesh, SheetSize size,
              const std::function<Eigen::Vector3f(float s, float t)>& position,
              const Finish& finish) {
  const Parallelogram horizontal{Eigen::Vector3f::Zero(), Eigen::Vector3f::UnitX(),
                                 Eigen::Vector3f::UnitY()};
  const std::uint32_t surface = AddSurface(mesh, horizontal, finish, true);
  const std::size_t first_vertex = mesh.vertices.size();
  const std::size_t first_triangle = mesh.triangles.size();
  for (int row = 0; row <= size.rows; ++row) {
    for (int column = 0; column <= size.columns; ++column) {
      const float s = static_cast<float>(column) / static_cast<float>(size.columns);
      const float t = static_cast<float>(row) / static_cast<float>(size.rows);
      AddVertex(mesh, position(s, t), Eigen::Vector3f::Zero());
    }
  }
  const auto stride = static_cast<std::uint32_t>(size.columns + 1);
  for (std::uint32_t row = 0; row < static_cast<std::uint32_t>(size.rows); ++row) {
    for (std::uint32_t column = 0; column < static_cast<std::uint32_t>(size.columns); ++column) {
      const std::uint32_t v = static_cast<std::uint32_t>(first_vertex) + row * stride + column;
      Connect(mesh, {v, v + 1, v + stride + 1}, surface);
      Connect(mesh, {v, v + stride + 1, v + stride}, surface);
    }
  }
  SmoothNormals(mesh, first_vertex, first_triangle);
}

}  // namespace mono3d::synthetic
