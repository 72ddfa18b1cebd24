// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/io/camera_file.h"

#include <gmock/gmock.h>

#include <cstdint>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/core/persistence.hpp>
#include <optional>
#include <string>
#include <vector>

#include "io/temporary_folder.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

using CameraFile = TemporaryFolderTest;

template <typename Call>
std::optional<ErrorCode> CodeOf(const Call& call) {
  try {
    call();
  } catch (const Error& error) {
    return error.code();
  }
  return std::nullopt;
}

CameraModel LensCamera() {
  CameraModel camera{768, 448, 691.2, 690.1 / 3, 383.5, 223.25, {}};
  camera.distortion = {-0.1, 0.01, 1e-5, -2e-4, 0.003};
  return camera;
}

// A calibration with one of its lines replaced.
std::string Yaml(const std::string& old_text = "", const std::string& new_text = "") {
  std::string yaml =
      "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\n"
      "camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n"
      "   data: [ 500., 0., 319.5, 0.,\n       501., 239.5, 0., 0., 1. ]\n"
      "distortion_coefficients: !!opencv-matrix\n   rows: 1\n   cols: 4\n   dt: d\n"
      "   data: [ 1.0e-01, -2.0e-01, 3.0e-03, 4.0e-03 ]\n";
  if (!old_text.empty()) yaml.replace(yaml.find(old_text), old_text.size(), new_text);
  return yaml;
}

TEST_F(CameraFile, ReadsYamlByHand) {
  const CameraModel camera = ReadCameraFile(WriteText("camera.yaml", Yaml()));
  CameraModel expected{640, 480, 500, 501, 319.5, 239.5, {}};
  expected.distortion = {0.1, -0.2, 0.003, 0.004, 0};
  EXPECT_EQ(camera, expected);
}

TEST_F(CameraFile, SurvivesWritingAndReading) {
  WriteCameraFile(folder_ / "camera.yaml", LensCamera());
  EXPECT_EQ(ReadCameraFile(folder_ / "camera.yaml"), LensCamera());
}

TEST_F(CameraFile, KeepsTheShutter) {
  CameraModel camera = LensCamera();
  for (const double readout_s : {0.03, -0.03, 1.0 / 61, -0.0123456789}) {
    for (const bool reads_columns : {false, true}) {
      camera.shutter = {readout_s, reads_columns};
      WriteCameraFile(folder_ / "camera.yaml", camera);
      CameraModel read = ReadCameraFile(folder_ / "camera.yaml");
      EXPECT_DOUBLE_EQ(read.shutter.readout_s, readout_s);
      read.shutter.readout_s = readout_s;
      EXPECT_EQ(read, camera);
    }
  }
  camera.shutter = {0, true};
  WriteCameraFile(folder_ / "camera.yaml", camera);
  EXPECT_EQ(ReadText(folder_ / "camera.yaml").find("line"), std::string::npos);
  EXPECT_TRUE(ReadCameraFile(folder_ / "camera.yaml").shutter.IsGlobal());
}

TEST_F(CameraFile, ReadsTheShutterByHand) {
  struct Case {
    const char* lines;
    RollingShutter shutter;
  };
  // 640x480.
  const Case cases[] = {
      {"line_delay_s: 6e-5\n", {479 * 6e-5, false}},
      {"line_delay_s: -6e-5\n", {-479 * 6e-5, false}},
      {"line_delay_s: 6e-5\nreadout_direction: down\n", {479 * 6e-5, false}},
      {"readout_direction: up\nLine_Delay_s: 6e-5\n", {-479 * 6e-5, false}},
      {"readout_direction: up\nline_delay_s: -6e-5\n", {-479 * 6e-5, false}},
      {"line_delay_s: 4e-5\nreadout_direction: right\n", {639 * 4e-5, true}},
      {"line_delay_s: -4e-5\nreadout_direction: right\n", {-639 * 4e-5, true}},
      {"line_delay_s: 4e-5\nreadout_direction: left\n", {-639 * 4e-5, true}},
      {"line_delay_s: 0\nreadout_direction: left\n", {}},
      {"readout_direction: up\n", {}},
  };
  for (const Case& c : cases) {
    const CameraModel camera = ReadCameraFile(WriteText("camera.yaml", Yaml() + c.lines));
    EXPECT_EQ(camera.shutter, c.shutter) << c.lines;
  }
}

