// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/pipeline/images_of_run.h"

#include <gmock/gmock.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <set>
#include <string>
#include <vector>

#include "io/heic_photo.h"
#include "io/temporary_folder.h"
#include "mono3d/io/colmap_model.h"
#include "mono3d/io/frame_source.h"
#include "mono3d/io/output_file.h"
#include "mono3d/pipeline/run_writer.h"

namespace mono3d {
namespace {

using testing::ElementsAre;
namespace fs = std::filesystem;

constexpr int kFilmWidth = 64;
constexpr int kFilmHeight = 48;

cv::Mat GreyImage(int grey) { return {kFilmHeight, kFilmWidth, CV_8UC3, cv::Scalar::all(grey)}; }

// A film of eight frames, of grey values 20, 45, ...
std::string WriteFilm(const fs::path& folder) {
  const std::string video = folder / "flight.avi";
  cv::VideoWriter writer(video, cv::CAP_OPENCV_MJPEG, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'),
                         20, cv::Size(kFilmWidth, kFilmHeight));
  for (int i = 0; i < 8; ++i) writer.write(GreyImage(20 + 25 * i));
  return video;
}

class ImagesOfRun : public TemporaryFolderTest {
 protected:
  ImagesOfRun() : out_(folder_ / "out") { fs::create_directories(out_); }

  // Images of the names, in a folder of the user's.
  std::string Folder(const std::vector<std::string>& names) const {
    fs::create_directories(folder_ / "in");
    for (std::size_t i = 0; i < names.size(); ++i) {
      fs::create_directories((folder_ / "in" / names[i]).parent_path());
      cv::imwrite(folder_ / "in" / names[i], GreyImage(static_cast<int>(10 * i)));
    }
    return folder_ / "in";
  }

  // A run whose keyframes are frames of the input.
  static Reconstruction RunWithKeyframes(
      const std::vector<std::pair<std::int64_t, std::string>>& keyframes) {
    Reconstruction reconstruction;
    SparseModel& sparse = reconstruction.maps.emplace_back().sparse;
    sparse.camera = {
        .width = kFilmWidth, .height = kFilmHeight, .fx = 60, .fy = 60, .cx = 31.5, .cy = 23.5};
    sparse.points = {{{0, 0, 2}}};
    for (const auto& [index, name] : keyframes) {
      SparseImage& image = sparse.images.emplace_back();
      image.id = index;
      image.name = name;
      image.observations = {{{31.5, 23.5}, 0}};
    }
    return reconstruction;
  }

  static std::vector<std::string> Names(const Reconstruction& reconstruction) {
    std::vector<std::string> names;
    for (const SparseImage& image : reconstruction.maps[0].sparse.images) {
      names.push_back(image.name);
    }
    return names;
  }

  static double GreyOf(const fs::path& path) { return cv::mean(cv::imread(path))[0]; }

