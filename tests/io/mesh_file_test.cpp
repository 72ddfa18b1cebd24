// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/io/mesh_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "mono3d/core/error.h"
#include "mono3d/io/ply_file.h"

namespace mono3d {
namespace {

TriangleMesh OneTriangle() {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}};
  mesh.normals = {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}};
  mesh.colours = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}};
  mesh.triangles = {{0, 1, 2}};
  return mesh;
}

std::filesystem::path FileOfThisTest() {
  const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
  return std::filesystem::temp_directory_path() / (std::string("mono3d_") + test->name() + ".ply");
}

TEST(MeshFile, HoldsVerticesAndFaces) {
  const std::filesystem::path path = FileOfThisTest();
  WriteMeshPly(path, OneTriangle());
  const PointCloud vertices = ReadPly(path);
  EXPECT_EQ(vertices.points, OneTriangle().vertices);
  EXPECT_EQ(vertices.normals, OneTriangle().normals);
  EXPECT_EQ(vertices.colours, OneTriangle().colours);

  std::ifstream file(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  EXPECT_THAT(bytes, ::testing::HasSubstr(
                         "element face 1\nproperty list uchar uint vertex_indices\nend_header\n"));
  ASSERT_GT(bytes.size(), 13U);
  const char* face = bytes.data() + bytes.size() - 13;
  EXPECT_EQ(face[0], 3);
  std::uint32_t corners[3];
  std::memcpy(corners, face + 1, sizeof(corners));
  EXPECT_THAT(corners, ::testing::ElementsAre(0, 1, 2));
  std::filesystem::remove(path);
}

TEST(MeshFile, RefusesUnevenLists) {
  TriangleMesh mesh = OneTriangle();
  mesh.normals.pop_back();
  EXPECT_THROW(WriteMeshPly(FileOfThisTest(), mesh), Error);
  EXPECT_FALSE(std::filesystem::exists(FileOfThisTest()));
}

}  // namespace
}  // namespace mono3d
