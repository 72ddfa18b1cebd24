// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "view/model_blocks.h"

#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

#include "evaluate/error_file.h"
#include "io/temporary_folder.h"
#include "mono3d/core/error.h"
#include "mono3d/io/ply_file.h"

namespace mono3d::tools {
namespace {

class ModelInBlocks : public TemporaryFolderTest {
 protected:
  // A wavy square of `num` x `num` surfels with all that a model has.
  std::filesystem::path WriteModel(int num) const {
    PointCloud cloud;
    for (int i = 0; i < num * num; ++i) {
      const auto x = static_cast<float>(i % num), y = static_cast<float>(i / num);
      cloud.points.emplace_back(x, y, std::sin(0.1F * x));
      cloud.normals.emplace_back(0, 0, 1);
      cloud.radii.push_back(0.5F);
      cloud.colours.push_back({1, 2, 3});
      cloud.confidences.push_back(0.25F);
      cloud.observations.push_back(7);
      cloud.first_frames.push_back(static_cast<std::uint32_t>(100 + i));
    }
    WritePly(folder_ / "model.ply", cloud);
    return folder_ / "model.ply";
  }
};

std::int64_t CountSurfels(const std::vector<SurfelBlock>& blocks) {
  std::int64_t sum = 0;
  for (const SurfelBlock& block : blocks) sum += block.num_surfels();
  return sum;
}

TEST_F(ModelInBlocks, ReadsVerticesByTheirNumber) {
  const PlyVertices vertices(WriteModel(20));
  ASSERT_EQ(vertices.size(), 400);
  const ViewSurfel surfel = vertices.At(45);
  EXPECT_EQ(surfel.point, Eigen::Vector3f(5, 2, std::sin(0.5F)));
  EXPECT_EQ(surfel.normal, Eigen::Vector3f(0, 0, 1));
  EXPECT_EQ(surfel.radius, 0.5F);
  EXPECT_EQ(surfel.colour[2], 3);
  EXPECT_EQ(surfel.confidence, 0.25F);
  EXPECT_EQ(surfel.observations, 7U);
  EXPECT_EQ(surfel.first_frame, 145U);
}

TEST_F(ModelInBlocks, HasEachSurfelOnceInBlocksThatLieApart) {
  const PlyVertices vertices(WriteModel(500));
  const ModelBlocks model(vertices);
  const std::vector<SurfelBlock> blocks = model.All();
  ASSERT_EQ(blocks.size(), 4U);
  EXPECT_EQ(CountSurfels(blocks), 250000);
  double area = 0;
  for (const SurfelBlock& block : blocks) {
    EXPECT_NEAR(static_cast<double>(block.num_surfels()), 62500, 8000);
    area += (block.high.x() - block.low.x()) * (block.high.y() - block.low.y());
  }
  EXPECT_LE(area, 500 * 500) << "they overlap";
  const std::vector<SurfelBlock> preview = model.Preview();
  ASSERT_EQ(preview.size(), 4U);
  EXPECT_GT(CountSurfels(preview), 100000);
  EXPECT_LE(CountSurfels(preview), 250000);
  const std::vector<Eigen::Vector3f> normals = model.Normals();
  EXPECT_EQ(static_cast<std::int64_t>(normals.size()), CountSurfels(preview));
  EXPECT_EQ(normals.back(), Eigen::Vector3f(0, 0, 1));
}

TEST_F(ModelInBlocks, TakesASmallModelAsOneBlock) {
  const PlyVertices vertices(WriteModel(3));
  const std::vector<SurfelBlock> blocks = ModelBlocks(vertices).All();
  ASSERT_EQ(blocks.size(), 1U);
  EXPECT_EQ(blocks[0].num_surfels(), 9);
  ASSERT_TRUE(blocks[0].frames);
  EXPECT_EQ(blocks[0].frames->first, 100U);
  EXPECT_EQ(blocks[0].frames->last, 108U);
}

TEST_F(ModelInBlocks, KnowsHowFarItsSurfelsAreFromTheTruth) {
  const std::filesystem::path path = WriteModel(100);
  const PointCloud model = ReadPly(path);
  const PlyVertices vertices(path);
  EXPECT_EQ(ModelErrors::Beside(path, vertices), nullptr) << "nothing is known";
  std::vector<double> distances_m(model.size());
  for (std::size_t i = 0; i < model.size(); ++i) distances_m[i] = 0.001 * static_cast<double>(i);
  WriteErrorFile(folder_ / kErrorFileName, model, distances_m);
  const auto errors = ModelErrors::Beside(path, vertices);
  ASSERT_NE(errors, nullptr);
  EXPECT_NEAR(errors->largest_m(), 9.8, 0.01) << "one in fifty of 10 m is further off";
  EXPECT_NEAR(errors->ShareAt(4900), 0.5, 0.001);
  EXPECT_EQ(errors->ShareAt(9900), 1);
  const std::vector<SurfelBlock> blocks = ModelBlocks(vertices, errors.get()).All();
  ASSERT_EQ(blocks.size(), 1U);
  double sum = 0;
  for (std::int64_t i = 0; i < blocks[0].num_surfels(); ++i) {
    sum += static_cast<unsigned char>((*blocks[0].surfels)[i * kBytesOfSurfel + 11]);
  }
  // The mean of a rise to 255 that one in fifty stands at.
  EXPECT_NEAR(sum / 10000, 255 * (0.5 * 0.98 + 0.02), 0.1);
}

TEST_F(ModelInBlocks, LeavesTheErrorsOfAnotherModelAlone) {
  const std::filesystem::path path = WriteModel(30);
  PointCloud model = ReadPly(path);
  const std::vector<double> distances_m(model.size(), 0.1);
  const PlyVertices vertices(path);
  model.points[7].x() += 0.01F;
  WriteErrorFile(folder_ / kErrorFileName, model, distances_m);
  EXPECT_EQ(ModelErrors::Beside(path, vertices), nullptr);
  model.points.pop_back();
  WriteErrorFile(folder_ / kErrorFileName, model, distances_m);
  EXPECT_EQ(ModelErrors::Beside(path, vertices), nullptr);
  WriteText(kErrorFileName, "hello");
  EXPECT_EQ(ModelErrors::Beside(path, vertices), nullptr);
}

TEST_F(ModelInBlocks, RefusesWhatIsNoModel) {
  EXPECT_THROW(PlyVertices(folder_ / "absent.ply"), Error);
  EXPECT_THROW(PlyVertices(WriteText("empty.ply", "")), Error);
  EXPECT_THROW(PlyVertices(WriteText("text.ply", "hello")), Error);
  EXPECT_THROW(PlyVertices(WriteText("ascii.ply",
                                     "ply\nformat ascii 1.0\nelement vertex 1\n"
                                     "property float x\nend_header\n1 2 3\n")),
               Error);
  const std::string model = ReadText(WriteModel(3));
  EXPECT_THROW(PlyVertices(WriteText("short.ply", model.substr(0, model.size() - 1))), Error);
  std::string many = model;
  many.replace(many.find("vertex 9"), 8, "vertex 9223372036854775807");
  EXPECT_THROW(PlyVertices(WriteText("many.ply", many)), Error);
}

}  // namespace
}  // namespace mono3d::tools
