// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Tables and pages, the finding of files.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "evaluate/files.h"
#include "report/base64.h"
#include "report/page.h"
#include "report/table.h"
#include "tools/command.h"

namespace mono3d::tools {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

Table SmallTable() {
  Table table;
  table.title = "Heights";
  table.columns = {"who", "metres"};
  table.rows = {{"a|b", "1.5"}, {"<c>", "12"}};
  table.notes = {"As measured."};
  return table;
}

TEST(Table, IsAlignedAsText) {
  EXPECT_EQ(ToText(SmallTable()),
            "Heights\n"
            "  who   metres\n"
            "  a|b      1.5\n"
            "  <c>       12\n"
            "  As measured.\n");
}

TEST(Table, EscapesWhatMarkdownAndHtmlMistake) {
  EXPECT_THAT(ToMarkdown(SmallTable()),
              AllOf(HasSubstr("| who | metres |\n| --- | ---: |\n"), HasSubstr("| a\\|b | 1.5 |")));
  EXPECT_THAT(ToHtml(SmallTable()), AllOf(HasSubstr("<th scope=\"row\">&lt;c&gt;</th><td>12</td>"),
                                          Not(HasSubstr("<c>"))));
}

TEST(FormatNumber, KeepsSignificantDigitsWithoutPowersOfTen) {
  EXPECT_EQ(FormatNumber(0.0246, 3), "0.0246");
  EXPECT_EQ(FormatNumber(1183.4, 3), "1183");
  EXPECT_EQ(FormatNumber(-2.5, 3), "-2.50");
  EXPECT_EQ(FormatNumber(0, 3), "0.00");
  EXPECT_EQ(FormatNumber(1e-30, 3), "0.000000000");
  EXPECT_EQ(FormatNumber(std::numeric_limits<double>::quiet_NaN()), "-");
  EXPECT_EQ(FormatPercent(0.9762), "97.6 %");
}

TEST(Base64, EqualsTheExamplesOfTheStandard) {
  const auto encode = [](const std::string& text) {
    return ToBase64(std::vector<std::uint8_t>(text.begin(), text.end()));
  };
  // RFC 4648, section 10.
  EXPECT_EQ(encode(""), "");
  EXPECT_EQ(encode("f"), "Zg==");
  EXPECT_EQ(encode("fo"), "Zm8=");
  EXPECT_EQ(encode("foo"), "Zm9v");
  EXPECT_EQ(encode("foobar"), "Zm9vYmFy");
}

TEST(Page, ADrawingIsAFileWithItsNamespaceAndPartOfThePageWithout) {
  Page page;
  page.title = "A & B";
  Figure drawing;
  drawing.name = "curve";
  drawing.alternative = "a \"curve\"";
  drawing.svg = "<svg xmlns=\"http://www.w3.org/2000/svg\"></svg>";
  Section section;
  section.figures = {drawing};
  page.sections = {section};
  EXPECT_THAT(ToHtml(page), AllOf(HasSubstr("<title>A &amp; B</title>"), HasSubstr("<svg></svg>"),
                                  HasSubstr("aria-label=\"a &quot;curve&quot;\"")));
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / "mono3d_page_test";
  WritePictures(folder, page);
  EXPECT_EQ(ReadText(folder / "curve.svg"), drawing.svg);
  std::filesystem::remove_all(folder);
}

TEST(FrameNumber, IsTheLastNumberBeforeTheFirstPoint) {
  EXPECT_EQ(FrameNumber("a/b12/rect2_0007.depth.pfm"), 7);
  EXPECT_EQ(FrameNumber("000120.png"), 120);
  EXPECT_EQ(FrameNumber("0.5.png"), 0);
  EXPECT_EQ(FrameNumber("image.png"), std::nullopt);
  EXPECT_EQ(FrameNumber("99999999999999999999.png"), std::nullopt);
}

TEST(SequenceFiles, ImagesGiveTheirNumbersToTheTruth) {
  SequenceFiles sequence;
  sequence.images = {"images/0101.jpg", "images/0102.jpg", "images/last.jpg"};
  EXPECT_EQ(NumberOfImage(sequence, 1), 102);
  EXPECT_EQ(NumberOfImage(sequence, 2), 2) << "no number in the name";
  EXPECT_EQ(NumberOfImage(sequence, 7), 7) << "no such image";
}

TEST(ListByFrame, TwoFilesOfOneFrameAreRefused) {
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / "mono3d_list_by_frame";
  std::filesystem::create_directories(folder);
  WriteText(folder / "001.pfm", "");
  EXPECT_EQ(ListByFrame(folder, ".pfm").size(), 1U);
  WriteText(folder / "1.pfm", "");
  EXPECT_THROW(ListByFrame(folder, ".pfm"), std::exception);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace mono3d::tools
