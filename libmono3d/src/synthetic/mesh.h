// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "synthetic/material.h"

namespace mono3d::synthetic {

// Triangles in the world (metres, z up), each with the surface that it is part of.
struct Mesh {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<Eigen::Vector3f> normals;  // one per vertex; shading only, outwards
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::uint32_t> triangle_surfaces;  // index in `surfaces`
  std::vector<Surface> surfaces;
};

// What a surface is made of; the place and axes of its texture come from the mesh builder.
struct Finish {
  Material material = Material::kPlaster;
  Eigen::Vector3f colour = Eigen::Vector3f::Constant(0.5F);
  std::uint32_t seed = 0;
};

// Points of the parallelogram p + s * a + t * b; outwards is a x b. Texture axes run along a and b.
struct Parallelogram {
  Eigen::Vector3f p;
  Eigen::Vector3f a;
  Eigen::Vector3f b;
};
void AddParallelogram(Mesh& mesh, const Parallelogram& shape, const Finish& finish);

// Outwards is (p1 - p0) x (p2 - p0); the texture's first axis runs along p1 - p0.
void AddTriangle(Mesh& mesh, const std::array<Eigen::Vector3f, 3>& p, const Finish& finish);

// The parallelepiped on three edges from one corner; (a, b, c) is right-handed.
struct Block {
  Eigen::Vector3f corner;
  Eigen::Vector3f a;
  Eigen::Vector3f b;
  Eigen::Vector3f c;
};
void AddBlock(Mesh& mesh, const Block& block, const Finish& finish);

// A block by its centre and the directions of its edges (as long as the edges are).
Block CentredBlock(const Eigen::Vector3f& centre, const Eigen::Vector3f& a,
                   const Eigen::Vector3f& b, const Eigen::Vector3f& c);

// A smooth sheet of (columns + 1) x (rows + 1) vertices, `position(s, t)` with s and t from 0 to 1;
// outwards is d/ds x d/dt. Its texture is a solid one, of the place in the world.
struct SheetSize {
  int columns = 1;
  int rows = 1;
};
void AddSheet(Mesh& mesh, SheetSize size,
              const std::function<Eigen::Vector3f(float s, float t)>& position,
              const Finish& finish);

}  // namespace mono3d::synthetic
