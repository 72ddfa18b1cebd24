// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "io/photo_file.h"
#include "mono3d/geo/position_file.h"

namespace mono3d {
namespace {

namespace fs = std::filesystem;

class PhotoPositions : public testing::Test {
 protected:
  PhotoPositions()
      : folder_(fs::path(testing::TempDir()) /
                (std::string("photo_positions_") +
                 testing::UnitTest::GetInstance()->current_test_info()->name())) {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~PhotoPositions() override { fs::remove_all(folder_); }

  std::string Write(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return (folder_ / name).string();
  }

  fs::path folder_;
};

TEST_F(PhotoPositions, AreThoseOfExif) {
  ExifWriter exif;
  exif.Place(-33.5123456, -70.6123456, -12.25).Rational(ExifWriter::Directory::kGps, 0x1F, 35, 10);
  const PositionTrack track = ReadPhotoPositions({Write("a.jpg", JpegPhoto(8, 8, exif.Block()))});
  ASSERT_EQ(track.fixes.size(), 1U);
  EXPECT_EQ(track.clock, PositionClock::kImages);
  EXPECT_EQ(track.fixes[0].image, "a.jpg");
  constexpr double kStep_deg = 1e-4 / 3600;
  EXPECT_NEAR(track.fixes[0].latitude_deg, -33.5123456, kStep_deg);
  EXPECT_NEAR(track.fixes[0].longitude_deg, -70.6123456, kStep_deg);
  EXPECT_NEAR(track.fixes[0].altitude_m.value(), -12.25, 1e-9);
  EXPECT_EQ(track.fixes[0].sigma_horizontal_m, 3.5);
  EXPECT_LT(track.resolution_m, 0.02);
}

TEST_F(PhotoPositions, AreThoseOfXmpWhereThereAreBoth) {
  ExifWriter exif;
  exif.Place(46.8, 8.2, 500);
  const std::string xmp = DjiPacket(
      "drone-dji:GpsLatitude=\"46.80001234\" drone-dji:GpsLongtitude=\"8.20005678\" "
      "drone-dji:AbsoluteAltitude=\"+501.25\" drone-dji:RelativeAltitude=\"+39.80\" "
      "drone-dji:GimbalRollDegree=\"+0.10\" drone-dji:GimbalYawDegree=\"-75.3\" "
      "drone-dji:GimbalPitchDegree=\"-89.9\" drone-dji:RtkStdLon=\"0.03\" "
      "drone-dji:RtkStdLat=\"0.04\" drone-dji:RtkStdHgt=\"0.07\"");
  const PositionTrack track =
      ReadPhotoPositions({Write("a.jpg", JpegPhoto(8, 8, exif.Block(), xmp))});
  ASSERT_EQ(track.fixes.size(), 1U);
  const PositionFix& fix = track.fixes[0];
  EXPECT_EQ(fix.latitude_deg, 46.80001234);
  EXPECT_EQ(fix.longitude_deg, 8.20005678);
  EXPECT_EQ(fix.altitude_m, 501.25);
  EXPECT_EQ(fix.height_m, 39.8);
  ASSERT_TRUE(fix.gimbal.has_value());
  EXPECT_EQ(fix.gimbal->yaw_deg, -75.3);
  EXPECT_EQ(fix.gimbal->pitch_deg, -89.9);
  EXPECT_NEAR(fix.sigma_horizontal_m, 0.0354, 1e-4);
  EXPECT_EQ(fix.sigma_vertical_m, 0.07);
}

TEST_F(PhotoPositions, HaveTheTimesOfTheirPhotos) {
  const auto photo = [&](const std::string& name, const std::string& taken,
                         const std::string& fraction, const std::string& zone) {
    using enum ExifWriter::Directory;
    ExifWriter exif;
    exif.Place(46.8, 8.2, 500).Ascii(kExif, 0x9003, taken);
    if (!fraction.empty()) exif.Ascii(kExif, 0x9291, fraction);
    if (!zone.empty()) exif.Ascii(kExif, 0x9011, zone);
    return Write(name, JpegPhoto(8, 8, exif.Block()));
  };
  constexpr double kNoon_s = 1466683200;  // 2016-06-23 12:00:00 UTC
  const std::string a = photo("a.jpg", "2016:06:23 12:00:00", "25", "+02:00");
  const std::string b = photo("b.jpg", "2016:06:23 13:30:01", "", "+02:00");
  const PositionTrack utc = ReadPhotoPositions({a, b});
  ASSERT_EQ(utc.fixes.size(), 2U);
  EXPECT_TRUE(utc.has_image_times);
  EXPECT_EQ(utc.fixes[0].time_s, kNoon_s - 7200 + 0.25);
  EXPECT_EQ(utc.fixes[1].time_s, kNoon_s - 1800 + 1);

  // Of another camera, which tells no offset from UTC: all by the clocks of their cameras.
  const std::string c = photo("c.jpg", "2016:06:23 12:00:02", "no number", "");
  const PositionTrack local = ReadPhotoPositions({a, c});
  EXPECT_TRUE(local.has_image_times);
  EXPECT_EQ(local.fixes[0].time_s, kNoon_s + 0.25);
  EXPECT_EQ(local.fixes[1].time_s, kNoon_s + 2);

  const std::string d = photo("d.jpg", "0000:00:00 00:00:00", "", "");
  const PositionTrack some = ReadPhotoPositions({a, d});
  EXPECT_FALSE(some.has_image_times);
  EXPECT_EQ(some.fixes[0].time_s, 0);
}

TEST_F(PhotoPositions, AreEmptyWhereNoPhotoHasAny) {
  ExifWriter camera_alone;
  camera_alone.Camera("Maker", "Model");
  ExifWriter without_fix;
  without_fix.Place(0, 0, 0);
  const std::vector<std::string> images = {Write("a.jpg", JpegPhoto(8, 8, camera_alone.Block())),
                                           Write("b.jpg", JpegPhoto(8, 8, without_fix.Block())),
                                           Write("c.jpg", "no image"),
                                           (folder_ / "missing.jpg").string()};
  EXPECT_TRUE(ReadPhotoPositions(images).fixes.empty());
  EXPECT_TRUE(ReadPhotoPositions({}).fixes.empty());
}

}  // namespace
}  // namespace mono3d
