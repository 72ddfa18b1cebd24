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

// What the header of a binary little-endian PLY file says of its first element, the vertices.
struct PlyHeader {
  std::size_t num_bytes = 0;  // of the header
  std::size_t num_vertices = 0;
  std::vector<PlyProperty> properties;  // in the order of the file; at least one

  std::optional<std::size_t> Find(std::string_view name) const;  // index of a property
  std::size_t VertexBytes() const;
};

// Throws Error, with file and line, on another form.
PlyHeader ParsePlyHeader(const std::filesystem::path& path, std::string_view bytes);

std::size_t PlyScalarBytes(PlyScalar type);
// The number at `data`, in the byte order of the file.
double ReadPlyScalar(PlyScalar type, const char* data);

}  // namespace mono3d