TEST_F(CameraFile, RefusesWhatIsNoShutter) {
  const auto message = [&](const std::string& lines) {
    try {
      ReadCameraFile(WriteText("camera.yaml", Yaml() + lines));
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("none");
  };
  EXPECT_THAT(message("line_delay_s: slow\n"),
              HasSubstr("camera.yaml:16: camera calibration: bad value in line_delay_s (expected a "
                        "finite number, found slow)"));
  EXPECT_THAT(message("line_delay_s: [1e-5, 2e-5]\n"),
              HasSubstr("camera.yaml:16: camera calibration: bad line_delay_s (expected one "
                        "number, found a list)"));
  EXPECT_THAT(message("line_delay_s:\n"), HasSubstr("camera.yaml:16: camera calibration: bad"));
  EXPECT_THAT(message("line_delay_s: 1e-5\nreadout_direction: sideways\n"),
              HasSubstr("camera.yaml:17: camera calibration: bad readout_direction (expected down, "
                        "up, right or left, found sideways)"));
  EXPECT_THAT(message("line_delay_s: 1e-5\nline_delay_s: 1e-5\n"), HasSubstr("camera.yaml:17: "));
  EXPECT_THAT(message("line_delay_s: 0.01\n"),
              HasSubstr("bad readout time (expected -1 to 1 s, found 4.79"));
}

TEST_F(CameraFile, IsWhatOpenCvReads) {
  CameraModel camera = LensCamera();
  camera.shutter.readout_s = 447 * 2e-5;
  WriteCameraFile(folder_ / "camera.yaml", camera);
  const cv::FileStorage file(folder_ / "camera.yaml", cv::FileStorage::READ);
  EXPECT_EQ(static_cast<int>(file["image_height"]), 448);
  const cv::Mat K = file["camera_matrix"].mat();
  ASSERT_EQ(K.size(), cv::Size(3, 3));
  EXPECT_EQ(K.at<double>(1, 1), 690.1 / 3);
  EXPECT_EQ(file["distortion_coefficients"].mat().at<double>(4), 0.003);
  EXPECT_DOUBLE_EQ(file["line_delay_s"].real(), 2e-5);
  EXPECT_EQ(file["readout_direction"].string(), "down");
}

TEST_F(CameraFile, ReadsWhatOpenCvWrites) {
  const CameraModel camera = LensCamera();
  {
    cv::FileStorage file(folder_ / "camera.yml", cv::FileStorage::WRITE);
    file << "calibration_time"
         << "Tue Mar  3 10:11:12 2020";
    file << "image_width" << camera.width << "image_height" << camera.height;
    file << "camera_matrix"
         << cv::Mat_<double>({3, 3},
                             {camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0});
    file << "distortion_coefficients"
         << cv::Mat_<double>({5, 1},
                             {camera.distortion[0], camera.distortion[1], camera.distortion[2],
                              camera.distortion[3], camera.distortion[4]});
    file << "avg_reprojection_error" << 0.25;
    file << "image_points" << cv::Mat(3, 40, CV_32FC2, cv::Scalar(1, 2));
  }
  EXPECT_EQ(ReadCameraFile(folder_ / "camera.yml"), camera);
}

TEST_F(CameraFile, ReadsWhatRosWrites) {
  const auto path = WriteText("ost.yaml",
                              "image_width: 640\r\nimage_height: 480\r\ncamera_name: front\r\n"
                              "camera_matrix:\r\n  rows: 3\r\n  cols: 3\r\n"
                              "  data: [500, 0, 320, 0, 501, 240, 0, 0, 1]\r\n"
                              "distortion_model: plumb_bob\r\n"
                              "distortion_coefficients:\r\n  rows: 1\r\n  cols: 5\r\n"
                              "  data:  # k1 k2 p1 p2 k3\r\n  - 0.1\r\n  - 0\r\n  - 0\r\n"
                              "  - 0\r\n  - -0.2\r\n"
                              "projection_matrix:\r\n  rows: 3\r\n  cols: 4\r\n"
                              "  data: [500, 0, 320, 0, 0, 501, 240, 0, 0, 0, 1, 0]\r\n");
  CameraModel expected{640, 480, 500, 501, 320, 240, {}};
  expected.distortion = {0.1, 0, 0, 0, -0.2};
  EXPECT_EQ(ReadCameraFile(path), expected);
}

TEST_F(CameraFile, RefusesNanWithItsLine) {
  EXPECT_THAT([&] { ReadCameraFile(WriteText("camera.yaml", Yaml("501.", ".Nan"))); },
              ThrowsMessage<Error>(HasSubstr(
                  "camera.yaml:10: camera calibration: bad value in camera_matrix (expected a "
                  "finite number, found .Nan)")));
  EXPECT_THAT(
      [&] { ReadCameraFile(WriteText("camera.yaml", Yaml("1.0e-01", "nan"))); },
      ThrowsMessage<Error>(AllOf(HasSubstr("camera.yaml:15: "),
                                 HasSubstr("distortion_coefficients"), HasSubstr("found nan"))));
}

TEST_F(CameraFile, RefusesAWrongSize) {
  for (const char* size : {"0", "-640", "640.5", "wide", ""}) {
    const std::string line = std::string("image_width: ") + size;
    EXPECT_THAT([&] { ReadCameraFile(WriteText("camera.yaml", Yaml("image_width: 640", line))); },
                ThrowsMessage<Error>(
                    AllOf(HasSubstr("camera.yaml:3: "), HasSubstr("image_width (expected"))))
        << size;
  }
}

TEST_F(CameraFile, RefusesAMissingKey) {
  EXPECT_THAT([&] { ReadCameraFile(WriteText("camera.yaml", Yaml("image_height", "height"))); },
              ThrowsMessage<Error>(HasSubstr(
                  "camera.yaml: camera calibration: key is missing (expected image_height)")));
  EXPECT_THAT([&] { ReadCameraFile(WriteText("camera.yaml", "")); },
              ThrowsMessage<Error>(HasSubstr("key is missing (expected image_width)")));
}

TEST_F(CameraFile, RefusesAWrongNumberOfValues) {
  EXPECT_THAT([&] { ReadCameraFile(WriteText("camera.yaml", Yaml("501., ", ""))); },
              ThrowsMessage<Error>(
                  HasSubstr("wrong number of values in camera_matrix (expected 9, found 8)")));
  EXPECT_THAT(
      [&] {
        ReadCameraFile(WriteText("camera.yaml",
                                 "image_width: 4\nimage_height: 3\n"
                                 "camera_matrix: [1, 0, 2, 0, 1, 2, 0, 0, 1]\n"
                                 "distortion_coefficients: [0.1]\n"));
      },
      ThrowsMessage<Error>(HasSubstr("camera.yaml:4: camera calibration: wrong number of values "
                                     "in distortion_coefficients (expected k1 k2 p1 p2 [k3]")));
}

TEST_F(CameraFile, RefusesWhatIsNoPinholeCamera) {
  EXPECT_THAT([&] { ReadCameraFile(WriteText("camera.yaml", Yaml("500., 0.,", "500., 2.,"))); },
              ThrowsMessage<Error>(HasSubstr("expected fx 0 cx 0 fy cy 0 0 1")));
  EXPECT_THAT([&] { ReadCameraFile(WriteText("camera.yaml", Yaml("500., 0.,", "-500., 0.,"))); },
              ThrowsMessage<Error>(HasSubstr("bad focal length fx (expected a positive number")));
  EXPECT_THAT(
      [&] { ReadCameraFile(WriteText("camera.yaml", Yaml() + "distortion_model: omni\n")); },
      ThrowsMessage<Error>(HasSubstr(
          "camera.yaml:16: camera calibration: unsupported distortion model (expected plumb_bob or "
          "equidistant, found omni)")));
}

TEST_F(CameraFile, ReadsFisheyeLenses) {
  CameraModel expected{640, 480, 500, 501, 319.5, 239.5, {0.1, -0.2, 0.003, 0.004, 0}};
  EXPECT_EQ(ReadCameraFile(WriteText("camera.yaml", Yaml() + "fisheye_model: 0\n")), expected);
  expected.lens = LensModel::kFisheye;
  for (const char* line :
       {"distortion_model: equidistant\n", "distortion_model: fisheye\n", "fisheye_model: 1\n"}) {
    EXPECT_EQ(ReadCameraFile(WriteText("camera.yaml", Yaml() + line)), expected) << line;
  }
  EXPECT_THAT(
      [&] {
        ReadCameraFile(WriteText("camera.yaml",
                                 "image_width: 4\nimage_height: 3\n"
                                 "camera_matrix: [1, 0, 2, 0, 1, 2, 0, 0, 1]\n"
                                 "distortion_model: equidistant\n"
                                 "distortion_coefficients: [0.1, 0, 0, 0, 0.5]\n"));
      },
      ThrowsMessage<Error>(HasSubstr("unsupported distortion (expected zeros after k1 k2 k3 k4")));
}

TEST_F(CameraFile, KeepsAFisheyeLens) {
  CameraModel camera{768, 448, 290.5, 290.1 / 3, 383.5, 223.25, {0.1 / 3, -0.01, 1e-5, -2e-4, 0}};
  camera.lens = LensModel::kFisheye;
  camera.shutter.readout_s = 0.02;
  WriteCameraFile(folder_ / "camera.yaml", camera);
  CameraModel read = ReadCameraFile(folder_ / "camera.yaml");
  EXPECT_DOUBLE_EQ(read.shutter.readout_s, 0.02);
  read.shutter.readout_s = 0.02;
  EXPECT_EQ(read, camera);
}

TEST_F(CameraFile, RefusesSeveralCameras) {
  EXPECT_THAT([&] { ReadCameraFile(WriteText("camera.yaml", Yaml() + Yaml())); },
              ThrowsMessage<Error>(HasSubstr("several cameras in one file")));
}

TEST_F(CameraFile, RefusesAFileThatIsNotThere) {
  EXPECT_THAT([&] { ReadCameraFile(folder_ / "none.yaml"); },
              ThrowsMessage<Error>(HasSubstr("none.yaml: there is no such file")));
  EXPECT_THAT([&] { ReadCameraFile(folder_); }, ThrowsMessage<Error>(HasSubstr("cannot read")));
  EXPECT_EQ(CodeOf([&] { ReadCameraFile(folder_ / "none.yaml"); }), ErrorCode::kNotFound);
  EXPECT_EQ(CodeOf([&] { ReadCameraFile(folder_); }), ErrorCode::kIo);
}

TEST_F(CameraFile, TellsBadContentFromWhatIsNotSupported) {
  const auto bad = WriteText("bad.yaml", Yaml("501.", ".Nan"));
  EXPECT_EQ(CodeOf([&] { ReadCameraFile(bad); }), ErrorCode::kInvalidInput);
  const auto omni = WriteText("omni.yaml", Yaml() + "distortion_model: omni\n");
  EXPECT_EQ(CodeOf([&] { ReadCameraFile(omni); }), ErrorCode::kUnsupported);
  const auto colmap = WriteText("cameras.txt", "1 FOV 640 480 500 501 320 240 0.9\n");
  EXPECT_EQ(CodeOf([&] { ReadCameraFile(colmap); }), ErrorCode::kUnsupported);
}

TEST_F(CameraFile, RefusesAListThatIsNotClosed) {
  EXPECT_THAT([&] { ReadCameraFile(WriteText("camera.yaml", Yaml("1. ]", "1."))); },
              ThrowsMessage<Error>(testing::ContainsRegex(
                  "camera.yaml:1[0-9]: camera calibration: not YAML: [a-z ]+$")));
}

// yaml-cpp before 0.9 reads it without end.
TEST_F(CameraFile, RefusesACommaBetweenDocuments) {
  for (const std::string text : {",", "image_width: 640\n---\n, image_height: 480\n", "a: 1 ]\n"}) {
    EXPECT_THROW(ReadCameraFile(WriteText("camera.yaml", text)), Error) << text;
  }
  EXPECT_THAT(
      [&] { ReadCameraFile(WriteText("camera.yaml", "---\n,\n")); },
      ThrowsMessage<Error>(testing::HasSubstr("camera.yaml:2: camera calibration: not YAML")));
}

TEST_F(CameraFile, RefusesWhatIsNoYamlInOneLine) {
  const std::string no_yaml[] = {
      std::string("\xFF\xD8\xFF\x00\x10JFIF", 9),
      "{",
      "a: *b\n",
      "\t- x: [1\n",
      "- 1\n- 2\n",
      "image_width: {}\nimage_height: [[1, 2]]\n",
      std::string(100000, '['),
      "image_width: 4\nimage_height: 3\ncamera_matrix: {data: {a: 1}}\n"};
  for (const std::string& text : no_yaml) {
    const auto path = WriteText("camera.yaml", text);
    EXPECT_THAT(
        [&] { ReadCameraFile(path); },
        ThrowsMessage<Error>(AllOf(HasSubstr("camera.yaml"), HasSubstr("camera calibration: "),
                                   testing::Not(HasSubstr("\n")))))
        << text.substr(0, 20);
  }
}

// The parser needs half a minute for these lines.
TEST_F(CameraFile, RefusesAFileThatIsTooLargeForACalibration) {
  std::string lines = "a: [\n";
  for (int i = 0; i < 700'000; ++i) lines += "- 1\n";
  EXPECT_THAT([&] { ReadCameraFile(WriteText("camera.yaml", lines)); },
              ThrowsMessage<Error>(HasSubstr("too large for a calibration")));
}

TEST_F(CameraFile, RefusesAMatrixOfMoreValuesThanNumbersCount) {
  const auto path = WriteText("camera.yaml",
                              "image_width: 640\nimage_height: 480\n"
                              "camera_matrix: {rows: 1000000, cols: 1000000, data: [1]}\n");
  EXPECT_THAT([&] { ReadCameraFile(path); },
              ThrowsMessage<Error>(HasSubstr("expected 1000000000000, found 1")));
}

TEST_F(CameraFile, ReadsKeysInAnyCaseAndListsOnOneLine) {
  const auto path = WriteText("camera.yaml",
                              "Image_Width: 640\nIMAGE_HEIGHT: 480  # px\n"
                              "camera_matrix: [500, 0, 320, 0, 501, 240, 0, 0, 1]\n"
                              "distortion_coefficients: {data: [0.1, 0, 0, 0, -0.2]}\n");
  CameraModel expected{640, 480, 500, 501, 320, 240, {}};
  expected.distortion = {0.1, 0, 0, 0, -0.2};
  EXPECT_EQ(ReadCameraFile(path), expected);
}

TEST_F(CameraFile, ReadsTheModelsOfColmap) {
  struct Case {
    const char* line;
    double fy;
    std::array<double, 5> distortion;
    LensModel lens = LensModel::kBrown;
  };
  const Case cases[] = {
      {"1 SIMPLE_PINHOLE 640 480 500 320 240", 500, {}},
      {"7 PINHOLE 640 480 500 501 320 240", 501, {}},
      {"1 SIMPLE_RADIAL 640 480 500 320 240 0.1", 500, {0.1}},
      {"1 RADIAL 640 480 500 320 240 0.1 0.2", 500, {0.1, 0.2}},
      {"1 OPENCV 640 480 500 501 320 240 0.1 0.2 0.3 0.4", 501, {0.1, 0.2, 0.3, 0.4}},
      {"1 FULL_OPENCV 640 480 500 501 320 240 0.1 0.2 0.3 0.4 0.5 0 0 0",
       501,
       {0.1, 0.2, 0.3, 0.4, 0.5}},
      {"1 SIMPLE_RADIAL_FISHEYE 640 480 500 320 240 0.1", 500, {0.1}, LensModel::kFisheye},
      {"1 RADIAL_FISHEYE 640 480 500 320 240 0.1 0.2", 500, {0.1, 0.2}, LensModel::kFisheye},
      {"1 OPENCV_FISHEYE 640 480 500 501 320 240 0.1 0.2 0.3 0.4",
       501,
       {0.1, 0.2, 0.3, 0.4},
       LensModel::kFisheye},
  };
  for (const Case& c : cases) {
    const auto path = WriteText("cameras.txt", std::string("# CAMERA_ID, MODEL\n") + c.line + "\n");
    const CameraModel expected{640, 480, 500, c.fy, 319.5, 239.5, c.distortion, {}, c.lens};
    EXPECT_EQ(ReadCameraFile(path), expected) << c.line;
  }
}

TEST_F(CameraFile, RefusesColmapCamerasThatItCannotHold) {
  struct Case {
    const char* lines;
    const char* message;
  };
  const Case cases[] = {
      {"# one\n1 PINHOLE 640 480 500 501 320\n",
       "cameras.txt:2: camera calibration: wrong number of parameters of a PINHOLE camera "
       "(expected 4, found 3)"},
      {"1 PINHOLE 640 480 500 501 320 nan\n", "expected a finite number, found nan"},
      {"1 PINHOLE 0 480 500 501 320 240\n", "bad image_width (expected a positive number"},
      {"1 PINHOLE 640 1e300 500 501 320 240\n",
       "bad size of the image (expected whole numbers up to 65535, found 1e300)"},
      {"1 PINHOLE 640.5 480 500 501 320 240\n", "bad size of the image"},
      {"1 FOV 640 480 500 501 320 240 0.9\n",
       "unsupported camera model (expected SIMPLE_PINHOLE, PINHOLE, "},
      {"1 FULL_OPENCV 640 480 500 501 320 240 0 0 0 0 0 0.1 0 0\n", "k4 = k5 = k6 = 0"},
      {"1 PINHOLE 640 480 500 501 320 240\n2 PINHOLE 640 480 500 501 320 240\n",
       "cameras.txt:2: camera calibration: several cameras in one file"},
  };
  for (const Case& c : cases) {
    EXPECT_THAT([&] { ReadCameraFile(WriteText("cameras.txt", c.lines)); },
                ThrowsMessage<Error>(HasSubstr(c.message)));
  }
}

TEST_F(CameraFile, WithoutDistortionHasNone) {
  const auto path = WriteText("camera.yaml",
                              "image_width: 640\nimage_height: 480\n"
                              "camera_matrix: [500, 0, 319.5, 0, 501, 239.5, 0, 0, 1]\n");
  EXPECT_EQ(ReadCameraFile(path), (CameraModel{640, 480, 500, 501, 319.5, 239.5, {}}));
}

TEST_F(CameraFile, ReadsOpenCvXmlAndJson) {
  const CameraModel camera = LensCamera();
  for (const char* name : {"camera.xml", "camera.json"}) {
    {
      cv::FileStorage file(folder_ / name, cv::FileStorage::WRITE);
      file << "image_width" << camera.width << "image_height" << camera.height;
      file << "camera_matrix"
           << cv::Mat_<double>(
                  {3, 3}, {camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0});
      file << "distortion_coefficients"
           << cv::Mat_<double>({5, 1},
                               {camera.distortion[0], camera.distortion[1], camera.distortion[2],
                                camera.distortion[3], camera.distortion[4]});
    }
    EXPECT_EQ(ReadCameraFile(folder_ / name), camera) << name;
  }
  EXPECT_THAT([&] { ReadCameraFile(WriteText("bad.xml", "<?xml version=\"1.0\"?>\n<a><b>")); },
              ThrowsMessage<Error>(HasSubstr("bad.xml:2: camera calibration: not XML of")));
}

// OpenCV's own parser reads address 0 here.
TEST_F(CameraFile, RefusesXmlThatIsNotWhole) {
  using std::string_literals::operator""s;
  for (const std::string& xml :
       {"<?xml version=\0\0\0\1\"?>\n<opencv_storage>\n<a>3<"s,
        "<?xml version=\"1.0\"?>\n<!DOCTYPE a [<!ENTITY b \"c\">]>\n<opencv_storage/>"s,
        "<?xml version=\"1.0\"?>\n<storage><image_width>640</image_width></storage>"s}) {
    EXPECT_THAT([&] { ReadCameraFile(WriteText("bad.xml", xml)); },
                ThrowsMessage<Error>(HasSubstr("camera calibration: not XML of cv::FileStorage")))
        << xml;
  }
}

TEST_F(CameraFile, NamesTheLineOfXml) {
  const std::string xml =
      "<?xml version=\"1.0\"?>\n<opencv_storage>\n<when>\"it's noon\"</when>\n"
      "<image_width>640</image_width>\n<image_height>tall</image_height>\n</opencv_storage>\n";
  EXPECT_THAT(
      [&] { ReadCameraFile(WriteText("bad.xml", xml)); },
      ThrowsMessage<Error>(HasSubstr("bad.xml:5: camera calibration: bad value in image_height")));
}

TEST_F(CameraFile, RefusesASizeOfKalibrThatIsNone) {
  for (const char* size : {"1e30", "-3", "640.5"}) {
    const auto path =
        WriteText("camchain.yaml", std::string("cam0:\n  intrinsics: [461, 460, 362, 248]\n"
                                               "  resolution: [") +
                                       size + ", 480]\n");
    EXPECT_THAT(
        [&] { ReadCameraFile(path); },
        ThrowsMessage<Error>(HasSubstr("camchain.yaml:3: camera calibration: bad resolution")));
  }
}

TEST_F(CameraFile, ReadsKalibr) {
  const std::string kalibr =
      "cam0:\n  cam_overlaps: []\n  camera_model: pinhole\n"
      "  distortion_coeffs: [-0.25, 0.0625, 0.001, 0.002]\n  distortion_model: radtan\n"
      "  intrinsics: [461.5, 460.25, 362.5, 246.5]\n  resolution: [752, 480]\n"
      "  rostopic: /cam0/image_raw\n";
  CameraModel expected{752, 480, 461.5, 460.25, 362.5, 246.5, {-0.25, 0.0625, 0.001, 0.002, 0}};
  EXPECT_EQ(ReadCameraFile(WriteText("camchain.yaml", kalibr)), expected);
  std::string fisheye = kalibr;
  fisheye.replace(fisheye.find("radtan"), 6, "equidistant");
  expected.lens = LensModel::kFisheye;
  EXPECT_EQ(ReadCameraFile(WriteText("camchain.yaml", fisheye)), expected);
  std::string omni = kalibr;
  omni.replace(omni.find("pinhole"), 7, "omni");
  EXPECT_THAT(
      [&] { ReadCameraFile(WriteText("camchain.yaml", omni)); },
      ThrowsMessage<Error>(HasSubstr(
          "camchain.yaml:3: camera calibration: unsupported camera model (expected pinhole, "
          "found omni)")));
  std::string two = kalibr + kalibr;
  two.replace(two.rfind("cam0:"), 5, "cam1:");
  EXPECT_THAT([&] { ReadCameraFile(WriteText("camchain.yaml", two)); },
              ThrowsMessage<Error>(HasSubstr("several cameras in one file")));
}

TEST_F(CameraFile, ReadsOrbSlam) {
  const std::string size = "Camera.width: 640\nCamera.height: 480\n";
  const std::string first =  // of ORB-SLAM2
      "%YAML:1.0\n\nCamera.fx: 517.25\nCamera.fy: 516.5\nCamera.cx: 318.5\nCamera.cy: 255.25\n"
      "Camera.k1: 0.25\nCamera.k2: -0.95\nCamera.p1: -0.005\nCamera.p2: 0.002\nCamera.k3: 1.5\n"
      "Camera.fps: 30.0\n";
  EXPECT_EQ(
      ReadCameraFile(WriteText("TUM1.yaml", first + size)),
      (CameraModel{640, 480, 517.25, 516.5, 318.5, 255.25, {0.25, -0.95, -0.005, 0.002, 1.5}}));
  const std::string third =  // of ORB-SLAM3
      "%YAML:1.0\nFile.version: \"1.0\"\nCamera.type: \"KannalaBrandt8\"\n"
      "Camera1.fx: 190.5\nCamera1.fy: 190.25\nCamera1.cx: 254.5\nCamera1.cy: 256.5\n"
      "Camera1.k1: 0.003\nCamera1.k2: 0.0007\nCamera1.k3: -0.002\nCamera1.k4: 0.0002\n" +
      size;
  EXPECT_EQ(ReadCameraFile(WriteText("TUM-VI.yaml", third)),
            (CameraModel{640,
                         480,
                         190.5,
                         190.25,
                         254.5,
                         256.5,
                         {0.003, 0.0007, -0.002, 0.0002, 0},
                         {},
                         LensModel::kFisheye}));
  EXPECT_THAT([&] { ReadCameraFile(WriteText("TUM1.yaml", first)); },
              ThrowsMessage<Error>(HasSubstr("key is missing (expected camera.width)")));
}

TEST_F(CameraFile, ReadsNerfstudio) {
  const std::string json =
      "{\n  \"camera_model\": \"OPENCV\",\n  \"fl_x\": 1072.5, \"fl_y\": 1068.25,\n"
      "  \"cx\": 504.5, \"cy\": 300, \"w\": 1008, \"h\": 600,\n"
      "  \"k1\": 0.25, \"k2\": -0.5, \"p1\": 0.001,\n"
      "  \"frames\": [{\"file_path\": \"images/1.jpg\", \"transform_matrix\": [[1, 0], [0, "
      "1]]}]\n}\n";
  // Their principal point counts from a corner.
  EXPECT_EQ(ReadCameraFile(WriteText("transforms.json", json)),
            (CameraModel{1008, 600, 1072.5, 1068.25, 504, 299.5, {0.25, -0.5, 0.001, 0, 0}}));
  const CameraModel by_angle = ReadCameraFile(WriteText(
      "transforms.json", "{\"camera_angle_x\": 1.5707963267948966, \"w\": 800, \"h\": 600}"));
  EXPECT_NEAR(by_angle.fx, 400, 1e-9);
  EXPECT_NEAR(by_angle.fy, 400, 1e-9);
  EXPECT_EQ(by_angle.cx, 399.5);
}

// One camera of a cameras.bin, by https://colmap.github.io/format.html.
std::string ColmapBinary(std::int32_t model, const std::vector<double>& params) {
  std::string bytes;
  const auto append = [&](auto value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  append(std::uint64_t{1});
  append(std::uint32_t{7});
  append(model);
  append(std::uint64_t{640});
  append(std::uint64_t{480});
  for (const double param : params) append(param);
  return bytes;
}

TEST_F(CameraFile, ReadsColmapBinary) {
  EXPECT_EQ(ReadCameraFile(WriteText("cameras.bin", ColmapBinary(2, {500, 320, 240, 0.25}))),
            (CameraModel{640, 480, 500, 500, 319.5, 239.5, {0.25, 0, 0, 0, 0}}));
  EXPECT_EQ(
      ReadCameraFile(
          WriteText("cameras.bin", ColmapBinary(5, {500, 501, 320, 240, 0.1, 0.2, 0.3, 0.4}))),
      (CameraModel{
          640, 480, 500, 501, 319.5, 239.5, {0.1, 0.2, 0.3, 0.4, 0}, {}, LensModel::kFisheye}));
  EXPECT_THAT(
      [&] {
        ReadCameraFile(WriteText("cameras.bin", ColmapBinary(2, {500, 320})));
      },
      ThrowsMessage<Error>(HasSubstr("cameras.bin: camera calibration: the file is trunc")));
  EXPECT_THAT(
      [&] {
        ReadCameraFile(WriteText("cameras.bin", ColmapBinary(10, {500, 320})));
      },
      ThrowsMessage<Error>(HasSubstr("unsupported camera model")));
}

}  // namespace
}  // namespace mono3d
