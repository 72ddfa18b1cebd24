// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/core/error.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

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

TEST(Error, SaysWhatKindItIs) {
  EXPECT_EQ(Error("bad pose").code(), ErrorCode::kInvalidInput);
  EXPECT_EQ(Error("full", ErrorCode::kIo).code(), ErrorCode::kIo);
  const Error unsupported(ErrorParts{.what = "a fisheye",
                                     .where = {},
                                     .expected = {},
                                     .found = {},
                                     .code = ErrorCode::kUnsupported});
  EXPECT_EQ(unsupported.code(), ErrorCode::kUnsupported);
  EXPECT_STREQ(unsupported.what(), "a fisheye");
}

TEST(Error, OfUsageIsAlwaysAnInvalidArgument) {
  EXPECT_EQ(UsageError("x").code(), ErrorCode::kInvalidArgument);
  const ErrorParts parts{"option out of range", "fps", "more than 0", "-1", ErrorCode::kIo};
  EXPECT_EQ(UsageError(parts).code(), ErrorCode::kInvalidArgument);
  EXPECT_STREQ(UsageError(parts).what(),
               "fps: option out of range (expected more than 0, found -1)");
}

TEST(ErrorCode, HasATextOfItsOwn) {
  std::set<std::string> texts;
  for (const ErrorCode code :
       {ErrorCode::kInvalidArgument, ErrorCode::kInvalidInput, ErrorCode::kNotFound,
        ErrorCode::kUnsupported, ErrorCode::kIo, ErrorCode::kDevice, ErrorCode::kOutOfMemory}) {
    texts.insert(ToString(code));
  }
  EXPECT_EQ(texts.size(), 7U);
  EXPECT_FALSE(texts.contains("unknown error"));
}

}  // namespace
}  // namespace mono3d
