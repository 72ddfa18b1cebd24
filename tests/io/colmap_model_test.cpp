// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/io/colmap_model.h"

#include <gmock/gmock.h>

#include <cstdint>
#include <cstring>
#include <string>

#include "io/temporary_folder.h"
#include "mono3d/core/error.h"
#include "mono3d/io/any_trajectory_file.h"

namespace mono3d {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

// The tests write their folders below the temporary one.
using ColmapModel = TemporaryFolderTest;

SparseModel SmallModel() {
  SparseModel model;
  model.camera = {.width = 80, .height = 60, .fx = 100.5, .fy = 101, .cx = 39.5, .cy = 29.25};
  model.points = {{{0.1, 0, 2}, {1, 2, 3}}, {{-0.3, 0.2, 1.7}, {255, 0, 128}}};
  const Pose T_world_b(RotationExp({0.1, -0.2, 0.05}), {1, 0.5, -0.1});
  model.images.push_back({0, "a.png", Pose(), {{{44, 29.5}, 0}, {{1, 1}, std::nullopt}}});
  model.images.push_back({7, "folder/b 1.png", T_world_b, {{{-10.5, 33}, 0}, {{2.5, 3.25}, 1}}});
  model.images.push_back({8, "c.png", T_world_b, {}});
  return model;
}

void ExpectSame(const SparseModel& a, const SparseModel& b) {
  constexpr double kRounding = 1e-12;  // of turning poses around
  EXPECT_EQ(a.camera, b.camera);
  ASSERT_EQ(a.points.size(), b.points.size());
  for (std::size_t i = 0; i < a.points.size(); ++i) {
    EXPECT_EQ(a.points[i].p_world, b.points[i].p_world);
    EXPECT_EQ(a.points[i].colour, b.points[i].colour);
  }
  ASSERT_EQ(a.images.size(), b.images.size());
  for (std::size_t i = 0; i < a.images.size(); ++i) {
    EXPECT_EQ(a.images[i].id, b.images[i].id);
    EXPECT_EQ(a.images[i].name, b.images[i].name);
    EXPECT_LT((a.images[i].T_world_cam.Matrix() - b.images[i].T_world_cam.Matrix()).norm(),
              kRounding);
    ASSERT_EQ(a.images[i].observations.size(), b.images[i].observations.size());
    for (std::size_t k = 0; k < a.images[i].observations.size(); ++k) {
      EXPECT_EQ(a.images[i].observations[k].pixel, b.images[i].observations[k].pixel);
      EXPECT_EQ(a.images[i].observations[k].point, b.images[i].observations[k].point);
    }
  }
}

TEST_F(ColmapModel, KeepsAFisheyeLens) {
  SparseModel model = SmallModel();
  model.camera.lens = LensModel::kFisheye;
  for (const std::array<double, 5>& distortion :
       {std::array<double, 5>{}, {-0.1, 0.02, 0.001, -0.002, 0}}) {
    model.camera.distortion = distortion;
    WriteColmapModel(folder_ / "sparse", model);
    ExpectSame(ReadColmapModel(folder_ / "sparse"), model);
  }
}

TEST_F(ColmapModel, SurvivesWritingAndReading) {
  SparseModel model = SmallModel();
  for (const std::array<double, 5>& distortion :
       {std::array<double, 5>{}, {-0.1, 0.02, 0.001, -0.002, 0}, {-0.1, 0.02, 0.001, 0, 0.5}}) {
    model.camera.distortion = distortion;
    WriteColmapModel(folder_ / "sparse", model);
    ExpectSame(ReadColmapModel(folder_ / "sparse"), model);
  }
}

TEST_F(ColmapModel, KeepsTheCamerasOfSeveral) {
  SparseModel model = SmallModel();
  CameraModel second = model.camera;
  second.width = 120;
  second.fx = 150;
  second.distortion = {-0.1, 0.02, 0.001, -0.002, 0};
  model.further_cameras = {second};
  model.images[1].camera = 1;
  WriteColmapModel(folder_ / "sparse", model);
  const SparseModel read = ReadColmapModel(folder_ / "sparse");
  ExpectSame(model, read);
  EXPECT_EQ(read.further_cameras, model.further_cameras);
  EXPECT_EQ(read.images[0].camera, 0U);
  EXPECT_EQ(read.CameraOf(read.images[1]), second);
  model.images[1].camera = 2;
  EXPECT_THROW(WriteColmapModel(folder_ / "sparse", model), Error);
}

TEST_F(ColmapModel, IsWrittenInColmapsFormAndPixels) {
  WriteColmapModel(folder_, SmallModel());
  EXPECT_THAT(ReadText(folder_ / "cameras.txt"),
              HasSubstr("\n1 PINHOLE 80 60 100.5 101 40 29.75\n"));
  const std::string images = ReadText(folder_ / "images.txt");
  EXPECT_THAT(images, HasSubstr("\n1 1 0 0 0 0 0 0 1 a.png\n44.5 30 1 1.5 1.5 -1\n8 "));
  EXPECT_THAT(images, HasSubstr(" 1 c.png\n\n"));
  // The image of id 7 shows point 0 first, point 1 second; errors of a: 44.525 - 44 and 0.25.
  EXPECT_THAT(ReadText(folder_ / "points3D.txt"), HasSubstr(" 255 0 128 "));
  EXPECT_THAT(ReadText(folder_ / "points3D.txt"), HasSubstr(" 1 0 8 0\n2 "));
  EXPECT_THAT(ReadText(folder_ / "points3D.txt"), HasSubstr(" 8 1\n"));
}

// Values at their places of https://colmap.github.io/format.html#binary-file-format.
template <typename T>
T ValueAt(const std::string& bytes, std::size_t& position) {
  T value{};
  EXPECT_LE(position + sizeof value, bytes.size());
  std::memcpy(&value, bytes.data() + position, sizeof value);
  position += sizeof value;
  return value;
}

TEST_F(ColmapModel, IsWrittenInColmapsBinaryFormToo) {
  SparseModel model = SmallModel();
  model.camera.distortion = {-0.1, 0.02, 0.001, -0.002, 0.5};
  WriteColmapModel(folder_, model);

  const std::string cameras = ReadText(folder_ / "cameras.bin");
  std::size_t at = 0;
  EXPECT_EQ(ValueAt<std::uint64_t>(cameras, at), 1U);
  EXPECT_EQ(ValueAt<std::uint32_t>(cameras, at), 1U);
  EXPECT_EQ(ValueAt<std::int32_t>(cameras, at), 6) << "FULL_OPENCV";
  EXPECT_EQ(ValueAt<std::uint64_t>(cameras, at), 80U);
  EXPECT_EQ(ValueAt<std::uint64_t>(cameras, at), 60U);
  for (const double param : {100.5, 101., 40., 29.75, -0.1, 0.02, 0.001, -0.002, 0.5, 0., 0., 0.}) {
    EXPECT_EQ(ValueAt<double>(cameras, at), param);
  }
  EXPECT_EQ(at, cameras.size());

  const std::string images = ReadText(folder_ / "images.bin");
  at = 0;
  EXPECT_EQ(ValueAt<std::uint64_t>(images, at), 3U);
  EXPECT_EQ(ValueAt<std::uint32_t>(images, at), 1U);
  for (const double value : {1, 0, 0, 0, 0, 0, 0}) EXPECT_EQ(ValueAt<double>(images, at), value);
  EXPECT_EQ(ValueAt<std::uint32_t>(images, at), 1U) << "its camera";
  EXPECT_EQ(images.substr(at, 6), std::string("a.png\0", 6));
  at += 6;
  EXPECT_EQ(ValueAt<std::uint64_t>(images, at), 2U);
  EXPECT_EQ(ValueAt<double>(images, at), 44.5);
  EXPECT_EQ(ValueAt<double>(images, at), 30);
  EXPECT_EQ(ValueAt<std::uint64_t>(images, at), 1U);
  at += 2 * sizeof(double);
  EXPECT_EQ(ValueAt<std::uint64_t>(images, at), ~std::uint64_t{0}) << "no point";
  EXPECT_EQ(ValueAt<std::uint32_t>(images, at), 8U);
  const Pose T_cam_world = model.images[1].T_world_cam.Inverse();
  EXPECT_EQ(ValueAt<double>(images, at), T_cam_world.rotation().w());
  at += 3 * sizeof(double);
  EXPECT_EQ(ValueAt<double>(images, at), T_cam_world.translation().x());

  const std::string points = ReadText(folder_ / "points3D.bin");
  at = 0;
  EXPECT_EQ(ValueAt<std::uint64_t>(points, at), 2U);
  EXPECT_EQ(ValueAt<std::uint64_t>(points, at), 1U);
  for (const double value : {0.1, 0., 2.}) EXPECT_EQ(ValueAt<double>(points, at), value);
  EXPECT_EQ(points.substr(at, 3), "\x01\x02\x03");
  at += 3;
  EXPECT_EQ(ValueAt<double>(points, at), ReprojectionErrors_px(model)[0]);
  EXPECT_EQ(ValueAt<std::uint64_t>(points, at), 2U);
  for (const std::uint32_t value : {1U, 0U, 8U, 0U, 2U}) {
    EXPECT_EQ(ValueAt<std::uint32_t>(points, at), value);  // the last one: the next id, lower half
  }
  at = points.size() - 2 * sizeof(std::uint32_t);
  EXPECT_EQ(ValueAt<std::uint32_t>(points, at), 8U);
  EXPECT_EQ(ValueAt<std::uint32_t>(points, at), 1U);
}

TEST_F(ColmapModel, IsATrajectoryToo) {
  SparseModel model = SmallModel();
  model.images[0].name = "frame_000030.png";
  model.images.resize(1);
  WriteColmapModel(folder_, model);
  const auto poses = ReadAnyTrajectory(folder_ / "images.txt");
  ASSERT_EQ(poses.size(), 1U);
  EXPECT_EQ(poses[0].timestamp_s, 1);
}

TEST_F(ColmapModel, IsRefusedWithFileAndLineWhenBroken) {
  const auto read = [&] { static_cast<void>(ReadColmapModel(folder_)); };
  EXPECT_THAT(read, ThrowsMessage<Error>(HasSubstr("cameras.txt: there is no such file")));
  WriteText("cameras.txt", "# none\n");
  EXPECT_THAT(read, ThrowsMessage<Error>(HasSubstr("cameras.txt: no camera in the file")));
  WriteText("cameras.txt", "1 PINHOLE 80 60 100 100 40 30\n");
  WriteText("points3D.txt", "1 0 0 2 1 2 3\n");
  EXPECT_THAT(read, ThrowsMessage<Error>(HasSubstr("points3D.txt:1: bad line of a point")));
  WriteText("points3D.txt", "1 0 0 2 1 2 3 0.5\n1 0 0 2 1 2 3 0.5\n");
  EXPECT_THAT(read, ThrowsMessage<Error>(HasSubstr("an id twice")));
  WriteText("points3D.txt", "5 0 0 2 1 2 3 0.5 1 0\n");
  WriteText("images.txt", "1 1 0 0 0 0 0 0 1 a.png\n10 20 6\n");
  EXPECT_THAT(read, ThrowsMessage<Error>(HasSubstr("images.txt:1: image shows a point that")));
  WriteText("images.txt", "1 1 0 0 0 0 0 0 1 a.png\n10 x 5\n");
  EXPECT_THAT(read, ThrowsMessage<Error>(HasSubstr("images.txt:2: bad point behind an image")));
  WriteText("images.txt", "1 1 0 0 0 0 0 0 1 a.png\n10 20 5\n");
  EXPECT_NO_THROW(read());
}

TEST_F(ColmapModel, ThatContradictsItselfIsNotWritten) {
  SparseModel model = SmallModel();
  model.images[0].observations[0].point = 99;
  EXPECT_THROW(WriteColmapModel(folder_ / "sparse", model), Error);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "sparse" / "images.txt"));
}

}  // namespace
}  // namespace mono3d
