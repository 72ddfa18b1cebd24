// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "gpu/host_kernel.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <thread>
#include <vector>

#include "gpu/device_internals.h"
#include "gpu/host_threads.h"
#include "gpu/recorder.h"
#include "gpu/shaders/affine.params.h"
#include "gpu/shaders/affine.spirv.h"
#include "gpu/test_device.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;

// What affine.comp does.
void AffineOnHost(const HostDispatch& dispatch, std::uint32_t part, std::uint32_t num_parts) {
  const auto params = dispatch.PushAs<AffineParams>();
  const HostShare share = ShareOf(params.num_values, 1, part, num_parts);
  for (std::uint32_t i = share.first; i < share.end; ++i) {
    dispatch.BufferAs<std::uint32_t>(1)[i] =
        dispatch.BufferAs<const std::uint32_t>(0)[i] * params.factors[0] * params.factors[1] +
        static_cast<std::uint32_t>(params.offset);
  }
}

void Fails(const HostDispatch& /*dispatch*/, std::uint32_t part, std::uint32_t /*num_parts*/) {
  if (part == 1) throw Error("no good");
}

Kernel AffineKernel(HostKernel host) {
  return Kernel(TestDevice(), {"test/affine", test_affine_spirv, host});
}

Buffer ThreeWords(const std::vector<std::uint32_t>& words) {
  Buffer buffer(TestDevice(), 4 * words.size(), "test/words");
  buffer.Upload<std::uint32_t>(words);
  return buffer;
}

AffineParams Times(std::uint32_t factor, int offset) {
  return {.num_values = 3, .factors = {factor, 1}, .offset = offset};
}

constexpr std::array<std::uint32_t, 3> kOneGroup = {1, 1, 1};

TEST(HostKernel, KeepsItsPlaceAmongTheSteps) {
  const Kernel host = AffineKernel(AffineOnHost);
  const Kernel shader = AffineKernel(nullptr);
  Buffer a = ThreeWords({9, 9, 9});
  const Buffer b = ThreeWords({0, 0, 0});
  Recorder recorder(TestDevice());
  for (int submission = 0; submission < 2; ++submission) {
    recorder.Dispatch(host, {a, b}, Times(10, 1), kOneGroup);  // sees what is uploaded later
    recorder.Dispatch(shader, {b, b}, Times(2, 0), kOneGroup);
    recorder.Dispatch(host, {b, b}, Times(1, 5), kOneGroup);
    recorder.Dispatch(host, {b, b}, Times(3, 0), kOneGroup);
    recorder.Copy(b, 0, b, 8, 4);
    recorder.Dispatch(shader, {b, b}, Times(1, -1), kOneGroup);
    a.Upload<std::uint32_t>(std::vector<std::uint32_t>{1, 2, 3});
    recorder.Submit();
    EXPECT_THAT(b.Download<std::uint32_t>(), ElementsAre(80, 140, 80));
  }
}

TEST(HostKernel, IsTimedByItsName) {
  const Kernel host = AffineKernel(AffineOnHost);
  const Buffer a = ThreeWords({1, 2, 3});
  Recorder recorder(TestDevice());
  recorder.Fill(a, 3);
  recorder.Dispatch(host, {a, a}, Times(2, 0), kOneGroup);
  recorder.Fill(a, 3);
  recorder.Dispatch(host, {a, a}, Times(2, 0), kOneGroup);
  StageTimes times;
  recorder.Submit(&times);
  const std::vector<StageTime> stages = times.Snapshot();
  ASSERT_EQ(stages.size(), 2U);
  EXPECT_EQ(stages[0].stage, "gpu/fill");
  EXPECT_EQ(stages[1].stage, "test/affine");
  EXPECT_EQ(stages[1].num_calls, 1);
  EXPECT_GT(stages[1].gpu_ms, 0);
}

TEST(HostKernel, FailsAtSubmitAndTheRecorderGoesOn) {
  if (TestDevice()->host_threads() == nullptr) GTEST_SKIP() << "the driver runs all kernels";
  const Kernel fails = AffineKernel(Fails);
  const Kernel host = AffineKernel(AffineOnHost);
  const Buffer a = ThreeWords({1, 2, 3});
  Recorder recorder(TestDevice());
  recorder.Dispatch(fails, {a, a}, Times(2, 0), kOneGroup);
  recorder.Dispatch(host, {a, a}, Times(2, 0), kOneGroup);
  EXPECT_THROW(recorder.Submit(), Error);
  EXPECT_THAT(a.Download<std::uint32_t>(), ElementsAre(1, 2, 3));
  recorder.Dispatch(host, {a, a}, Times(2, 0), kOneGroup);
  recorder.Submit();
  EXPECT_THAT(a.Download<std::uint32_t>(), ElementsAre(2, 4, 6));
}

TEST(HostShare, HasEachItemOnce) {
  for (const std::uint32_t num : {0U, 1U, 7U, 8U, 9U, 100U, 1000U}) {
    for (const std::uint32_t group : {1U, 8U}) {
      std::uint32_t next = 0;
      for (std::uint32_t part = 0; part < 12; ++part) {
        const HostShare share = ShareOf(num, group, part, 12);
        EXPECT_EQ(share.first, next);
        EXPECT_TRUE(share.first % group == 0 || share.first == num);
        next = share.end;
      }
      EXPECT_EQ(next, num);
    }
  }
}

// Adds one for each part that is done.
void CountParts(const HostDispatch& dispatch, std::uint32_t part, std::uint32_t num_parts) {
  ASSERT_LT(part, num_parts);
  reinterpret_cast<std::atomic<int>*>(dispatch.buffers[0])[part].fetch_add(1);
  reinterpret_cast<std::atomic<int>*>(dispatch.buffers[1])->store(static_cast<int>(num_parts));
}

void ExpectEachPartOnceInARun(HostThreads& threads, int num_runs) {
  std::vector<std::atomic<int>> counts(10'000);
  std::atomic<int> num_parts = 0;
  const std::array<std::byte*, 2> buffers = {reinterpret_cast<std::byte*>(counts.data()),
                                             reinterpret_cast<std::byte*>(&num_parts)};
  for (int run = 0; run < num_runs; ++run) {
    threads.Run(CountParts, {.constants = {}, .push = {}, .buffers = buffers});
    ASSERT_GT(num_parts, 0);
    for (std::size_t part = 0; part < static_cast<std::size_t>(num_parts.load()); ++part) {
      ASSERT_EQ(counts[part], run + 1);
    }
  }
}

TEST(HostThreads, DoEachPartOnce) {
  for (const bool caller_helps : {true, false}) {
    HostThreads threads(caller_helps);
    ExpectEachPartOnceInARun(threads, 300);
  }
}

TEST(HostThreads, WorkForSeveralAtOnce) {
  HostThreads threads(true);
  std::vector<std::thread> callers;
  for (int i = 0; i < 4; ++i) {
    callers.emplace_back([&] { ExpectEachPartOnceInARun(threads, 100); });
  }
  for (std::thread& caller : callers) caller.join();
}

}  // namespace
}  // namespace mono3d
