// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/core/log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace mono3d {
namespace {

TEST(Log, HandsMessagesToTheSinkAndDropsThemWithoutOne) {
  std::vector<std::string> messages;
  SetLogSink([&](LogLevel level, std::string_view message) {
    if (level == LogLevel::kWarning) messages.emplace_back(message);
  });
  Log(LogLevel::kWarning, "first");
  Log(LogLevel::kDebug, "not wanted");
  SetLogSink(nullptr);
  Log(LogLevel::kWarning, "nobody listens");
  EXPECT_THAT(messages, testing::ElementsAre("first"));
}

}  // namespace
}  // namespace mono3d
