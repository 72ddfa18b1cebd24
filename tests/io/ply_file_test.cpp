// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/io/ply_file.h"

#include <gmock/gmock.h>

#include <string>

#include "io/temporary_folder.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::ThrowsMessage;

using PlyFile = TemporaryFolderTest;

PointCloud FullCloud(std::size_t size) {
  PointCloud cloud;
  for (std::size_t i = 0; i < size; ++i) {
    const auto t = static_cast<float>(i);
    cloud.points.emplace_back(t / 3, -t, 1e-9F * t);
    cloud.normals.emplace_back(0, 0.6F, -0.8F);
    cloud.colours.push_back({static_cast<std::uint8_t>(i), 128, 255});
    cloud.radii.push_back(0.01F * t);
    cloud.confidences.push_back(1 / (1 + t));
    cloud.observations.push_back(static_cast<std::uint32_t>(4294967295U - i));
  }
  return cloud;
}

void ExpectEqual(const PointCloud& a, const PointCloud& b) {
  EXPECT_EQ(a.points, b.points);
  EXPECT_EQ(a.normals, b.normals);
  EXPECT_EQ(a.colours, b.colours);
  EXPECT_EQ(a.radii, b.radii);
  EXPECT_EQ(a.confidences, b.confidences);
  EXPECT_EQ(a.observations, b.observations);
  EXPECT_EQ(a.inferred, b.inferred);
  EXPECT_EQ(a.first_frames, b.first_frames);
}

TEST_F(PlyFile, TellsWhatIsInferred) {
  PointCloud cloud = FullCloud(5);
  cloud.inferred = {0, 0, 1, 0, 1};
  WritePly(folder_ / "a.ply", cloud);
  EXPECT_THAT(ReadText(folder_ / "a.ply"),
              HasSubstr("property uint observations\nproperty uchar inferred\nend_header\n"));
  const PointCloud read = ReadPly(folder_ / "a.ply");
  ExpectEqual(read, cloud);
  EXPECT_EQ(InferredPoints(read).size(), 2U);
  EXPECT_EQ(InferredPoints(read).radii[1], cloud.radii[4]);
  EXPECT_EQ(MatchedPoints(read).observations[2], cloud.observations[3]);
  EXPECT_TRUE(MatchedPoints(read).inferred.empty());
}

TEST_F(PlyFile, TellsWhichFrameSawAPointFirst) {
  PointCloud cloud = FullCloud(3);
  cloud.inferred = {0, 1, 0};
  cloud.first_frames = {7, 4000000000U, 0};
  WritePly(folder_ / "a.ply", cloud);
  EXPECT_THAT(ReadText(folder_ / "a.ply"),
              HasSubstr("property uchar inferred\nproperty uint first_frame\nend_header\n"));
  const PointCloud read = ReadPly(folder_ / "a.ply");
  ExpectEqual(read, cloud);
  EXPECT_EQ(InferredPoints(read).first_frames, std::vector<std::uint32_t>{4000000000U});
  EXPECT_EQ(MatchedPoints(read).first_frames, (std::vector<std::uint32_t>{7, 0}));
  cloud.first_frames.pop_back();
  EXPECT_THROW(WritePly(folder_ / "a.ply", cloud), Error);
}

TEST_F(PlyFile, HasTheHeaderOfItsDescription) {
  WritePly(folder_ / "a.ply", FullCloud(2));
  const std::string header =
      "ply\nformat binary_little_endian 1.0\nelement vertex 2\n"
      "property float x\nproperty float y\nproperty float z\n"
      "property float nx\nproperty float ny\nproperty float nz\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\n"
      "property float radius\nproperty float confidence\nproperty uint observations\n"
      "end_header\n";
  const std::string text = ReadText(folder_ / "a.ply");
  EXPECT_EQ(text.substr(0, header.size()), header);
  constexpr std::size_t kVertexBytes = 6 * 4 + 3 + 2 * 4 + 4;
  EXPECT_EQ(text.size(), header.size() + 2 * kVertexBytes);
}

