// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/core/error.h"

#include <gtest/gtest.h>

namespace mono3d {
namespace {

TEST(Error, SaysWhereWhatExpectedAndFoundInOneLine) {
  const Error error(ErrorParts{
      .what = "wrong size", .where = "a.jpg", .expected = "768x448", .found = "640\nx480"});
  EXPECT_STREQ(error.what(), "a.jpg: wrong size (expected 768x448, found 640 x480)");
}

TEST(Error, LeavesOutEmptyParts) {
  EXPECT_STREQ(Error("no device").what(), "no device");
  EXPECT_STREQ(Error(ErrorParts{"bad", {}, {}, "7"}).what(), "bad (found 7)");
}

}  // namespace
}  // namespace mono3d