  fs::path out_;
};

TEST_F(ImagesOfRun, OfAVideoShowItsFrames) {
  const std::string video = WriteFilm(folder_);
  Reconstruction run = RunWithKeyframes({{1, "flight.avi#1"},
                                         {3, "another.avi#3"},  // of a map that was loaded
                                         {6, "flight.avi#6"}});
  const RunWriter writer(out_);
  PlaceImagesOfRun(video, ImagePlacing::kLink, out_, run);
  writer.WriteSparseModels(run, run.maps[0].sparse.camera);
  const SparseModel written = ReadColmapModel(out_ / "sparse");
  ASSERT_EQ(written.images.size(), 2U);
  for (const SparseImage& image : written.images) {
    const cv::Mat shown = cv::imread(out_ / "images" / image.name);
    ASSERT_EQ(shown.size(), cv::Size(kFilmWidth, kFilmHeight)) << image.name;
    EXPECT_NEAR(cv::mean(shown)[0], 20.0 + 25 * static_cast<double>(image.id), 3);
  }
  EXPECT_EQ(written.images[1].name, "000006.jpg");
  const RunWriter next(out_);
  EXPECT_FALSE(fs::exists(out_ / "images"));
}

// What is written early is told from what is read again by its grey value.
TEST_F(ImagesOfRun, OfAVideoThatWereWrittenWhileItWasReadAreNotReadAgain) {
  const std::string video = WriteFilm(folder_);
  KeyframeImageWriter early(out_, /*resumes=*/false);
  for (std::int64_t i = 0; i < 8; ++i) {
    early.Keep(i, GreyImage(7));
    if (i > 0) early.Decide(i - 1, /*is_keyframe=*/i == 2 || i == 4 || i == 7);
  }
  EXPECT_EQ(early.written(), (std::set<std::int64_t>{1, 3, 6}));
  EXPECT_TRUE(MayPlaceImages(out_ / "images")) << "they are the run's";
  // Frame 3 is no keyframe in the end; frame 5 has become one later.
  Reconstruction run =
      RunWithKeyframes({{1, "flight.avi#1"}, {5, "flight.avi#5"}, {6, "flight.avi#6"}});
  PlaceImagesOfRun(video, ImagePlacing::kLink, out_, run, early.written());
  EXPECT_THAT(Names(run), ElementsAre("000001.jpg", "000005.jpg", "000006.jpg"));
  EXPECT_NEAR(GreyOf(out_ / "images/000001.jpg"), 7, 1);
  EXPECT_NEAR(GreyOf(out_ / "images/000005.jpg"), 145, 3);
  EXPECT_NEAR(GreyOf(out_ / "images/000006.jpg"), 7, 1);
  EXPECT_FALSE(fs::exists(out_ / "images/000003.jpg"));
  EXPECT_THAT(NamesOfPlacedImages(out_ / "images"),
              ElementsAre("000001.jpg", "000005.jpg", "000006.jpg", ".images_of_run"));
}

// Killed while it wrote the list, or an image of the list.
TEST_F(ImagesOfRun, TakeThePlaceOfWhatAKilledRunLeft) {
  const std::string video = WriteFilm(folder_);
  for (const char* left : {".images_of_run.partial", "000001.jpg.partial"}) {
    const fs::path images = out_ / "images";
    fs::create_directories(images);
    if (std::string(left) != ".images_of_run.partial") {
      WriteFileAtomically(images / ".images_of_run", "000001.jpg\n");
    }
    WriteFileAtomically(images / left, "half");
    EXPECT_TRUE(MayPlaceImages(images)) << left;
    Reconstruction run = RunWithKeyframes({{1, "flight.avi#1"}});
    PlaceImagesOfRun(video, ImagePlacing::kLink, out_, run);
    EXPECT_FALSE(fs::exists(images / left));
    EXPECT_THAT(NamesOfPlacedImages(images), ElementsAre("000001.jpg", ".images_of_run"));
    fs::remove_all(images);
  }
}

TEST_F(ImagesOfRun, WrittenEarlyGoOnBesideThoseOfTheRunThatWasBrokenOff) {
  {
    KeyframeImageWriter broken_off(out_, /*resumes=*/false);
    broken_off.Keep(1, GreyImage(7));
    broken_off.Decide(1, true);
  }
  KeyframeImageWriter resumed(out_, /*resumes=*/true);
  EXPECT_EQ(resumed.written(), (std::set<std::int64_t>{1}));
  resumed.Keep(2, GreyImage(9));
  resumed.Decide(2, true);
  EXPECT_EQ(resumed.written(), (std::set<std::int64_t>{1, 2}));
  EXPECT_NEAR(GreyOf(out_ / "images/000001.jpg"), 7, 1);

  KeyframeImageWriter anew(out_, /*resumes=*/false);
  anew.Keep(3, GreyImage(9));
  anew.Decide(3, true);
  EXPECT_FALSE(fs::exists(out_ / "images/000001.jpg")) << "of an earlier run";
}

// A run that is resumed reads hundreds of frames again before it goes on.
TEST_F(ImagesOfRun, OfFramesThatNobodyDecidesOnOnlyTheLatestTakeMemory) {
  KeyframeImageWriter early(out_, /*resumes=*/false);
  const cv::Mat first = GreyImage(7);
  for (std::int64_t i = 0; i < 100; ++i) early.Keep(i, i == 0 ? first : GreyImage(9));
  EXPECT_EQ(first.u->refcount, 1) << "is still held";
  early.Decide(50, true);
  EXPECT_TRUE(early.written().empty());
  early.Decide(99, true);
  EXPECT_EQ(early.written(), (std::set<std::int64_t>{99}));
}

TEST_F(ImagesOfRun, AreNotWrittenEarlyBesideSomebodyElses) {
  fs::create_directories(out_ / "images");
  cv::imwrite(out_ / "images/mine.png", GreyImage(7));
  KeyframeImageWriter early(out_, /*resumes=*/false);
  early.Keep(1, GreyImage(7));
  early.Decide(1, true);
  EXPECT_TRUE(early.written().empty());
  EXPECT_FALSE(fs::exists(out_ / "images/000001.jpg"));
}

TEST_F(ImagesOfRun, OfAFolderAreLinkedUnderNamesWithoutBlanks) {
  const std::string in = Folder({"DJI 0001.png", "Hügel 2.png", "c.png"});
  Reconstruction run =
      RunWithKeyframes({{0, "DJI 0001.png"}, {1, "Hügel 2.png"}, {2, "of another flight.png"}});
  PlaceImagesOfRun(in, ImagePlacing::kLink, out_, run);
  EXPECT_THAT(Names(run), ElementsAre("DJI_0001.png", "Hügel_2.png"));
  for (const std::string& name : Names(run)) {
    EXPECT_TRUE(fs::is_symlink(out_ / "images" / name)) << name;
  }
  EXPECT_EQ(GreyOf(out_ / "images/Hügel_2.png"), 10);

  // A second run has no longer what was the first one's.
  run = RunWithKeyframes({{2, "c.png"}});
  PlaceImagesOfRun(in, ImagePlacing::kCopy, out_, run);
  EXPECT_FALSE(fs::exists(out_ / "images/DJI_0001.png"));
  EXPECT_TRUE(fs::exists(folder_ / "in/DJI 0001.png")) << "the link has gone, not the image";
  EXPECT_FALSE(fs::is_symlink(out_ / "images/c.png"));
  EXPECT_EQ(GreyOf(out_ / "images/c.png"), 20);
}

// COLMAP and programs that train splats read no HEIC.
TEST_F(ImagesOfRun, OfAPhoneAreWrittenAsJpeg) {
  const std::string heic = HeicPhoto(GreyImage(120));
  if (heic.empty()) GTEST_SKIP() << "libheif has no encoder of HEVC";
  WriteText("in/IMG_1.HEIC", heic);
  WriteText("in/IMG_2.HEIC", heic);
  Reconstruction run = RunWithKeyframes({{0, "IMG_1.HEIC"}, {1, "IMG_2.HEIC"}});
  PlaceImagesOfRun(folder_ / "in", ImagePlacing::kLink, out_, run);
  EXPECT_EQ(run.maps[0].sparse.images[1].name, "IMG_2.HEIC.jpg");
  const cv::Mat written = cv::imread(out_ / "images/IMG_2.HEIC.jpg");
  ASSERT_EQ(written.size(), cv::Size(kFilmWidth, kFilmHeight));
  EXPECT_NEAR(cv::mean(written)[0], 120, 4);
}

TEST_F(ImagesOfRun, OfOneNameAreToldApartByTheirFrames) {
  Folder({"a/1.png", "b/1.png", "b/2.png"});
  Reconstruction run = RunWithKeyframes({{0, "1.png"}, {1, "1.png"}, {2, "2.png"}});
  PlaceImagesOfRun(folder_ / "in/?/*.png", ImagePlacing::kLink, out_, run);
  EXPECT_THAT(Names(run), ElementsAre("000000_1.png", "000001_1.png", "2.png"));
  EXPECT_EQ(GreyOf(out_ / "images/000001_1.png"), 10);
}

TEST_F(ImagesOfRun, NeverTouchImagesOfTheUser) {
  const fs::path images = out_ / "images";
  fs::create_directories(images);
  cv::imwrite(images / "000000.png", GreyImage(70));
  Reconstruction run = RunWithKeyframes({{0, "000000.png"}});
  // The folder is the input of the run.
  PlaceImagesOfRun(out_, ImagePlacing::kCopy, out_, run);
  EXPECT_THAT(Names(run), ElementsAre("000000.png"));
  EXPECT_EQ(GreyOf(images / "000000.png"), 70);
  // It is somebody else's.
  const std::string in = Folder({"000000.png"});
  PlaceImagesOfRun(in, ImagePlacing::kCopy, out_, run);
  EXPECT_EQ(GreyOf(images / "000000.png"), 70);
  const RunWriter next(out_);
  EXPECT_EQ(GreyOf(images / "000000.png"), 70);
}

TEST_F(ImagesOfRun, AreLeftOutOnRequest) {
  const std::string in = Folder({"a.png"});
  Reconstruction run = RunWithKeyframes({{0, "a.png"}, {7, "earlier.png"}});
  PlaceImagesOfRun(in, ImagePlacing::kNone, out_, run);
  EXPECT_THAT(Names(run), ElementsAre("a.png", "earlier.png"));
  EXPECT_FALSE(fs::exists(out_ / "images"));
}

}  // namespace
}  // namespace mono3d
