// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/image_list.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "io/temporary_folder.h"
#include "mono3d/core/error.h"
#include "mono3d/core/log.h"
#include "mono3d/io/frame_source.h"

namespace mono3d {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;
using testing::UnorderedElementsAre;

using ImageListTest = TemporaryFolderTest;

std::vector<std::string> Names(const std::vector<std::string>& paths) {
  std::vector<std::string> names;
  for (const std::string& path : paths) names.push_back(std::filesystem::path(path).filename());
  return names;
}

TEST(NaturalLess, ComparesRunsOfDigitsAsNumbers) {
  EXPECT_TRUE(NaturalLess("img2.jpg", "img10.jpg"));
  EXPECT_FALSE(NaturalLess("img10.jpg", "img2.jpg"));
  EXPECT_TRUE(NaturalLess("a1b9", "a1b10"));
  EXPECT_TRUE(NaturalLess("img", "img1"));
  EXPECT_TRUE(NaturalLess("img9.jpg", "img0010.jpg"));
  EXPECT_TRUE(NaturalLess("100000000000000000000000000001", "100000000000000000000000000002"));
}

TEST(NaturalLess, IsAStrictTotalOrder) {
  const std::vector<std::string> ordered = {"",  "0", "00",  "01",  "1",  "1a", "02",
                                            "2", "a", "a00", "a0b", "a1", "b"};
  std::vector<std::string> shuffled(ordered.rbegin(), ordered.rend());
  std::sort(shuffled.begin(), shuffled.end(), NaturalLess);
  for (std::size_t i = 0; i < shuffled.size(); ++i) {
    EXPECT_FALSE(NaturalLess(shuffled[i], shuffled[i]));
    for (std::size_t j = i + 1; j < shuffled.size(); ++j) {
      EXPECT_TRUE(NaturalLess(shuffled[i], shuffled[j])) << shuffled[i] << " " << shuffled[j];
      EXPECT_FALSE(NaturalLess(shuffled[j], shuffled[i])) << shuffled[i] << " " << shuffled[j];
    }
  }
}

TEST_F(ImageListTest, IsInNaturalOrderAndHasImagesOnly) {
  for (const char* name : {"img10.jpg", "img2.PNG", "img1.jpeg", "notes.txt", "._img1.jpg"}) {
    WriteText(name, "x");
  }
  std::filesystem::create_directory(folder_ / "folder.jpg");
  EXPECT_THAT(Names(ListImages(folder_)), ElementsAre("img1.jpeg", "img2.PNG", "img10.jpg"));
}

TEST_F(ImageListTest, SaysOnceWhatIsNamedAsAnImageAndIsNone) {
  WriteText("img1.jpg", "x");
  std::filesystem::create_directory(folder_ / "img2.jpg");
  std::filesystem::create_symlink(folder_ / "none", folder_ / "img3.jpg");
  std::vector<std::string> warnings;
  SetLogSink([&](LogLevel, std::string_view message) { warnings.emplace_back(message); });
  for (int i = 0; i < 2; ++i) EXPECT_THAT(Names(ListImages(folder_)), ElementsAre("img1.jpg"));
  SetLogSink({});
  EXPECT_THAT(warnings, UnorderedElementsAre(HasSubstr("img2.jpg: left out"),
                                             HasSubstr("img3.jpg: left out")));
}

TEST_F(ImageListTest, SaysThatPhotographsOfOtherFormsAreLeftOut) {
  for (const char* name : {"a.jpg", "b.DNG", "c.dng", "._d.dng", "e.HEIC"}) WriteText(name, "x");
  std::vector<std::string> warnings;
  SetLogSink([&](LogLevel, std::string_view message) { warnings.emplace_back(message); });
  EXPECT_THAT(Names(ListImages(folder_)), ElementsAre("a.jpg", "e.HEIC"));
  SetLogSink({});
  EXPECT_THAT(warnings, ElementsAre(AllOf(HasSubstr("2 photographs such as b.DNG are left out"),
                                          HasSubstr("develop them to JPEG"))));
}

TEST_F(ImageListTest, OfASequenceFolderIsThatOfItsImages) {
  WriteText("preview.jpg", "x");
  WriteText("images/1.jpg", "x");
  EXPECT_THAT(Names(ListImages(folder_)), ElementsAre("1.jpg"));
}

TEST_F(ImageListTest, OfAGlobIsInNaturalOrder) {
  for (const char* name : {"a10.jpg", "a9.jpg", "b1.jpg", "a1.txt"}) WriteText(name, "x");
  EXPECT_THAT(Names(ListImages(folder_ / "a*")), ElementsAre("a9.jpg", "a10.jpg"));
  EXPECT_THAT(Names(ListImages(folder_ / "?1.jpg")), ElementsAre("b1.jpg"));
}

TEST_F(ImageListTest, OfAFolderWithAStarInItsNameIsThatOfTheFolder) {
  WriteText("odd[1]*/1.jpg", "x");
  EXPECT_THAT(Names(ListImages(folder_ / "odd[1]*")), ElementsAre("1.jpg"));
}

TEST_F(ImageListTest, RefusesAnEmptyFolder) {
  EXPECT_THAT([&] { ListImages(folder_); },
              ThrowsMessage<Error>(HasSubstr(": there are no images in the folder (expected")));
}

TEST_F(ImageListTest, RefusesAGlobWithoutMatch) {
  EXPECT_THAT([&] { ListImages(folder_ / "*.jpg"); },
              ThrowsMessage<Error>(HasSubstr("*.jpg: no image matches the pattern")));
}

TEST_F(ImageListTest, RefusesAFolderThatIsNotThere) {
  EXPECT_THAT([&] { ListImages(folder_ / "none"); },
              ThrowsMessage<Error>(HasSubstr("none: there is no such folder")));
}

}  // namespace
}  // namespace mono3d
