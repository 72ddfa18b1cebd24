// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "gpu/recorder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <numeric>
#include <random>
#include <thread>

#include "gpu/device_handle.h"
#include "gpu/shaders/affine.params.h"
#include "gpu/shaders/affine.spirv.h"
#include "gpu/shaders/atomic_min_64.spirv.h"
#include "gpu/shaders/prefix_sum_step.params.h"
#include "gpu/shaders/prefix_sum_step.spirv.h"
#include "gpu/shaders/subgroup.spirv.h"
#include "gpu/shaders/texels.spirv.h"
#include "gpu/test_device.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

using ::testing::ElementsAre;
using ::testing::SizeIs;

constexpr std::size_t kWord = sizeof(std::uint32_t);

std::vector<std::uint32_t> Random(std::size_t size) {
  std::mt19937 random(static_cast<std::uint32_t>(size));
  std::vector<std::uint32_t> values(size);
  std::generate(values.begin(), values.end(), std::ref(random));
  return values;
}

Buffer MakeBuffer(const std::shared_ptr<Device>& device, const std::vector<std::uint32_t>& values) {
  Buffer buffer(device, values.size() * kWord, "test/buffer");
  buffer.Upload<std::uint32_t>(values);
  return buffer;
}

// Records a prefix sum over `a` and returns the buffer that holds it: log2(n) steps, each of which
// reads what the one before has written anywhere in the buffer.
const Buffer& RecordPrefixSum(Recorder& recorder, const Kernel& step, const Buffer& a,
                              const Buffer& b) {
  const auto num_values = static_cast<std::uint32_t>(a.size_bytes() / kWord);
  const std::uint32_t num_groups = DivideRoundingUp(num_values, step.workgroup_size()[0]);
  const Buffer* from = &a;
  const Buffer* to = &b;
  for (std::uint32_t stride = 1; stride < num_values; stride *= 2) {
    recorder.Dispatch(step, {*from, *to}, PrefixSumStepParams{num_values, stride},
                      {num_groups, 1, 1});
    std::swap(from, to);
  }
  return *from;
}

class RecorderTest : public ::testing::TestWithParam<std::shared_ptr<Device> (*)()> {
 protected:
  std::shared_ptr<Device> device() const { return GetParam()(); }
};

TEST_P(RecorderTest, LetsEachStepSeeTheOneBefore) {
  const Kernel step(device(), {"test/prefix_sum_step", test_prefix_sum_step_spirv});
  Recorder recorder(device());
  for (const std::size_t size : {1U, 63U, 65U, 561U, 100003U}) {
    const std::vector<std::uint32_t> values = Random(size);
    std::vector<std::uint32_t> expected(size);
    std::partial_sum(values.begin(), values.end(), expected.begin());
    const Buffer a = MakeBuffer(device(), values);
    const Buffer b(device(), size * kWord, "test/b");
    const Buffer& sums = RecordPrefixSum(recorder, step, a, b);
    recorder.Submit();
    EXPECT_TRUE(sums.Download<std::uint32_t>() == expected) << size;
  }
}

TEST_P(RecorderTest, KeepsTheOrderOfFillCopyAndDispatch) {
  const Kernel affine(device(), {"test/affine", test_affine_spirv});
  const Buffer a(device(), 3 * kWord, "test/a");
  const Buffer b(device(), 3 * kWord, "test/b");
  Recorder recorder(device());
  recorder.Fill(a, 5);
  recorder.Dispatch(affine, {a, b}, AffineParams{.num_values = 3, .factors = {2, 3}, .offset = -1},
                    {1, 1, 1});  // b = 29 29 29
  recorder.Fill(a, 7);
  recorder.Copy(a, 0, b, kWord, kWord);      // b = 29 7 29
  recorder.Copy(b, 0, a, kWord, 2 * kWord);  // a = 7 29 7
  recorder.Submit();
  EXPECT_THAT(b.Download<std::uint32_t>(), ElementsAre(29, 7, 29));
  EXPECT_THAT(a.Download<std::uint32_t>(), ElementsAre(7, 29, 7));
}

