// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "geo/position_text.h"

#include <gtest/gtest.h>

namespace mono3d {
namespace {

TEST(PositionText, ReadsTheTimesOfAllDialects) {
  constexpr double kMay1_2022 = 1651363200;  // date -u -d 2022-05-01 +%s
  EXPECT_DOUBLE_EQ(ParseDateTime("2022-05-01 00:00:00").value(), kMay1_2022);
  EXPECT_NEAR(ParseDateTime("2022-05-01 15:01:58,531,716").value(), kMay1_2022 + 54118.531716,
              1e-6);
  EXPECT_NEAR(ParseDateTime("2022-05-01 15:01:58.5").value(), kMay1_2022 + 54118.5, 1e-6);
  EXPECT_DOUBLE_EQ(ParseDateTime("2022.5.1 15:01:58").value(), kMay1_2022 + 54118);
  EXPECT_DOUBLE_EQ(ParseDateTime("2022-05-01T15:01:58Z").value(), kMay1_2022 + 54118);
  EXPECT_DOUBLE_EQ(ParseDateTime("2022-05-01T15:01:58+02:00").value(), kMay1_2022 + 46918);
  EXPECT_DOUBLE_EQ(ParseDateTime("2022-05-01T15:01:58-0130").value(), kMay1_2022 + 59518);
  EXPECT_DOUBLE_EQ(ParseDateTime("2022:05:01 15:01:58").value(), kMay1_2022 + 54118);
  for (const char* wrong : {"", "2022-13-01 00:00:00", "2022-05-01", "15:01:58", "2022-05-01 25",
                            "2022-05-01 15:61:00", "2022-05-01 15:01:58 nonsense"}) {
    EXPECT_FALSE(ParseDateTime(wrong).has_value()) << wrong;
  }
  EXPECT_NEAR(ParseTimeOfDay("00:15:04,904").value(), 904.904, 1e-9);
}

TEST(PositionText, ReadsNumbersWithPointsAndCommas) {
  EXPECT_EQ(ParseDecimal("41.424724"), 41.424724);
  EXPECT_EQ(ParseDecimal("41,424724"), 41.424724);
  EXPECT_EQ(ParseDecimal(" -3 "), -3);
  EXPECT_FALSE(ParseDecimal("1,2,3").has_value());
  EXPECT_FALSE(ParseDecimal("n/a").has_value());
  EXPECT_EQ(ParseLeadingDecimal("200.70m"), 200.7);
  EXPECT_EQ(ParseLeadingDecimal("-27.3\xC2\xB0"), -27.3);
  EXPECT_FALSE(ParseLeadingDecimal("n/a").has_value());
  EXPECT_EQ(CountDecimals("-20.2533"), 4);
  EXPECT_EQ(CountDecimals("7"), 0);
}

}  // namespace
}  // namespace mono3d
