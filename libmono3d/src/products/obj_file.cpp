// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <cstddef>
#include <cstdio>
#include <string>
#include <string_view>

#include "mono3d/io/output_file.h"
#include "mono3d/products/textured_mesh_file.h"
#include "products/jpeg.h"

namespace mono3d {
namespace {

// Appends numbers as text, nine digits: a float exactly.
template <typename... Numbers>
void AppendLine(std::string& text, const char* form, Numbers... numbers) {
  char line[128];
  const int length = std::snprintf(line, sizeof(line), form, numbers...);
  text.append(line, static_cast<std::size_t>(length));
}

std::string MaterialName(std::size_t part) { return "texture_" + std::to_string(part); }

}  // namespace

std::vector<std::filesystem::path> WriteObj(const std::filesystem::path& file,
                                            const TexturedMesh& mesh,
                                            const MeshFileOptions& options) {
  Validate(mesh, file.string());
  const std::string name = file.stem().string();
  std::vector<std::filesystem::path> written = {file};
  std::string materials = "# mono3d\n";
  for (std::size_t part = 0; part < mesh.textures.size(); ++part) {
    const std::string image = name + "_" + std::to_string(part) + ".jpg";
    const auto jpeg = JpegOf(mesh.textures[part], options.jpeg_quality);
    written.push_back(file.parent_path() / image);
    WriteFileAtomically(written.back(), {reinterpret_cast<const char*>(jpeg.data()), jpeg.size()});
    // Ambient and diffuse white, no highlights: viewers then show the texture as it is.
    materials += "newmtl " + MaterialName(part) +
                 "\nKa 1 1 1\nKd 1 1 1\nKs 0 0 0\nillum 1\nmap_Kd " + image + "\n";
  }
  written.push_back(file.parent_path() / (name + ".mtl"));
  WriteFileAtomically(written.back(), materials);

  std::string text = "# mono3d\n";
  if (options.origin) {
    AppendLine(text, "# metres, x east, y north, z up of latitude %.9f, longitude %.9f, ",
               options.origin->latitude_deg, options.origin->longitude_deg);
    AppendLine(text, "altitude %.3f m (WGS 84)\n", options.origin->altitude_m);
  }
  text += "mtllib " + name + ".mtl\n";
  for (const Eigen::Vector3f& v : mesh.vertices) {
    AppendLine(text, "v %.9g %.9g %.9g\n", static_cast<double>(v.x()), static_cast<double>(v.y()),
               static_cast<double>(v.z()));
  }
  // From the lower edge up, other than in glTF.
  for (const Eigen::Vector2f& v : mesh.texture_coordinates) {
    AppendLine(text, "vt %.9g %.9g\n", static_cast<double>(v.x()), static_cast<double>(1 - v.y()));
  }
  for (const Eigen::Vector3f& v : mesh.normals) {
    AppendLine(text, "vn %.4f %.4f %.4f\n", static_cast<double>(v.x()), static_cast<double>(v.y()),
               static_cast<double>(v.z()));
  }
  for (std::size_t part = 0; part < mesh.triangles.size(); ++part) {
    text += "usemtl " + MaterialName(part) + "\n";
    for (const auto& [a, b, c] : mesh.triangles[part]) {
      AppendLine(text, "f %u/%u/%u %u/%u/%u %u/%u/%u\n", a + 1, a + 1, a + 1, b + 1, b + 1, b + 1,
                 c + 1, c + 1, c + 1);
    }
  }
  WriteFileAtomically(file, text);
  return written;
}

}  // namespace mono3d