TEST_P(RecorderTest, ReadsTexelsOfEachFormat) {
  const Kernel kernel(device(), {"test/texels", test_texels_spirv});
  Buffer a(device(), 8, "test/a");
  a.Upload<float>(std::vector<float>{0.5F, 1.5F});
  Buffer b(device(), 32, "test/b");
  b.Upload<float>(std::vector<float>{0, 1, 2, 3, 4, 5, 6, 7});
  const Buffer c = MakeBuffer(device(), {10, 20, 30, 40, 50, 60, 70, 80});
  Buffer d(device(), 8, "test/d");
  d.Upload<std::int32_t>(std::vector<std::int32_t>{-100, -200});
  Buffer e(device(), 32, "test/e");
  e.Upload<std::int32_t>(std::vector<std::int32_t>{-1000, 0, 0, 0, 0, 0, 0, -2000});
  // Two components: the third is 0, the fourth 1.
  const Buffer f = MakeBuffer(device(), {3, 5, 7, 9});
  Buffer g(device(), 16, "test/g");
  g.Upload<float>(std::vector<float>{0.25F, 0.5F, 0.75F, 1.25F});
  const Buffer result(device(), 32, "test/result");
  Recorder recorder(device());
  recorder.Dispatch(kernel, {a, b, c, d, e, f, g, result}, {2, 1, 1});
  recorder.Submit();
  EXPECT_THAT(result.Download<float>(),
              ElementsAre(-1086.25F, -73.F, -67.5F, -54.5F, -136.75F, -123.25F, -122.5F, -2109.5F));
}

TEST_P(RecorderTest, SharesTheDeviceWithAnotherThread) {
  const auto count_to_200 = [](const std::shared_ptr<Device>& device, std::uint32_t* result) {
    const Kernel affine(device, {"test/affine", test_affine_spirv});
    Buffer a = MakeBuffer(device, {0});
    Recorder recorder(device);
    for (int i = 0; i < 100; ++i) {
      recorder.Dispatch(affine, {a, a},
                        AffineParams{.num_values = 1, .factors = {1, 1}, .offset = 1}, {1, 1, 1});
      recorder.Submit();
      a.Upload<std::uint32_t>(std::vector<std::uint32_t>{a.Download<std::uint32_t>()[0] + 1});
    }
    *result = a.Download<std::uint32_t>()[0];
  };
  std::uint32_t here = 0;
  std::uint32_t there = 0;
  const std::shared_ptr<Device> shared = device();
  std::thread thread(count_to_200, shared, &there);
  count_to_200(shared, &here);
  thread.join();
  EXPECT_EQ(here, 200U);
  EXPECT_EQ(there, 200U);
}

INSTANTIATE_TEST_SUITE_P(Memory, RecorderTest, ::testing::Values(&TestDevice, &StagedTestDevice),
                         [](const auto& test) { return test.index == 0 ? "Mapped" : "Staged"; });

TEST(Recorder, TakesMoreStepsThanFitOnePool) {
  // More steps than fit one descriptor pool or one query pool, twice, with the same recorder.
  const Kernel affine(TestDevice(), {"test/affine", test_affine_spirv});
  const Buffer a = MakeBuffer(TestDevice(), {0});
  const Buffer b(TestDevice(), kWord, "test/b");
  Recorder recorder(TestDevice());
  constexpr int kNumSteps = 300;
  const AffineParams add_one{.num_values = 1, .factors = {1, 1}, .offset = 1};
  for (int submission = 0; submission < 2; ++submission) {
    for (int i = 0; i < kNumSteps; ++i) {
      recorder.Dispatch(affine, {a, a}, add_one, {1, 1, 1});
      recorder.Copy(a, 0, b, 0, kWord);  // another name, so that each step has its timestamp
    }
    StageTimes times;
    recorder.Submit(&times);
    EXPECT_THAT(times.Snapshot(), SizeIs(2));
  }
  EXPECT_THAT(b.Download<std::uint32_t>(), ElementsAre(2 * kNumSteps));
}

TEST(Recorder, RunsNothingTwice) {
  const Buffer a = MakeBuffer(TestDevice(), {0});
  Recorder recorder(TestDevice());
  recorder.Fill(a, 1);
  recorder.Submit();
  recorder.Fill(a, 2);
  recorder.Submit();
  recorder.Submit();
  EXPECT_THAT(a.Download<std::uint32_t>(), ElementsAre(2));
}

TEST(Recorder, KeepsBuffersAndKernelsUntilItHasRun) {
  const Buffer result(TestDevice(), kWord, "test/result");
  Recorder recorder(TestDevice());
  {
    const Kernel affine(TestDevice(), {"test/affine", test_affine_spirv});
    const Buffer values = MakeBuffer(TestDevice(), {20});
    recorder.Dispatch(affine, {values, result},
                      AffineParams{.num_values = 1, .factors = {2, 1}, .offset = 2}, {1, 1, 1});
  }
  recorder.Submit();
  EXPECT_THAT(result.Download<std::uint32_t>(), ElementsAre(42));
}

TEST(Recorder, SkipsAnEmptyGridAndGoesOnAfterAnError) {
  const Kernel affine(TestDevice(), {"test/affine", test_affine_spirv});
  const Buffer a = MakeBuffer(TestDevice(), {3});
  Recorder recorder(TestDevice());
  const AffineParams add_one{.num_values = 1, .factors = {1, 1}, .offset = 1};
  recorder.Dispatch(affine, {a, a}, add_one, {1, 1, 1});
  recorder.Dispatch(affine, {a, a}, add_one, {0, 1, 1});
  EXPECT_THROW(recorder.Dispatch(affine, {a}, add_one, {1, 1, 1}), Error);
  recorder.Submit();
  EXPECT_THAT(a.Download<std::uint32_t>(), ElementsAre(4));
}

