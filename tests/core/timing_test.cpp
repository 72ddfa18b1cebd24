// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/core/timing.h"

#include <gtest/gtest.h>

namespace mono3d {
namespace {

constexpr double kTick_ms = 20;  // the two clocks may count in ticks of their own

TEST(StageTimes, SumsByStageInTheOrderOfFirstAppearance) {
  StageTimes times;
  times.Add("depth/census", 2, 1);
  times.Add("depth/sgm", 5, 4);
  times.Add("depth/census", 3, 1.5, 0.5);
  const std::vector<StageTime> snapshot = times.Snapshot();
  ASSERT_EQ(snapshot.size(), 2U);
  EXPECT_EQ(snapshot[0].stage, "depth/census");
  EXPECT_EQ(snapshot[0].num_calls, 2);
  EXPECT_EQ(snapshot[0].wall_ms, 5);
  EXPECT_EQ(snapshot[0].gpu_ms, 2.5);
  EXPECT_EQ(snapshot[0].cpu_ms, 0.5);
  EXPECT_EQ(snapshot[1].stage, "depth/sgm");
}

TEST(ScopedStageTimer, CountsOneCallAndDoesNothingWithoutTimes) {
  StageTimes times;
  {
    const ScopedStageTimer timer(&times, "tracking/track");
    const ScopedStageTimer silent(nullptr, "tracking/track");
  }
  ASSERT_EQ(times.Snapshot().size(), 1U);
  EXPECT_EQ(times.Snapshot()[0].num_calls, 1);
  EXPECT_GE(times.Snapshot()[0].wall_ms, 0);
  EXPECT_GE(times.Snapshot()[0].cpu_ms, 0);
}

TEST(Timing, ProcessTimeAndMemoryAreMeasured) {
  const double start_ms = ProcessCpuMs();
  volatile double sum = 0;
  for (int i = 0; i < 3000000; ++i) sum = sum + i;
  EXPECT_GT(ProcessCpuMs(), start_ms);
  EXPECT_GT(ThreadCpuMs(), 0);
  EXPECT_LE(ThreadCpuMs(), ProcessCpuMs() + kTick_ms);
  EXPECT_GT(PeakMemoryBytes(), 1 << 20);  // no process of ours fits in a megabyte
}

}  // namespace
}  // namespace mono3d
