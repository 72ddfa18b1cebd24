// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fuzz/fuzz_targets.h"
#include "fuzz/input_folder.h"
#include "mono3d/io/mesh_file.h"
#include "mono3d/io/ply_file.h"
#include "view/ply_vertices.h"

namespace mono3d::fuzz {

void Ply(std::string_view input) {
  static const InputFolder folder("ply");
  const auto file = folder.Write("model.ply", input);
  const auto written = folder.path() / "written.ply";
  if (const auto cloud = ReadOrRefuse([&] { return ReadPly(file); })) {
    WritePly(written, *cloud);
    static_cast<void>(ReadPly(written));
  }
  const auto mesh = ReadOrRefuse([&] { return ReadMeshPly(file); });
  if (mesh && mesh->normals.size() == mesh->vertices.size()) {  // others are not written
    WriteMeshPly(written, *mesh);
    static_cast<void>(ReadMeshPly(written));
  }
  static_cast<void>(ReadOrRefuse([&] {
    const tools::PlyVertices vertices(file);
    float sum = 0;
    for (std::int64_t i = 0; i < vertices.size(); ++i) sum += vertices.At(i).radius;
    return sum;
  }));
}

}  // namespace mono3d::fuzz
