// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/backlog.h"

#include <gmock/gmock.h>

#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr std::size_t kFrameBytes = 384 * 224 * 3;

std::vector<std::int64_t> Indices(const std::vector<Frame>& frames) {
  std::vector<std::int64_t> indices;
  for (const Frame& frame : frames) indices.push_back(frame.index);
  return indices;
}

TEST(Backlog, HandsOutWhatLiesBetweenTwoFramesOnce) {
  Backlog backlog(10 * kFrameBytes);
  for (int i = 0; i < 6; ++i) backlog.Add(BlackFrame(i));
  EXPECT_THAT(Indices(backlog.Take(1, 4)), ElementsAre(2, 3));
  EXPECT_THAT(Indices(backlog.Take(-1, 5)), ElementsAre(0, 1, 4));
  EXPECT_THAT(Indices(backlog.Take(-1, 5)), IsEmpty());
  EXPECT_EQ(backlog.size(), 1U);
}

TEST(Backlog, LetsTheOldestGoWhereItWouldGrowBeyondItsBytes) {
  Backlog backlog(3 * kFrameBytes);
  for (int i = 0; i < 7; ++i) backlog.Add(BlackFrame(i));
  EXPECT_THAT(Indices(backlog.Take(-1, 100)), ElementsAre(4, 5, 6));
  // Room again for as many.
  for (int i = 7; i < 10; ++i) backlog.Add(BlackFrame(i));
  EXPECT_EQ(backlog.size(), 3U);
  backlog.Clear();
  EXPECT_EQ(backlog.size(), 0U);
  Backlog none(0);
  none.Add(BlackFrame(0));
  EXPECT_EQ(none.size(), 0U);
}

}  // namespace
}  // namespace mono3d::tracking