TEST(Recorder, RefusesBadFillsAndCopies) {
  const Buffer a(TestDevice(), 16, "test/a");
  const Buffer b(TestDevice(), 8, "test/b");
  Recorder recorder(TestDevice());
  EXPECT_THROW(recorder.Fill(Buffer(), 0), Error);
  EXPECT_THROW(recorder.Copy(a, 0, Buffer(), 0, 4), Error);
  EXPECT_THROW(recorder.Copy(a, 0, b, 0, 12), Error);
  EXPECT_THROW(recorder.Copy(b, 4, a, 0, 8), Error);
  EXPECT_THROW(recorder.Copy(a, 0, a, 4, 8), Error);
}

TEST(Recorder, TimesEachKernelByName) {
  const Kernel affine(TestDevice(), {"test/affine", test_affine_spirv});
  const Kernel step(TestDevice(), {"test/prefix_sum_step", test_prefix_sum_step_spirv});
  const Buffer a = MakeBuffer(TestDevice(), Random(100000));
  const Buffer b(TestDevice(), a.size_bytes(), "test/b");
  Recorder recorder(TestDevice());
  StageTimes times;
  for (int submission = 0; submission < 3; ++submission) {
    recorder.Dispatch(affine, {a, b},
                      AffineParams{.num_values = 100000, .factors = {3, 1}, .offset = 1},
                      {DivideRoundingUp(100000, 64), 1, 1});
    RecordPrefixSum(recorder, step, a, b);
    recorder.Submit(&times);
  }
  const std::vector<StageTime> stages = times.Snapshot();
  ASSERT_EQ(stages.size(), 2U);
  EXPECT_EQ(stages[0].stage, "test/affine");
  EXPECT_EQ(stages[1].stage, "test/prefix_sum_step");
  for (const StageTime& stage : stages) {
    EXPECT_EQ(stage.num_calls, 3);
    EXPECT_EQ(stage.wall_ms, 0);
    EXPECT_GT(stage.gpu_ms, 0);
  }
}

TEST(Recorder, RunsSubgroupsOfTheSizeInTheLimits) {
  const DeviceLimits& limits = Limits(*TestDevice());
  const Kernel kernel(TestDevice(), {"test/subgroup", test_subgroup_spirv});
  const Buffer result(TestDevice(), 128 * 16, "test/result");
  Recorder recorder(TestDevice());
  recorder.Dispatch(kernel, {result}, {1, 1, 1});
  recorder.Submit();
  const std::vector<std::uint32_t> values = result.Download<std::uint32_t>();
  for (std::size_t i = 0; i < values.size(); i += 4) {
    EXPECT_EQ(values[i], limits.subgroup_size);
    EXPECT_EQ(values[i + 1], limits.subgroup_size);
    EXPECT_EQ(values[i + 2], limits.subgroup_size - 1);
    EXPECT_EQ(values[i + 3], 128 / limits.subgroup_size);
  }
}

TEST(Recorder, RunsAtomicsOn64Bits) {
  if (!Limits(*TestDevice()).has_int64_atomics) GTEST_SKIP() << "the device has none";
  const Kernel kernel(TestDevice(), {"test/atomic_min_64", test_atomic_min_64_spirv});
  std::mt19937_64 random(1);
  std::vector<std::uint64_t> values(640);
  std::generate(values.begin(), values.end(), std::ref(random));
  Buffer input(TestDevice(), values.size() * sizeof(std::uint64_t), "test/values");
  input.Upload<std::uint64_t>(values);
  const Buffer smallest(TestDevice(), sizeof(std::uint64_t), "test/smallest");
  Recorder recorder(TestDevice());
  recorder.Fill(smallest, ~std::uint32_t{0});
  recorder.Dispatch(kernel, {input, smallest}, {10, 1, 1});
  recorder.Submit();
  EXPECT_EQ(smallest.Download<std::uint64_t>().front(),
            *std::min_element(values.begin(), values.end()));
}

TEST(DivideRoundingUp, CountsTheLastPartialGroup) {
  EXPECT_EQ(DivideRoundingUp(0, 64), 0U);
  EXPECT_EQ(DivideRoundingUp(1, 64), 1U);
  EXPECT_EQ(DivideRoundingUp(64, 64), 1U);
  EXPECT_EQ(DivideRoundingUp(65, 64), 2U);
  EXPECT_THROW(DivideRoundingUp(std::uint64_t{1} << 40, 64), Error);
  EXPECT_THROW(DivideRoundingUp(1, 0), Error);
}

}  // namespace
}  // namespace mono3d
