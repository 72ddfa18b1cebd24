// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/products/textured_mesh_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tiny_gltf.h>

#include <cstring>
#include <opencv2/imgcodecs.hpp>

#include "io/temporary_folder.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class TexturedMeshFileTest : public TemporaryFolderTest {
 protected:
  // A square of two textures.
  static TexturedMesh Square() {
    TexturedMesh mesh;
    mesh.vertices = {{0, 0, 5}, {1, 0, 5}, {1, 2, 5}, {0, 2, 5}};
    mesh.normals.assign(4, Eigen::Vector3f::UnitZ());
    mesh.texture_coordinates = {{0, 1}, {1, 1}, {1, 0}, {0, .25F}};
    mesh.triangles = {{{0, 1, 2}}, {{0, 2, 3}}};
    mesh.textures = {cv::Mat(8, 16, CV_8UC3, cv::Scalar(0, 0, 200)),
                     cv::Mat(4, 4, CV_8UC3, cv::Scalar(200, 0, 0))};
    return mesh;
  }
};

TEST_F(TexturedMeshFileTest, GlbIsReadByTinyGltf) {
  const TexturedMesh mesh = Square();
  WriteGlb(folder_ / "mesh.glb", mesh, {.origin = Geodetic{49.5, 8.25, 160}});
  tinygltf::TinyGLTF reader;
  tinygltf::Model model;
  std::string error, warning;
  ASSERT_TRUE(reader.LoadBinaryFromFile(&model, &error, &warning, folder_ / "mesh.glb")) << error;
  EXPECT_EQ(error + warning, "");
  ASSERT_EQ(model.meshes.size(), 1u);
  ASSERT_EQ(model.meshes[0].primitives.size(), 2u);
  ASSERT_EQ(model.images.size(), 2u);
  EXPECT_EQ(model.images[0].width, 16);
  EXPECT_EQ(model.images[0].height, 8);
  EXPECT_NEAR(model.images[0].image[0], 200, 3);  // red comes first
  const auto& attributes = model.meshes[0].primitives[1].attributes;
  const tinygltf::Accessor& positions =
      model.accessors[static_cast<std::size_t>(attributes.at("POSITION"))];
  EXPECT_EQ(positions.count, 4u);
  EXPECT_THAT(positions.maxValues, ElementsAre(1, 2, 5));
  const tinygltf::BufferView& view =
      model.bufferViews[static_cast<std::size_t>(positions.bufferView)];
  float third = 0;
  std::memcpy(&third, model.buffers[0].data.data() + view.byteOffset + 7 * sizeof(float), 4);
  EXPECT_EQ(third, 2);  // y of vertex 2
  // A point x east, y north, z up is at x, z, -y where y is up.
  EXPECT_THAT(model.nodes[0].matrix, ElementsAre(1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1));
  EXPECT_EQ(model.asset.extras.Get("origin_latitude_deg").Get<double>(), 49.5);
  EXPECT_EQ(model.asset.extras.Get("unit").Get<std::string>(), "metre");
}

TEST_F(TexturedMeshFileTest, ObjHasMaterialsAndTextures) {
  const auto written = WriteObj(folder_ / "mesh.obj", Square());
  EXPECT_THAT(written, ElementsAre(folder_ / "mesh.obj", folder_ / "mesh_0.jpg",
                                   folder_ / "mesh_1.jpg", folder_ / "mesh.mtl"));
  const std::string text = ReadText(written[0]);
  EXPECT_THAT(text, HasSubstr("mtllib mesh.mtl\n"));
  EXPECT_THAT(text, HasSubstr("v 1 2 5\n"));
  EXPECT_THAT(text, HasSubstr("vt 0 0.75\n"));  // upwards
  EXPECT_THAT(text, HasSubstr("usemtl texture_1\nf 1/1/1 3/3/3 4/4/4\n"));
  EXPECT_THAT(ReadText(written[3]), HasSubstr("newmtl texture_1\n"));
  EXPECT_THAT(ReadText(written[3]), HasSubstr("map_Kd mesh_1.jpg\n"));
  EXPECT_EQ(cv::imread(written[1].string()).size(), cv::Size(16, 8));
}

TEST_F(TexturedMeshFileTest, RefusesWhatDoesNotFitTogether) {
  TexturedMesh mesh = Square();
  mesh.texture_coordinates.pop_back();
  EXPECT_THROW(WriteGlb(folder_ / "mesh.glb", mesh), Error);
  mesh = Square();
  mesh.triangles[1][0][2] = 4;
  EXPECT_THROW(WriteObj(folder_ / "mesh.obj", mesh), Error);
  mesh = Square();
  mesh.textures.pop_back();
  EXPECT_THROW(WriteGlb(folder_ / "mesh.glb", mesh), Error);
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

}  // namespace
}  // namespace mono3d
