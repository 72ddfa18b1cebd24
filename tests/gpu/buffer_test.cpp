// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "gpu/buffer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <span>

#include "gpu/device_handle.h"
#include "gpu/device_internals.h"
#include "gpu/test_device.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::vector<std::uint32_t> Counting(std::size_t size) {
  std::vector<std::uint32_t> values(size);
  std::iota(values.begin(), values.end(), 1U);
  return values;
}

// Every test runs with memory that the host sees and with memory that it does not.
class BufferTest : public ::testing::TestWithParam<std::shared_ptr<Device> (*)()> {
 protected:
  std::shared_ptr<Device> device() const { return GetParam()(); }
};

TEST_P(BufferTest, GivesBackWhatWasUploaded) {
  // One byte, less than a texel, odd, and more than two fillings of the staging buffer.
  for (const std::size_t size : {1U, 3U, 1001U, (34U << 20) + 5U}) {
    Buffer buffer(device(), size, "test");
    EXPECT_EQ(buffer.size_bytes(), size);
    std::vector<std::uint8_t> bytes(size);
    for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::uint8_t>(i * 7 + (i >> 9));
    buffer.Upload<std::uint8_t>(bytes);
    EXPECT_TRUE(buffer.Download<std::uint8_t>() == bytes) << size;
  }
}

// On large pages of the host, where the device is a processor.
TEST_P(BufferTest, IsReadWithoutACopyWhereTheHostSeesIt) {
  const std::vector<std::uint32_t> values = Counting((5U << 18) + 3U);
  Buffer buffer(device(), values.size() * sizeof(std::uint32_t), "test");
  buffer.Upload<std::uint32_t>(values);
  std::vector<std::uint32_t> copy;
  const std::span<const std::uint32_t> read = buffer.Read(copy);
  EXPECT_TRUE(std::ranges::equal(read, values));
  EXPECT_EQ(copy.empty(), device()->buffers_are_mappable());
  EXPECT_TRUE(Buffer().Read(copy).empty());
}

TEST_P(BufferTest, IsWrittenInPartWhereTheHostSeesIt) {
  Buffer buffer(device(), 4 * sizeof(std::uint32_t), "test");
  std::vector<std::uint32_t> copy;
  std::ranges::copy(Counting(4), buffer.BeginWrite(copy).begin());
  buffer.EndWrite(copy);
  EXPECT_THAT(buffer.Download<std::uint32_t>(), ElementsAre(1, 2, 3, 4));
  buffer.BeginWrite(copy)[2] = 30;
  buffer.EndWrite(copy);
  EXPECT_THAT(buffer.Download<std::uint32_t>(), ElementsAre(1, 2, 30, 4));
  EXPECT_EQ(copy.empty(), device()->buffers_are_mappable());
}

TEST_P(BufferTest, UploadsAndDownloadsAPart) {
  Buffer buffer(device(), 5 * sizeof(std::uint32_t), "test");
  buffer.Upload<std::uint32_t>(Counting(5));
  const std::vector<std::uint32_t> part = {30, 40};
  buffer.Upload<std::uint32_t>(part, 8);
  EXPECT_THAT(buffer.Download<std::uint32_t>(), ElementsAre(1, 2, 30, 40, 5));
  std::vector<std::uint32_t> end(2);
  buffer.Download<std::uint32_t>(end, 12);
  EXPECT_THAT(end, ElementsAre(40, 5));
}

TEST_P(BufferTest, StaysWholeWhenMoved) {
  Buffer buffer(device(), 8, "test");
  buffer.Upload<std::uint32_t>(Counting(2));
  const Buffer moved = std::move(buffer);
  EXPECT_THAT(moved.Download<std::uint32_t>(), ElementsAre(1, 2));
  EXPECT_EQ(moved.name(), "test");
}

TEST_P(BufferTest, RefusesATransferThatLeavesIt) {
  Buffer buffer(device(), 8, "test");
  std::vector<std::uint32_t> values(2);
  EXPECT_THROW(buffer.Upload<std::uint32_t>(Counting(3)), Error);
  EXPECT_THROW(buffer.Upload<std::uint32_t>(Counting(2), 4), Error);
  EXPECT_THROW(buffer.Download<std::uint32_t>(values, 4), Error);
  EXPECT_THROW(buffer.Download<std::uint32_t>(values, ~std::size_t{0} - 3), Error);
}

INSTANTIATE_TEST_SUITE_P(Memory, BufferTest, ::testing::Values(&TestDevice, &StagedTestDevice),
                         [](const auto& test) { return test.index == 0 ? "Mapped" : "Staged"; });

TEST(Buffer, IsEmptyByDefault) {
  Buffer buffer;
  EXPECT_EQ(buffer.size_bytes(), 0U);
  EXPECT_TRUE(buffer.Download<float>().empty());
  EXPECT_THROW(buffer.Upload<std::uint32_t>(Counting(1)), Error);
}

TEST(Buffer, RefusesSizeZero) { EXPECT_THROW(Buffer(TestDevice(), 0, "test"), Error); }

TEST(Buffer, RefusesMoreThanTheDeviceCanBindAndSaysTheLimit) {
  const std::uint64_t limit = Limits(*TestDevice()).max_storage_buffer_bytes;
  try {
    Buffer(TestDevice(), limit + 1, "depth/volume");
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("depth/volume"));
    EXPECT_THAT(error.what(), HasSubstr(std::to_string(limit)));
  }
}

}  // namespace
}  // namespace mono3d