// The larger cloud takes several blocks of the writer.
TEST_F(PlyFile, SurvivesWritingAndReading) {
  for (const std::size_t size : {std::size_t{1}, std::size_t{100000}}) {
    const PointCloud cloud = FullCloud(size);
    WritePly(folder_ / "a.ply", cloud);
    ExpectEqual(ReadPly(folder_ / "a.ply"), cloud);
  }
}

TEST_F(PlyFile, HasOnlyThePropertiesOfTheCloud) {
  PointCloud cloud;
  cloud.points = {{1, 2, 3}, {4, 5, 6}};
  cloud.radii = {1, 2};
  WritePly(folder_ / "a.ply", cloud);
  EXPECT_THAT(ReadText(folder_ / "a.ply"), Not(HasSubstr("red")));
  ExpectEqual(ReadPly(folder_ / "a.ply"), cloud);
}

TEST_F(PlyFile, MayBeEmpty) {
  WritePly(folder_ / "a.ply", {});
  EXPECT_THAT(ReadPly(folder_ / "a.ply").points, IsEmpty());
}

TEST_F(PlyFile, ReadsOtherTypesAndSkipsWhatItDoesNotKnow) {
  std::string text =
      "ply\r\nformat binary_little_endian 1.0\r\ncomment by hand\r\nelement vertex 1\r\n"
      "property int16 z\r\nproperty double x\r\nproperty uchar label\r\nproperty int8 y\r\n"
      "property int red\r\nproperty int green\r\nproperty int blue\r\n"
      "element face 1\r\nproperty list uchar int vertex_indices\r\nend_header\r\n";
  text += std::string("\xFE\xFF", 2);                    // z = -2
  text += std::string("\0\0\0\0\0\0\xF8\x3F", 8);        // x = 1.5
  text += "\x07\x05";                                    // label, y = 5
  text += std::string("\xFF\xFF\xFF\xFF\x07\0\0\0", 8);  // red = -1, green = 7
  text += std::string("\0\x10\0\0", 4);                  // blue = 4096
  text += std::string("\x01\0\0\0\0", 5);                // the face
  const PointCloud cloud = ReadPly(WriteText("a.ply", text));
  ASSERT_EQ(cloud.size(), 1U);
  EXPECT_EQ(cloud.points[0], Eigen::Vector3f(1.5F, 5, -2));
  EXPECT_EQ(cloud.colours[0], (std::array<std::uint8_t, 3>{0, 7, 255}));
  EXPECT_THAT(cloud.normals, IsEmpty());
}

TEST_F(PlyFile, RefusesOtherFiles) {
  const std::string begin = "ply\nformat binary_little_endian 1.0\n";
  const std::pair<std::string, const char*> cases[] = {
      {"", "a.ply:1: bad PLY header"},
      {"solid cube\n", "a.ply:1: bad PLY header (expected ply, found solid cube)"},
      {"ply\nformat ascii 1.0\n",
       "a.ply:2: bad PLY header (expected format binary_little_endian 1.0, found format ascii"},
      {begin + "element face 1\n", "a.ply:3: bad PLY header (expected element vertex COUNT"},
      {begin + "element vertex -1\n", "expected element vertex COUNT"},
      {begin + "element vertex 1\nproperty list uchar int x\n", "a property of a scalar type"},
      {begin + "element vertex 1\nend_header\n", "expected a vertex with properties"},
      {begin + "element vertex 1\nproperty float x\nend_header\nabcd", "no positions"},
      {begin + "element vertex 99999999999\nproperty char x\nproperty char y\nproperty char z\n"
               "end_header\nabcd",
       "file ends too early (expected 99999999999 vertices, found 1)"}};
  for (const auto& [text, message] : cases) {
    EXPECT_THAT([&] { ReadPly(WriteText("a.ply", text)); },
                ThrowsMessage<Error>(HasSubstr(message)));
  }
}

TEST_F(PlyFile, RefusesListsOfDifferentLength) {
  PointCloud cloud = FullCloud(3);
  cloud.radii.pop_back();
  EXPECT_THAT([&] { WritePly(folder_ / "a.ply", cloud); },
              ThrowsMessage<Error>(
                  HasSubstr("a.ply: wrong number of radii in the cloud (expected 3, found 2)")));
}

}  // namespace
}  // namespace mono3d
