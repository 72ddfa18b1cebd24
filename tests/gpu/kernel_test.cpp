// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "gpu/kernel.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "gpu/device_handle.h"
#include "gpu/recorder.h"
#include "gpu/shaders/affine.params.h"
#include "gpu/shaders/affine.spirv.h"
#include "gpu/shaders/image_2d.spirv.h"
#include "gpu/shaders/missing_binding.spirv.h"
#include "gpu/shaders/needs_float64.spirv.h"
#include "gpu/shaders/other_set.spirv.h"
#include "gpu/shaders/specialized.spirv.h"
#include "gpu/shaders/texels.spirv.h"
#include "gpu/shaders/uniform_block.spirv.h"
#include "gpu/test_device.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string MessageOf(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

std::string MessageOfKernel(std::span<const std::uint32_t> spirv,
                            std::vector<std::uint32_t> specialization = {}) {
  return MessageOf([&] { Kernel(TestDevice(), {"test/kernel", spirv}, specialization); });
}

TEST(Kernel, ReadsItsInterfaceFromTheShader) {
  const Kernel affine(TestDevice(), {"test/affine", test_affine_spirv});
  EXPECT_EQ(affine.name(), "test/affine");
  EXPECT_EQ(affine.num_bindings(), 2);
  EXPECT_EQ(affine.push_constant_bytes(), sizeof(AffineParams));
  EXPECT_THAT(affine.workgroup_size(), ElementsAre(64, 1, 1));
  const Kernel texels(TestDevice(), {"test/texels", test_texels_spirv});
  EXPECT_EQ(texels.num_bindings(), 8);
  EXPECT_EQ(texels.push_constant_bytes(), 0U);
}

TEST(Kernel, KeepsTheDefaultsOfConstantsNotGiven) {
  const Kernel kernel(TestDevice(), {"test/specialized", test_specialized_spirv});
  EXPECT_THAT(kernel.workgroup_size(), ElementsAre(1, 2, 1));
}

TEST(Kernel, RunsWithItsSpecialization) {
  const Kernel kernel(TestDevice(), {"test/specialized", test_specialized_spirv}, {3, 100});
  EXPECT_THAT(kernel.workgroup_size(), ElementsAre(3, 2, 1));
  const Buffer result(TestDevice(), 6 * 16, "test/result");
  Recorder recorder(TestDevice());
  recorder.Dispatch(kernel, {result}, {1, 1, 1});
  recorder.Submit();
  const std::vector<std::uint32_t> values = result.Download<std::uint32_t>();
  for (std::size_t i = 0; i < values.size(); i += 4) {
    EXPECT_EQ(values[i], 100U);
    EXPECT_EQ(values[i + 1], 8U);
    EXPECT_EQ(values[i + 2], 3U);
    EXPECT_EQ(values[i + 3], 2U);
  }
}

TEST(Kernel, RefusesConstantsThatTheShaderDoesNotHave) {
  EXPECT_THAT(MessageOfKernel(test_specialized_spirv, {1, 2, 3, 4}),
              AllOf(HasSubstr("test/kernel"), HasSubstr("no specialization constant 3")));
}

TEST(Kernel, RefusesAWorkgroupLargerThanTheDeviceTakes) {
  const std::uint32_t limit = Limits(*TestDevice()).max_workgroup_size[0];
  EXPECT_THAT(MessageOfKernel(test_specialized_spirv, {limit + 1}),
              HasSubstr("at most " + std::to_string(limit)));
  EXPECT_THAT(MessageOfKernel(test_specialized_spirv, {0}), HasSubstr("workgroup size is 0"));
}

TEST(Kernel, RefusesWhatTheDeviceLacks) {
  EXPECT_THAT(MessageOfKernel(test_needs_float64_spirv),
              AllOf(HasSubstr("test/kernel"), HasSubstr(Info(*TestDevice()).name),
                    HasSubstr("SPIR-V capability 10")));
}

TEST(Kernel, RefusesBindingsThatItDoesNotKnow) {
  EXPECT_THAT(MessageOfKernel(test_uniform_block_spirv), HasSubstr("neither a buffer nor"));
  EXPECT_THAT(MessageOfKernel(test_image_2d_spirv), HasSubstr("picture is no imageBuffer"));
  EXPECT_THAT(MessageOfKernel(test_other_set_spirv), HasSubstr("not in set 0"));
  EXPECT_THAT(MessageOfKernel(test_missing_binding_spirv), HasSubstr("binding 1 is missing"));
}

TEST(Kernel, RefusesWhatIsNoSpirv) {
  const std::vector<std::uint32_t> nonsense = {1, 2, 3, 4, 5, 6, 7};
  EXPECT_THAT(MessageOfKernel(nonsense), HasSubstr("test/kernel: the shader cannot be used"));
  EXPECT_THAT(MessageOfKernel({}), HasSubstr("test/kernel: the shader cannot be used"));
}

TEST(Dispatch, RefusesWhatDisagreesWithTheShader) {
  const Kernel kernel(TestDevice(), {"test/affine", test_affine_spirv});
  const Buffer buffer(TestDevice(), 64, "test/buffer");
  const Buffer empty;
  Recorder recorder(TestDevice());
  const AffineParams params{.num_values = 1, .factors = {1, 1}, .offset = 0};
  EXPECT_THAT(MessageOf([&] {
                recorder.Dispatch(kernel, {buffer}, params, {1, 1, 1});
              }),
              HasSubstr("test/affine: wrong number of buffers (expected 2, found 1)"));
  EXPECT_THAT(MessageOf([&] {
                recorder.Dispatch(kernel, {buffer, buffer}, std::uint32_t{1}, {1, 1, 1});
              }),
              HasSubstr("wrong number of bytes of push constants (expected 16, found 4)"));
  EXPECT_THAT(MessageOf([&] {
                recorder.Dispatch(kernel, {buffer, buffer}, {1, 1, 1});
              }),
              HasSubstr("push constants (expected 16, found 0)"));
  EXPECT_THAT(MessageOf([&] {
                recorder.Dispatch(kernel, {buffer, empty}, params, {1, 1, 1});
              }),
              HasSubstr("empty buffer"));
  const std::uint32_t limit = Limits(*TestDevice()).max_workgroup_count[1];
  EXPECT_THAT(MessageOf([&] {
                recorder.Dispatch(kernel, {buffer, buffer}, params, {1, limit + 1, 1});
              }),
              HasSubstr("more workgroups"));
}

TEST(Dispatch, RefusesABufferOfAnotherDevice) {
  const Kernel kernel(TestDevice(), {"test/affine", test_affine_spirv});
  const Buffer own(TestDevice(), 64, "test/own");
  const Buffer foreign(StagedTestDevice(), 64, "test/foreign");
  Recorder recorder(TestDevice());
  EXPECT_THAT(MessageOf([&] {
                recorder.Dispatch(kernel, {own, foreign}, AffineParams{}, {1, 1, 1});
              }),
              HasSubstr("test/foreign: it belongs to another device"));
}

}  // namespace
}  // namespace mono3d
