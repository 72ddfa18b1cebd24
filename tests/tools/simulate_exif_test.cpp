// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// What mono3d-simulate notes in its pictures.

#include <gtest/gtest.h>
#include <libexif/exif-data.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

#include "mono3d/core/error.h"
#include "simulate/exif.h"
#include "synthetic/gps.h"
#include "tools/command.h"

namespace mono3d {
namespace {

using ExifPtr = std::unique_ptr<ExifData, decltype(&exif_data_unref)>;

double Rational(ExifData* data, ExifIfd ifd, int tag, int index) {
  const ExifEntry* entry = exif_content_get_entry(data->ifd[ifd], static_cast<ExifTag>(tag));
  if (entry == nullptr) return -1;
  const ExifRational value =
      exif_get_rational(entry->data + 8 * index, exif_data_get_byte_order(data));
  return static_cast<double>(value.numerator) / value.denominator;
}

std::string Ascii(ExifData* data, ExifIfd ifd, int tag) {
  const ExifEntry* entry = exif_content_get_entry(data->ifd[ifd], static_cast<ExifTag>(tag));
  return entry == nullptr ? "" : reinterpret_cast<const char*>(entry->data);
}

double Degrees(ExifData* data, int tag) {
  return Rational(data, EXIF_IFD_GPS, tag, 0) + Rational(data, EXIF_IFD_GPS, tag, 1) / 60 +
         Rational(data, EXIF_IFD_GPS, tag, 2) / 3600;
}

TEST(SimulateExif, PositionsEqualThoseOfTheGpsFile) {
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / "mono3d_simulate_exif";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  const CommandResult result =
      RunCommand(std::string(MONO3D_SIMULATE_TOOL) +
                     " --camera.width 64 --camera.height 48 --flight.duration_s 8 --fps 0.5"
                     " --jpeg-quality 90 --gps.latitude_deg -33.5 --gps.longitude_deg -70.6 -o " +
                     (folder / "a").string(),
                 folder);
  ASSERT_EQ(result.exit_status, 0) << result.errors;
  std::ifstream gps(folder / "a/gps.txt");
  std::string line;
  int frame = 0;
  while (std::getline(gps, line)) {
    if (line.starts_with("#")) continue;
    double t_s = 0;
    Eigen::Vector3d p_enu;
    ASSERT_EQ(
        std::sscanf(line.c_str(), "%lf %lf %lf %lf", &t_s, &p_enu.x(), &p_enu.y(), &p_enu.z()), 4);
    const auto image = folder / "a/images" / ("00000" + std::to_string(frame) + ".jpg");
    const ExifPtr data(exif_data_new_from_file(image.c_str()), &exif_data_unref);
    ASSERT_TRUE(data) << image;
    EXPECT_EQ(Ascii(data.get(), EXIF_IFD_GPS, EXIF_TAG_GPS_LATITUDE_REF), "S");
    EXPECT_EQ(Ascii(data.get(), EXIF_IFD_GPS, EXIF_TAG_GPS_LONGITUDE_REF), "W");
    const Geodetic place{-Degrees(data.get(), EXIF_TAG_GPS_LATITUDE),
                         -Degrees(data.get(), EXIF_TAG_GPS_LONGITUDE),
                         Rational(data.get(), EXIF_IFD_GPS, EXIF_TAG_GPS_ALTITUDE, 0)};
    // A millionth of a second of arc is 3e-5 m, the file has 1e-4 m.
    constexpr double kTolerance_m = 3e-4;
    EXPECT_LT((ToEnu(place, {-33.5, -70.6, 115}) - p_enu).norm(), kTolerance_m);
    EXPECT_NEAR(Rational(data.get(), EXIF_IFD_GPS, EXIF_TAG_GPS_TIME_STAMP, 2), t_s, 5e-4);
    ++frame;
  }
  EXPECT_GE(frame, 4);
  std::filesystem::remove_all(folder);
}

TEST(SimulateExif, TellsTheFocalLengthAndTheTime) {
  const std::string jpeg = tools::WithExif(
      "\xFF\xD8\xFF\xD9",
      {.timestamp_s = 3661.25, .width = 768, .height = 448, .focal_px = 691.2, .place = {}});
  EXPECT_EQ(jpeg.substr(jpeg.size() - 2), "\xFF\xD9");
  const ExifPtr data(exif_data_new_from_data(reinterpret_cast<const unsigned char*>(jpeg.data()),
                                             static_cast<unsigned int>(jpeg.size())),
                     &exif_data_unref);
  ASSERT_TRUE(data);
  // 691.2 px of 768 px on 36 mm.
  EXPECT_NEAR(Rational(data.get(), EXIF_IFD_EXIF, EXIF_TAG_FOCAL_LENGTH, 0), 32.4, 1e-4);
  EXPECT_EQ(Ascii(data.get(), EXIF_IFD_EXIF, EXIF_TAG_DATE_TIME_ORIGINAL), "2025:06:21 11:01:01");
  EXPECT_EQ(Ascii(data.get(), EXIF_IFD_EXIF, EXIF_TAG_SUB_SEC_TIME_ORIGINAL), "250");
  EXPECT_EQ(Ascii(data.get(), EXIF_IFD_GPS, EXIF_TAG_GPS_LATITUDE_REF), "") << "no place given";
}

TEST(SimulateExif, RefusesWhatIsNoJpeg) { EXPECT_THROW(tools::WithExif("PNG", {}), Error); }

}  // namespace
}  // namespace mono3d
