// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace mono3d {

enum class PlyScalar { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat32, kFloat64 };

struct PlyProperty {
  std::string name;
  PlyScalar type = PlyScalar::kFloat32;
};

// The list of the corners of each face.
struct PlyFaces {
  std::size_t count = 0;
  PlyScalar count_type = PlyScalar::kUint8;   // number of corners
  PlyScalar vertex_type = PlyScalar::kInt32;  // of each, its vertex
};

// What the header of a binary little-endian PLY file says of its first element, the vertices, and
// of its second one, where these are faces that have their corners and nothing else.
struct PlyHeader {
  std::size_t num_bytes = 0;  // of the header
  std::size_t num_vertices = 0;
  std::vector<PlyProperty> properties;  // in the order of the file; at least one
  std::optional<PlyFaces> faces;

  std::optional<std::size_t> Find(std::string_view name) const;  // index of a property
  std::size_t VertexBytes() const;
};

// Throws Error, with file and line, on another form.
PlyHeader ParsePlyHeader(const std::filesystem::path& path, std::string_view bytes);

std::size_t PlyScalarBytes(PlyScalar type);
// The number at `data`, in the byte order of the file.
double ReadPlyScalar(PlyScalar type, const char* data);

}  // namespace mono3d
