// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "mono3d/core/error.h"
#include "mono3d/geo/position_file.h"

namespace mono3d {
namespace {

// One of each form.
const std::vector<std::string>& WholeFiles() {
  static const std::vector<std::string> kFiles = {
      "1\n00:00:00,000 --> 00:00:00,033\n<font size=\"36\">SrtCnt : 1, DiffTime : 33ms\n"
      "2022-08-07 13:40:40,774,808\n[iso : 100] [latitude: 41.424724] [longtitude: 2.234156] "
      "[rel_alt: -2.400 abs_alt: 0.401] [gb_yaw: 12.5 gb_pitch: -90.0 gb_roll: 0.1] </font>\n\n",
      "1\n00:00:01,000 --> 00:00:02,000\nHOME(149.0251,-20.2532) 2017.08.05 14:11:51\n"
      "GPS(149.0251,-20.2533,16) BAROMETER:1.9\nISO:100 Shutter:60 EV: Fnum:2.2\n\n"
      "2\n00:00:02,000 --> 00:00:03,000\nF/5.6, SS 400, GPS (-58.851745, -34.237922, 15), H "
      "85.80m, "
      "G.PRY (-24.4\xC2\xB0, 0.5\xC2\xB0, 110.4\xC2\xB0)\n",
      "<gpx><trk><trkseg><trkpt lat=\"47.644548\" lon=\"-122.326897\"><ele>4.46</ele>"
      "<time>2009-10-17T18:37:26Z</time></trkpt></trkseg></trk></gpx>",
      "$GPRMC,123519,A,4807.038,N,01131.000,E,022.4,084.4,230314,003.1,W*62\r\n"
      "$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,\r\n"
      "$GPGST,123519,1.2,2,1,0,3.0,4.0,5.0\r\n",
      "time;Latitude;Longitude;Altitude\n1,5;47,1;8,2;400\n2;47;\"8\";4\n",
      "EPSG:4326\nDJI_0028.JPG -91.99 46.84 198.609 0 0 0 .5 1.5\n",
      "# origin (WGS 84 latitude_deg longitude_deg altitude_m) 0 20 100\n3.5 0 1 50\n4 0 2 50\n"};
  return kFiles;
}

std::string Damaged(std::string text, std::mt19937& random) {
  const auto below = [&](std::size_t end) {
    return std::uniform_int_distribution<std::size_t>(0, end - 1)(random);
  };
  const std::size_t num_damages = 1 + below(4);
  for (std::size_t i = 0; i < num_damages && !text.empty(); ++i) {
    const std::size_t at = below(text.size());
    switch (below(5)) {
      case 0:
        text[at] = static_cast<char>(below(256));
        break;
      case 1:
        text.resize(at);
        break;
      case 2:
        text.erase(at, 1 + below(8));
        break;
      case 3:
        text.insert(at, text.substr(below(text.size()), 1 + below(40)));
        break;
      default:
        text.insert(at, std::vector<std::string>{"9999999999999999999", "-1e308", "nan", "(", "[",
                                                 ",,,,", "\n\n", "-->"}[below(8)]);
    }
  }
  return text;
}

// MONO3D_DAMAGED_FILES: how many of each form; they are read, or refused by an Error.
TEST(DamagedPositionFile, IsReadAsFarAsItIsWholeOrRefused) {
  const char* told = std::getenv("MONO3D_DAMAGED_FILES");
  const int count = told != nullptr ? std::atoi(told) : 100;
  const std::filesystem::path path =
      std::filesystem::path(testing::TempDir()) / "damaged_positions";
  std::mt19937 random(1);
  int num_read = 0;
  for (const std::string& whole : WholeFiles()) {
    for (int i = 0; i < count; ++i) {
      std::ofstream(path, std::ios::binary) << Damaged(whole, random);
      try {
        const PositionTrack track = ReadPositionFile(path);
        ++num_read;
        for (const PositionFix& fix : track.fixes) {
          ASSERT_TRUE(std::isfinite(fix.time_s) && std::abs(fix.latitude_deg) <= 90 &&
                      std::abs(fix.longitude_deg) <= 180);
        }
      } catch (const Error& error) {
        ASSERT_EQ(std::string(error.what()).find('\n'), std::string::npos);
      }
    }
  }
  std::filesystem::remove(path);
  EXPECT_GT(num_read, count);
}

}  // namespace
}  // namespace mono3d
