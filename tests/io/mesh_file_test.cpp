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
  return std::filesystem::path(testing::TempDir()) /
         (std::string("mono3d_") + test->name() + ".ply");
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

TEST(MeshFile, ReadsBackWhatItWrote) {
  const std::filesystem::path path = FileOfThisTest();
  TriangleMesh mesh = OneTriangle();
  mesh.triangles.push_back({2, 1, 0});
  WriteMeshPly(path, mesh);
  const TriangleMesh read = ReadMeshPly(path);
  EXPECT_EQ(read.vertices, mesh.vertices);
  EXPECT_EQ(read.normals, mesh.normals);
  EXPECT_EQ(read.colours, mesh.colours);
  EXPECT_EQ(read.triangles, mesh.triangles);
  std::filesystem::remove(path);
}

// Three vertices without more, and one face, as other programs write them.
void WriteMesh(const std::filesystem::path& path, const std::string& face_properties,
               const std::string& face) {
  std::ofstream file(path, std::ios::binary);
  file << "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\n"
          "property float y\nproperty float z\nelement face 1\n"
       << face_properties << "end_header\n"
       << std::string(3 * 3 * sizeof(float), '\0') << face;
}

TEST(MeshFile, ReadsTheFormsOfOthers) {
  const std::filesystem::path path = FileOfThisTest();
  WriteMesh(path, "property list ushort uchar vertex_index\n", std::string("\3\0\0\2\1", 5));
  const TriangleMesh mesh = ReadMeshPly(path);
  EXPECT_EQ(mesh.vertices.size(), 3U);
  EXPECT_TRUE(mesh.normals.empty());
  EXPECT_THAT(mesh.triangles, ::testing::ElementsAre(std::array<std::uint32_t, 3>{0, 2, 1}));
  std::filesystem::remove(path);
}

TEST(MeshFile, RefusesWhatIsNoTriangles) {
  const std::filesystem::path path = FileOfThisTest();
  const std::string list = "property list uchar uchar vertex_indices\n";
  const auto refuses = [&](const std::string& properties, const std::string& face,
                           const std::string& expected) {
    WriteMesh(path, properties, face);
    try {
      static_cast<void>(ReadMeshPly(path));
      ADD_FAILURE() << expected;
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), ::testing::HasSubstr(expected));
    }
  };
  refuses(list, std::string("\4\0\1\2\0", 5), "3 corners each");
  refuses(list, std::string("\3\0\1\3", 4), "one of 3 vertices");
  refuses(list, std::string("\3\0\1", 3), "1 triangles");
  refuses(list + "property uchar flags\n", std::string("\3\0\1\2\0", 5), "vertex_indices alone");
  refuses("property uchar flags\n", std::string("\0", 1), "vertex_indices alone");
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
