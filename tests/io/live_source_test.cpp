// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/io/live_source.h"

#include <gmock/gmock.h>

#include <string>
#include <utility>
#include <vector>

#include "io/live_queue.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

Frame FrameOf(std::int64_t index, double timestamp_s = 0) {
  Frame frame;
  frame.index = index;
  frame.timestamp_s = timestamp_s;
  return frame;
}

std::vector<std::int64_t> TakeAll(LiveQueue& queue, double now_s) {
  std::vector<std::int64_t> taken;
  while (const std::optional<Frame> frame = queue.Take(now_s)) taken.push_back(frame->index);
  return taken;
}

TEST(LiveQueue, HandsOutInOrderWhatHasNotWaitedTooLong) {
  LiveQueue queue(0.5);
  for (int i = 0; i < 4; ++i) queue.Add(FrameOf(i), 0.2 * i);
  EXPECT_THAT(TakeAll(queue, 0.8), ElementsAre(2, 3));  // since 0.4 and 0.6
  EXPECT_EQ(queue.num_dropped(), 2);
  EXPECT_TRUE(queue.empty());
}

TEST(LiveQueue, DropsWhileNobodyTakes) {
  LiveQueue queue(0.5);
  for (int i = 0; i < 100; ++i) queue.Add(FrameOf(i), 0.1 * i);
  EXPECT_NEAR(static_cast<double>(queue.num_dropped()), 94, 1);  // rounding of 0.1 i
}

TEST(LiveQueue, KeepsTheNewestHoweverLongItWaits) {
  LiveQueue queue(0.5);
  queue.Add(FrameOf(0), 0);
  queue.Add(FrameOf(1), 0.1);
  EXPECT_THAT(TakeAll(queue, 1000), ElementsAre(1));
  EXPECT_EQ(queue.num_dropped(), 1);
}

// Frames every `step_s`; an error after the last one where it is asked for.
class SteadySource final : public FrameSource {
 public:
  SteadySource(int num_frames, double step_s, bool fails = false)
      : num_frames_(num_frames), step_s_(step_s), fails_(fails) {}
  std::optional<Frame> Next() override {
    if (next_ < num_frames_) {
      const int index = next_++;
      return FrameOf(index, 7 + step_s_ * index);
    }
    if (fails_) throw Error("image 5 has another size");
    return std::nullopt;
  }
  std::optional<std::int64_t> num_frames() const override { return num_frames_; }
  std::int64_t num_skipped() const override { return next_ == num_frames_ ? 3 : 0; }
  const CameraModel& camera() const override { return camera_; }

 private:
  int num_frames_;
  double step_s_;
  bool fails_;
  int next_ = 0;
  CameraModel camera_{.width = 17};
};

constexpr LiveSourceOptions kPatient{.max_delay_s = 3600};

TEST(LiveSource, HandsOutEveryFrameNotBeforeItIsDue) {
  constexpr double kRounding_s = 1e-6;  // of clocks
  LiveSource source(std::make_unique<SteadySource>(5, 0.002), kPatient);
  EXPECT_EQ(source.camera().width, 17);
  EXPECT_EQ(source.num_frames(), 5);
  std::vector<std::int64_t> indices;
  while (const std::optional<Frame> frame = source.Next()) {
    EXPECT_GE(source.Latency_s(*frame), -kRounding_s);
    indices.push_back(frame->index);
  }
  EXPECT_THAT(indices, ElementsAre(0, 1, 2, 3, 4));
  EXPECT_EQ(source.num_dropped(), 0);
  EXPECT_EQ(source.num_skipped(), 3);
}

TEST(LiveSource, CountsEveryFrameThatItDoesNotHandOut) {
  LiveSource source(std::make_unique<SteadySource>(200, 0), {.max_delay_s = 0});
  std::int64_t num_frames = 0;
  std::int64_t last = -1;
  while (const std::optional<Frame> frame = source.Next()) {
    EXPECT_GT(frame->index, last);
    last = frame->index;
    ++num_frames;
  }
  EXPECT_EQ(last, 199);
  EXPECT_EQ(num_frames + source.num_dropped(), 200);
}

TEST(LiveSource, ThrowsWhatItsSourceThrowsAfterTheFramesBefore) {
  LiveSource source(std::make_unique<SteadySource>(5, 0, true), kPatient);
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(source.Next());
  EXPECT_THAT([&] { static_cast<void>(source.Next()); },
              ThrowsMessage<Error>(HasSubstr("another size")));
  EXPECT_FALSE(source.Next());
}

TEST(LiveSource, EndsWhileAFrameIsStillFarAway) {
  LiveSource source(std::make_unique<SteadySource>(2, 3600), kPatient);
  EXPECT_TRUE(source.Next());
}

TEST(LiveSource, RefusesANegativeDelay) {
  EXPECT_THAT(
      [] {
        LiveSource(std::make_unique<SteadySource>(1, 0), LiveSourceOptions{.max_delay_s = -1});
      },
      ThrowsMessage<UsageError>(HasSubstr("live.max_delay_s")));
}

}  // namespace
}  // namespace mono3d
