// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/frame_queue.h"

#include <gmock/gmock.h>

namespace mono3d {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr LiveOptions kHalfASecond = {.max_delay_s = 0.5};

Frame QueuedFrameOf(std::int64_t index) {
  Frame frame;
  frame.index = index;
  frame.bgr = cv::Mat(100, 100, CV_8UC3);
  return frame;
}

std::vector<std::int64_t> TakeAll(FrameQueue& queue, double now_s) {
  std::vector<std::int64_t> taken;
  while (const auto waiting = queue.Take(now_s)) taken.push_back(waiting->frame.index);
  return taken;
}

TEST(FrameQueue, HandsOutInOrderWhatHasNotWaitedTooLong) {
  FrameQueue queue(kHalfASecond);
  for (int i = 0; i < 4; ++i) (void)queue.Add(QueuedFrameOf(i), 0.2 * i);
  EXPECT_THAT(TakeAll(queue, 0.8), ElementsAre(2, 3));  // since 0.4 and 0.6
  EXPECT_EQ(queue.num_dropped(), 2);
  EXPECT_EQ(queue.size(), 0U);
}

TEST(FrameQueue, SaysWithTheNextFrameWhatWasDropped) {
  FrameQueue queue(kHalfASecond);
  for (int i = 0; i < 3; ++i) EXPECT_THAT(queue.Add(QueuedFrameOf(i), 0), IsEmpty());
  EXPECT_THAT(TakeAll(queue, 10), ElementsAre(2));
  EXPECT_THAT(queue.Add(QueuedFrameOf(3), 10), ElementsAre(0, 1));
  EXPECT_THAT(queue.Add(QueuedFrameOf(4), 10), IsEmpty());
}

TEST(FrameQueue, DropsWhileNobodyTakes) {
  FrameQueue queue(kHalfASecond);
  for (int i = 0; i < 100; ++i) (void)queue.Add(QueuedFrameOf(i), 0.1 * i);
  EXPECT_NEAR(static_cast<double>(queue.num_dropped()), 94, 1);  // rounding of 0.1 i
}

TEST(FrameQueue, KeepsTheNewestHoweverLongItWaits) {
  FrameQueue queue(kHalfASecond);
  (void)queue.Add(QueuedFrameOf(0), 0);
  (void)queue.Add(QueuedFrameOf(1), 0.1);
  EXPECT_THAT(TakeAll(queue, 1000), ElementsAre(1));
  EXPECT_EQ(queue.num_dropped(), 1);
}

// Each image has 0.03 MB.
TEST(FrameQueue, HoldsNoMoreThanTheMemoryItMay) {
  FrameQueue queue({.max_delay_s = 1000, .max_waiting_mb = 0.1});
  for (int i = 0; i < 5; ++i) (void)queue.Add(QueuedFrameOf(i), 0);
  EXPECT_THAT(TakeAll(queue, 0), ElementsAre(2, 3, 4));
  FrameQueue small({.max_delay_s = 1000, .max_waiting_mb = 0.01});
  for (int i = 0; i < 5; ++i) (void)small.Add(QueuedFrameOf(i), 0);
  EXPECT_THAT(TakeAll(small, 0), ElementsAre(4)) << "the newest one is never dropped";
}

}  // namespace
}  // namespace mono3d
