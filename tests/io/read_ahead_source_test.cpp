// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/read_ahead_source.h"

#include <gmock/gmock.h>

#include <atomic>
#include <chrono>
#include <string>
#include <thread>

#include "mono3d/core/error.h"

namespace mono3d {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

// Counted frames, one image skipped before each; an error in place of frame `fails_at`.
class CountingSource final : public FrameSource {
 public:
  CountingSource(int num_frames, std::atomic<int>& num_read, int fails_at = -1)
      : count_(num_frames), num_read_(num_read), fails_at_(fails_at) {}
  std::optional<Frame> Next() override {
    if (next_ == fails_at_) throw Error("frame " + std::to_string(next_) + " is damaged");
    if (next_ == count_) return std::nullopt;
    Frame frame;
    frame.index = next_++;
    ++num_read_;
    return frame;
  }
  std::optional<std::int64_t> num_frames() const override { return count_; }
  std::int64_t num_skipped() const override { return next_; }
  const CameraModel& camera() const override { return camera_; }

 private:
  int count_;
  std::atomic<int>& num_read_;
  int fails_at_;
  int next_ = 0;
  CameraModel camera_{.width = 17};
};

TEST(ReadAheadSource, HandsOutTheSameFramesWithWhatWasSkippedByThen) {
  std::atomic<int> num_read = 0;
  const auto source = ReadAhead(std::make_unique<CountingSource>(50, num_read));
  EXPECT_EQ(source->camera().width, 17);
  EXPECT_EQ(source->num_frames(), 50);
  for (int i = 0; i < 50; ++i) {
    EXPECT_EQ(source->num_skipped(), i);
    const auto frame = source->Next();
    ASSERT_TRUE(frame.has_value());
    EXPECT_EQ(frame->index, i);
  }
  EXPECT_FALSE(source->Next().has_value());
  EXPECT_FALSE(source->Next().has_value());
}

TEST(ReadAheadSource, AnErrorComesAtItsFrame) {
  std::atomic<int> num_read = 0;
  const auto source = ReadAhead(std::make_unique<CountingSource>(50, num_read, 3));
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(source->Next().has_value());
  EXPECT_THAT([&] { (void)source->Next(); }, ThrowsMessage<Error>(HasSubstr("frame 3 is damaged")));
  EXPECT_FALSE(source->Next().has_value());
}

TEST(ReadAheadSource, ReadsNothingUnaskedAndThenAFewFramesOnly) {
  std::atomic<int> num_read = 0;
  const auto source = ReadAhead(std::make_unique<CountingSource>(50, num_read));
  EXPECT_EQ(num_read, 0);
  ASSERT_TRUE(source->Next().has_value());
  // It reads on by itself, up to what may wait beside the frame that was taken.
  constexpr int kMost = 5;
  for (int i = 0; i < 1000 && num_read < kMost; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_EQ(num_read, kMost);
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_EQ(num_read, kMost) << "and is then destroyed with frames that nobody took";
}

}  // namespace
}  // namespace mono3d
