// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/io/paced_source.h"

#include <gmock/gmock.h>

#include <atomic>
#include <string>
#include <string_view>
#include <vector>

#include "mono3d/core/error.h"
#include "mono3d/core/log.h"
#include "mono3d/core/timing.h"

namespace mono3d {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

// Frames every `step_s`; an error after the last one where it is asked for.
class SteadySource final : public FrameSource {
 public:
  SteadySource(int num_frames, double step_s, bool fails = false)
      : num_frames_(num_frames), step_s_(step_s), fails_(fails) {}
  std::optional<Frame> Next() override {
    if (next_ < num_frames_) {
      Frame frame;
      frame.index = next_++;
      frame.timestamp_s = 7 + step_s_ * static_cast<double>(frame.index);
      return frame;
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

TEST(PacedSource, HandsOutEveryFrameNotBeforeItIsDue) {
  constexpr double kStep_s = 0.002;
  constexpr double kRounding_s = 1e-6;  // of clocks
  PacedSource source(std::make_unique<SteadySource>(5, kStep_s));
  EXPECT_EQ(source.camera().width, 17);
  EXPECT_EQ(source.num_frames(), 5);
  std::vector<std::int64_t> indices;
  const double before_s = 1e-3 * WallClockMs();
  while (const std::optional<Frame> frame = source.Next()) {
    EXPECT_GE(1e-3 * WallClockMs() - before_s,
              kStep_s * static_cast<double>(frame->index) - kRounding_s);
    indices.push_back(frame->index);
  }
  EXPECT_THAT(indices, ElementsAre(0, 1, 2, 3, 4));
  EXPECT_EQ(source.num_skipped(), 3);
}

TEST(PacedSource, ThrowsWhatItsSourceThrowsAfterTheFramesBefore) {
  PacedSource source(std::make_unique<SteadySource>(5, 0, true));
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(source.Next());
  EXPECT_THAT([&] { static_cast<void>(source.Next()); },
              ThrowsMessage<Error>(HasSubstr("another size")));
}

TEST(PacedSource, DoesNotWaitForTheEndOfALongGap) {
  std::vector<std::string> warnings;
  SetLogSink([&](LogLevel, std::string_view message) { warnings.emplace_back(message); });
  PacedSource source(std::make_unique<SteadySource>(3, 3600));
  const double before_s = 1e-3 * WallClockMs();
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(source.Next());
  SetLogSink({});
  EXPECT_LT(1e-3 * WallClockMs() - before_s, 600);
  ASSERT_EQ(warnings.size(), 2U);
  EXPECT_THAT(warnings[0], HasSubstr("a gap of 3600 s"));
}

// Of a frame that is due in a few seconds and a stop that comes at once.
TEST(PacedSource, EndsWhenToldToStop) {
  std::atomic<bool> stop = false;
  PacedSource source(std::make_unique<SteadySource>(2, 9), &stop);
  EXPECT_TRUE(source.Next());
  stop = true;
  EXPECT_FALSE(source.Next());
}

}  // namespace
}  // namespace mono3d
