// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geo/position_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "mono3d/core/error.h"

namespace mono3d {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

class PositionFile : public testing::Test {
 protected:
  PositionFile()
      : folder_(fs::path(testing::TempDir()) /
                (std::string("positions_") +
                 testing::UnitTest::GetInstance()->current_test_info()->name())) {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~PositionFile() override { fs::remove_all(folder_); }

  fs::path Write(const std::string& name, const std::string& text) const {
    const fs::path path = folder_ / name;
    std::ofstream(path, std::ios::binary) << text;
    return path;
  }

  PositionTrack Read(const std::string& text) const {
    return ReadPositionFile(Write("track", text));
  }

  std::string ErrorOf(const std::string& text) const {
    try {
      Read(text);
    } catch (const Error& error) {
      return error.what();
    }
    return "no error";
  }

  fs::path folder_;
};

TEST_F(PositionFile, ReadsTelemetryInBrackets) {
  const PositionTrack track = Read(
      "1\n00:00:00,000 --> 00:00:00,033\n<font size=\"36\">SrtCnt : 1, DiffTime : 33ms\n"
      "2022-08-07 13:40:40,774,808\n[iso : 100] [shutter : 1/80.0] [fnum : 280] [ev : 0] "
      "[focal_len : 240] [latitude: 41.424724] [longitude: 2.234156] [altitude: 117.000000] "
      "</font>\n\n"
      "2\n00:00:01,033 --> 00:00:01,066\n<font size=\"28\">FrameCnt: 2\n2022-08-07 13:40:41.8\n"
      "[latitude : -3.5] [longtitude : -123.25] [rel_alt: -2.400 abs_alt: 0.401] "
      "[gb_yaw: 12.5 gb_pitch: -90.0 gb_roll: 0.1] </font>\n");
  ASSERT_EQ(track.fixes.size(), 2U);
  EXPECT_EQ(track.clock, PositionClock::kVideo);
  EXPECT_EQ(track.fixes[0].latitude_deg, 41.424724);
  EXPECT_EQ(track.fixes[0].longitude_deg, 2.234156);
  EXPECT_EQ(track.fixes[0].altitude_m, 117);
  EXPECT_FALSE(track.fixes[0].height_m.has_value());
  EXPECT_EQ(track.fixes[0].line, 1U);
  EXPECT_EQ(track.fixes[1].time_s, 1.033);
  EXPECT_EQ(track.fixes[1].longitude_deg, -123.25);
  EXPECT_EQ(track.fixes[1].altitude_m, 0.401);
  EXPECT_EQ(track.fixes[1].height_m, -2.4);
  ASSERT_TRUE(track.fixes[1].gimbal.has_value());
  EXPECT_EQ(track.fixes[1].gimbal->yaw_deg, 12.5);
  EXPECT_EQ(track.fixes[1].gimbal->pitch_deg, -90);
  EXPECT_EQ(track.fixes[1].gimbal->roll_deg, 0.1);
  EXPECT_NEAR(track.resolution_m, 0.11, 0.01);
}

// The third number is that of the satellites.
TEST_F(PositionFile, ReadsTelemetryOfTheMavicPro) {
  const PositionTrack track = Read(
      "1\n00:00:01,000 --> 00:00:02,000\nHOME(149.0251,-20.2532) 2017.08.05 14:11:51\n"
      "GPS(149.0251,-20.2533,16) BAROMETER:1.9\nISO:100 Shutter:60 EV: Fnum:2.2\n\n"
      "2\n00:00:02,000 --> 00:00:03,000\nHOME(149.0251,-20.2532) 2017.8.5 14:11:52\n"
      "GPS(149.0252,-20.2533,16) Hb:2.5 Hs:1.9\nISO:100 TV:60 EV: 0 IR:F2.8\n");
  ASSERT_EQ(track.fixes.size(), 2U);
  EXPECT_EQ(track.fixes[0].latitude_deg, -20.2533);
  EXPECT_EQ(track.fixes[0].longitude_deg, 149.0251);
  EXPECT_FALSE(track.fixes[0].altitude_m.has_value());
  EXPECT_EQ(track.fixes[0].height_m, 1.9);
  EXPECT_EQ(track.fixes[1].height_m, 2.5);
  EXPECT_NEAR(track.resolution_m, 11.1, 0.1);
}

// Speeds that it does not know are "n/a"; the first is no altitude, but a distance.
TEST_F(PositionFile, ReadsTelemetryOfTheMavicMini) {
  const PositionTrack track = Read(
      "1\r\n00:00:00,000 --> 00:00:01,000\r\nF/2.8, SS 30.15, ISO 260, EV -1.7, GPS (-121.7458, "
      "48.0771, 17), D 221.21m, H 200.70m, H.S n/a, V.S n/a \r\n\r\n"
      "2\r\n00:00:01,000 --> 00:00:02,000\r\nF/2.8, SS 30.15, ISO 260, EV -1.7, GPS (n/a, n/a, "
      "0), D 221.21m, H 200.70m, H.S n/a, V.S n/a \r\n");
  ASSERT_EQ(track.fixes.size(), 1U);
  EXPECT_EQ(track.fixes[0].latitude_deg, 48.0771);
  EXPECT_EQ(track.fixes[0].longitude_deg, -121.7458);
  EXPECT_FALSE(track.fixes[0].altitude_m.has_value());
  EXPECT_EQ(track.fixes[0].height_m, 200.7);
  EXPECT_EQ(track.num_without_position, 1U);
  EXPECT_EQ(track.num_unreadable, 0U);
}

// 25 subtitles a second, behind a byte order mark; the receiver tells its place five times.
TEST_F(PositionFile, ReadsTelemetryOfTheMavic2Pro) {
  std::string text = "\xEF\xBB\xBF";
  for (int i = 0; i < 25; ++i) {
    const std::string begin = std::to_string(1000 + 40 * i).substr(1);
    text += std::to_string(i + 1) + "\n00:00:00," + begin +
            " --> 00:00:09,000\n<font size=\"36\">FrameCnt : 218, DiffTime : 40ms\n2019-09-27 "
            "10:28:08,438,904\n[iso : 110] [focal_len : 280] [latitude : -35.08015" +
            std::to_string(i / 5) + "] [longtitude : -60.286702] </font>\n\n";
  }
  const PositionTrack track = Read(text);
  ASSERT_EQ(track.fixes.size(), 5U);
  EXPECT_EQ(track.fixes[4].time_s, 0.8);
  EXPECT_EQ(track.fixes[4].latitude_deg, -35.080154);
  EXPECT_FALSE(track.fixes[4].altitude_m.has_value());
}

TEST_F(PositionFile, ReadsTelemetryOfThePhantom4Rtk) {
  const PositionTrack track = Read(
      "1\n00:00:00,000 --> 00:00:01,000\nF/5.6, SS 400, ISO 100, EV 0, GPS (-58.851745, "
      "-34.237922, 15), HOME (-58.847509, -34.232707, -57.98m), D 698.70m, H 85.80m, H.S 0.00m/s, "
      "V.S 0.00m/s, F.PRY (2.7\xC2\xB0, -7.0\xC2\xB0, 110.1\xC2\xB0), G.PRY (-24.4\xC2\xB0, "
      "0.5\xC2\xB0, 110.4\xC2\xB0)\n");
  ASSERT_EQ(track.fixes.size(), 1U);
  EXPECT_EQ(track.fixes[0].latitude_deg, -34.237922);
  EXPECT_EQ(track.fixes[0].longitude_deg, -58.851745);
  EXPECT_EQ(track.fixes[0].height_m, 85.8);
  ASSERT_TRUE(track.fixes[0].gimbal.has_value());
  EXPECT_EQ(track.fixes[0].gimbal->pitch_deg, -24.4);
  EXPECT_EQ(track.fixes[0].gimbal->roll_deg, 0.5);
  EXPECT_EQ(track.fixes[0].gimbal->yaw_deg, 110.4);
}

// Latitude first: the altitude has a unit.
TEST_F(PositionFile, ReadsTelemetryOfTheMatrice300) {
  const PositionTrack track = Read(
      "1\n00:00:00,000 --> 00:00:01,000\n2022.06.21 16:06:17\n"
      "GPS(36.6146,-6.1120,12.5M) BAROMETER:0.3M\n");
  ASSERT_EQ(track.fixes.size(), 1U);
  EXPECT_EQ(track.fixes[0].latitude_deg, 36.6146);
  EXPECT_EQ(track.fixes[0].longitude_deg, -6.112);
  EXPECT_EQ(track.fixes[0].altitude_m, 12.5);
  EXPECT_EQ(track.fixes[0].height_m, 0.3);
}

TEST_F(PositionFile, TakesTheTimeOfDayWhereSubtitlesHaveNoOther) {
  const PositionTrack track = Read(
      "1\n2017.08.05 14:11:51,393,525,393,525\n[latitude : -20.2533] [longtitude : 149.0251]\n\n"
      "2\n2017.08.05 14:11:53,393,525\n[latitude : -20.2534] [longtitude : 149.0251]\n");
  ASSERT_EQ(track.fixes.size(), 2U);
  EXPECT_NEAR(track.fixes[0].time_s, 0, 1e-6);
  EXPECT_NEAR(track.fixes[1].time_s, 2, 1e-6);
}

TEST_F(PositionFile, ReadsDecimalCommas) {
  const PositionTrack track = Read(
      "1\n00:00:00,000 --> 00:00:01,000\n[latitude: 41,42] [longitude: 2,23]\n\n"
      "2\n00:00:01,000 --> 00:00:02,000\nGPS(149,0251,-20,2533,16)\n");
  ASSERT_EQ(track.fixes.size(), 2U);
  EXPECT_EQ(track.fixes[0].latitude_deg, 41.42);
  EXPECT_EQ(track.fixes[1].latitude_deg, -20.2533);
  EXPECT_EQ(track.fixes[1].longitude_deg, 149.0251);
}

// Written 30 times a second, measured once: 0, .5 and 1.2 s.
TEST_F(PositionFile, KeepsOneOfRepeatedPlaces) {
  std::string text;
  for (int i = 0; i < 90; ++i) {
    const int ms = 33 * i;
    const char* latitude = ms < 500 ? "41.10" : "41.20";
    const std::string milliseconds = std::to_string(1000 + ms % 1000).substr(1);
    text += std::to_string(i + 1) + "\n00:00:0" + std::to_string(ms / 1000) + "," + milliseconds +
            " --> 00:00:09,000\n[latitude: " + latitude + "] [longitude: 2.5]\n\n";
  }
  const PositionTrack track = Read(text);
  EXPECT_EQ(track.num_entries, 90U);
  ASSERT_EQ(track.fixes.size(), 4U);  // at rest one a second
  EXPECT_NEAR(track.fixes[1].time_s, 0.528, 1e-9);
  EXPECT_NEAR(track.fixes[2].time_s, 1.551, 1e-9);
}

TEST_F(PositionFile, CountsWhatItPassesOver) {
  const PositionTrack track = Read(
      "1\n00:00:00,000 --> 00:00:01,000\n[iso: 100]\n\n"
      "2\n00:00:01,000 --> 00:00:02,000\n[latitude: 0.000000] [longitude: 0.000000]\n\n"
      "3\n00:00:02,000 --> 00:00:03,000\n[latitude: 41.5] [longitude: 2.5]\n\n"
      "4\n00:00:03,000 --> 00:00:04,000\n[latitude: 95.5] [longitude: 2.5]\n\n"
      "5\n00:00:04,000 --> 00:00:05,000\n[latitude: 41.6] [longit");
  EXPECT_EQ(track.num_entries, 5U);
  EXPECT_EQ(track.num_without_position, 2U);
  EXPECT_EQ(track.num_unreadable, 2U);
  EXPECT_EQ(track.fixes.size(), 1U);
  EXPECT_THAT(track.first_unreadable, HasSubstr("line 13"));
}

TEST_F(PositionFile, RefusesWhatHasNoPositionsAndSaysWhy) {
  EXPECT_THAT(ErrorOf(""), HasSubstr("track:1: the file of positions is empty"));
  EXPECT_THAT(ErrorOf("\xEF\xBB\xBF"), HasSubstr("track:1: the file of positions is empty"));
  EXPECT_THAT(ErrorOf("1\n"), HasSubstr("track:1: no positions in this file (DJI telemetry)"));
  // The Mavic Air writes none.
  EXPECT_THAT(ErrorOf("\n1\n00:00:00,000 --> 00:00:00,039\n<font size=\"36\">FrameCnt : 1, "
                      "DiffTime : 39ms\n2018-02-19 08:04:51,265,847\n[iso : 100] [shutter : "
                      "1/240.0] [fnum : 280] [ev : 0] [ct : 5627] </font>\n"),
              AllOf(HasSubstr("track:2: no positions in this file (DJI telemetry)"),
                    HasSubstr("1 entry, the first has no latitude and longitude")));
  // What cannot be read stands in the way sooner than what has no fix.
  EXPECT_THAT(ErrorOf("1\n00:00:00,000 --> 00:00:01,000\n[latitude: 0] [longitude: 0]\n\n"
                      "2\n00:00:01,000 --> 00:00:02,000\nGPS(149.0\n\n"
                      "3\n00:00:02,000 --> 00:00:03,000\n[latitude: n1] [longitude: 2.5]\n"),
              AllOf(HasSubstr("track:9: no positions in this file"),
                    HasSubstr("3 entries, the position is cut off or no number")));
  EXPECT_THAT(ErrorOf("time,latitude,longitude\n1,,\n"),
              HasSubstr("track:2: no positions in this file (table)"));
  EXPECT_THAT(ErrorOf("$GPGGA,123521,,,,,0,00,,,M,,M,,\r\n"),
              HasSubstr("track:1: no positions in this file (NMEA 0183)"));
  EXPECT_THAT(ErrorOf("some text\nand more\n"), HasSubstr("track:1: not a file of positions"));
  EXPECT_THAT(ErrorOf("latitude,longitude\n1,2\n"), HasSubstr("neither times nor images"));
  EXPECT_THAT(ErrorOf("# survey\nEPSG:32632\na.jpg 500000 5400000 100\n"),
              HasSubstr("track:2: positions in this coordinate system are not read"));
}

TEST_F(PositionFile, ReadsGpx) {
  const PositionTrack track = Read(
      "<?xml version=\"1.0\"?><gpx version=\"1.1\"><wpt lat=\"1\" lon=\"1\"/><trk><trkseg>\n"
      "<trkpt lat=\"47.644548\" lon=\"-122.326897\"><ele>4.46</ele>"
      "<time>2009-10-17T18:37:26Z</time></trkpt>\n"
      "<trkpt lat=\"47.644549\" lon=\"-122.3\"><time>2009-10-17T18:37:31Z</time></trkpt>\n"
      "<trkpt lat=\"47.7\" lon=\"-122.3\"/></trkseg></trk></gpx>");
  ASSERT_EQ(track.fixes.size(), 2U);
  EXPECT_EQ(track.form, "GPX");
  EXPECT_EQ(track.clock, PositionClock::kUnix);
  EXPECT_EQ(track.fixes[0].time_s, 1255804646);
  EXPECT_EQ(track.fixes[0].altitude_m, 4.46);
  EXPECT_EQ(track.fixes[1].longitude_deg, -122.3);
  EXPECT_EQ(track.num_unreadable, 1U);
  EXPECT_THAT(track.first_unreadable, HasSubstr("line 4: the point has no time"));
}

TEST_F(PositionFile, ReadsGpxUpToWhereItBreaksOff) {
  const PositionTrack track = Read(
      "<gpx><trkpt lat=\"47.6\" lon=\"-122.3\"><time>2009-10-17T18:37:26Z</time></trkpt>\n<trkpt "
      "la");
  EXPECT_EQ(track.fixes.size(), 1U);
  EXPECT_THAT(track.first_unreadable, HasSubstr("the XML breaks off"));
}

TEST_F(PositionFile, ReadsNmea) {
  const PositionTrack track = Read(
      "$GPRMC,123519,A,4807.038,N,01131.000,E,022.4,084.4,230314,003.1,W*62\r\n"
      "$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47\r\n"
      "$GPGST,123519,1.2,2,1,0,3.0,4.0,5.0*68\r\n"
      "$GPGGA,123520,4807.038,N,01131.000,W,1,08,0.9,545.4,M,46.9,M,,*47\r\n"
      "$GPGGA,123521,,,,,0,00,,,M,,M,,\r\n"
      "$GPGGA,123522.50,4807.038,S,01131.000,W,1,08,0.9,545.4,M,46.9,M,,\r\n");
  ASSERT_EQ(track.fixes.size(), 2U);
  EXPECT_EQ(track.fixes[0].time_s, 1395578119);  // 2014-03-23 12:35:19 UTC
  EXPECT_NEAR(track.fixes[0].latitude_deg, 48.1173, 1e-9);
  EXPECT_NEAR(track.fixes[0].longitude_deg, 11 + 31.0 / 60, 1e-12);
  EXPECT_EQ(track.fixes[0].altitude_m, 545.4);
  EXPECT_NEAR(track.fixes[0].sigma_horizontal_m, std::sqrt(12.5), 1e-12);
  EXPECT_EQ(track.fixes[0].sigma_vertical_m, 5);
  EXPECT_EQ(track.fixes[1].time_s, 1395578122.5);
  EXPECT_NEAR(track.fixes[1].latitude_deg, -48.1173, 1e-9);
  EXPECT_EQ(track.num_without_position, 1U);
  EXPECT_EQ(track.num_unreadable, 1U);
  EXPECT_THAT(track.first_unreadable, HasSubstr("line 4: the checksum"));
}

TEST_F(PositionFile, ReadsTablesWithNamedColumns) {
  const PositionTrack seconds =
      Read("time;Latitude;Longitude;Altitude\n1,5;47,1;8,2;400\n2;n;8;4\n");
  ASSERT_EQ(seconds.fixes.size(), 1U);
  EXPECT_EQ(seconds.fixes[0].time_s, 1.5);
  EXPECT_EQ(seconds.fixes[0].latitude_deg, 47.1);
  EXPECT_EQ(seconds.fixes[0].altitude_m, 400);
  EXPECT_THAT(seconds.first_unreadable, HasSubstr("line 3"));

  const PositionTrack airdata = Read(
      "time(millisecond),datetime(utc),latitude,longitude,height_above_takeoff(meters),"
      "altitude_above_seaLevel(meters)\n300,2021-01-01 10:00:00,47.1,8.2,12.5,410.1\n");
  ASSERT_EQ(airdata.fixes.size(), 1U);
  EXPECT_EQ(airdata.fixes[0].time_s, 0.3);
  EXPECT_EQ(airdata.fixes[0].height_m, 12.5);
  EXPECT_EQ(airdata.fixes[0].altitude_m, 410.1);

  const PositionTrack images = Read("file name\tlat\tlon\n\"a, b.jpg\"\t47.1\t8.2\n");
  ASSERT_EQ(images.fixes.size(), 1U);
  EXPECT_EQ(images.clock, PositionClock::kImages);
  EXPECT_EQ(images.fixes[0].image, "a, b.jpg");
  EXPECT_FALSE(images.has_image_times);

  const PositionTrack taken = Read(
      "image,lat,lon,datetime\na.jpg,47.1,8.2,2021-01-01 10:00:05\nb.jpg,47.1,8.2,2021-01-01 "
      "10:00:00\n");
  EXPECT_TRUE(taken.has_image_times);
  EXPECT_EQ(taken.fixes[0].time_s - taken.fixes[1].time_s, 5);
}

TEST_F(PositionFile, ReadsImagePositionsOfOpenDroneMap) {
  const PositionTrack track = Read(
      "EPSG:4326\nDJI_0028.JPG -91.99 46.84 198.609 0 0 0 .5 1.5\nDJI_0032.JPG -91.98 46.83\n");
  ASSERT_EQ(track.fixes.size(), 2U);
  EXPECT_EQ(track.fixes[0].image, "DJI_0028.JPG");
  EXPECT_EQ(track.fixes[0].latitude_deg, 46.84);
  EXPECT_EQ(track.fixes[0].altitude_m, 198.609);
  EXPECT_EQ(track.fixes[0].sigma_horizontal_m, 0.5);
  EXPECT_EQ(track.fixes[0].sigma_vertical_m, 1.5);
  EXPECT_FALSE(track.fixes[1].altitude_m.has_value());
}

TEST_F(PositionFile, ReadsBothFormsOfPositionLists) {
  const PositionTrack geodetic = Read(
      "# timestamp latitude longitude altitude relative_altitude\n0.0 46.842607 -91.99 198.3 "
      "39.8\n");
  ASSERT_EQ(geodetic.fixes.size(), 1U);
  EXPECT_EQ(geodetic.fixes[0].latitude_deg, 46.842607);
  EXPECT_EQ(geodetic.fixes[0].height_m, 39.8);

  const PositionTrack local = Read(
      "# timestamp east north up: seconds and metres from the origin\n"
      "# origin (WGS 84 latitude_deg longitude_deg altitude_m) 0 20 100\n3.5 0 1 50\n");
  ASSERT_EQ(local.fixes.size(), 1U);
  EXPECT_EQ(local.fixes[0].time_s, 3.5);
  EXPECT_NEAR(local.fixes[0].latitude_deg, 1 / 110574.28, 1e-9);
  EXPECT_NEAR(local.fixes[0].altitude_m.value(), 150, 1e-3);
  EXPECT_EQ(local.resolution_m, 0);
}

TEST_F(PositionFile, IsFoundBesideItsVideo) {
  const fs::path video = folder_ / "DJI_0001.MP4";
  EXPECT_FALSE(FindPositionFile(video).has_value());
  Write("DJI_0002.SRT", "");
  Write("DJI_0001.gpx", "");
  EXPECT_EQ(FindPositionFile(video), folder_ / "DJI_0001.gpx");
  Write("DJI_0001.Srt", "");
  EXPECT_EQ(FindPositionFile(video), folder_ / "DJI_0001.Srt");
}

}  // namespace
}  // namespace mono3d
