// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "depth/kernels.h"
#include "depth/padded_image.h"
#include "depth/sweep_geometry.h"
#include "gpu/buffer.h"
#include "gpu/recorder.h"
#include "gpu/test_device.h"

namespace mono3d {

// One pixel, odd sizes, and the size of the video that the paper uses.
inline constexpr LevelSize kSizes[] = {{1, 1}, {17, 33}, {768, 448}};
inline constexpr LevelSize kSmallSizes[] = {{1, 1}, {17, 33}, {70, 9}};

// On TestDevice(), made once for all tests.
DepthKernels& TestKernels();

// Bounds that leave out some columns and rows of the first source, and others of the reference.
void SetBounds(LevelSize size, SourceProjections& projections);

// A generator whose seed is the name of the test that runs.
std::mt19937 SeededByTestName();

// CV_8UC1. Uniform noise, which has every difference of grey values.
cv::Mat RandomImage(LevelSize size, std::mt19937& random);

// `share_missing` of the values are 0, the others uniform in [low, high).
std::vector<float> RandomValues(std::size_t count, float low, float high, double share_missing,
                                std::mt19937& random);

template <typename T>
Buffer ToBuffer(const std::vector<T>& data) {
  // Whole texels of 16 bytes, as the kernels read.
  Buffer buffer(TestDevice(), (data.size() * sizeof(T) + 15) / 16 * 16, "test");
  buffer.Upload(std::span<const T>(data));
  return buffer;
}

template <typename T>
Buffer MakeBuffer(std::size_t count) {
  return Buffer(TestDevice(), (count * sizeof(T) + 15) / 16 * 16, "test");
}

template <typename T>
std::vector<T> FirstOf(const Buffer& buffer, std::size_t count) {
  std::vector<T> data(count);
  buffer.Download(std::span<T>(data));
  return data;
}

// The padded images one after the other.
Buffer ImagesToBuffer(const std::vector<cv::Mat>& images);

// Image `index` of a buffer of padded images of `size`, without the padding.
cv::Mat ImageOf(const Buffer& buffer, LevelSize size, std::size_t index);

// The values of a map with rows of whole groups of four, without the rest of the last group.
std::vector<std::uint32_t> WithoutStride(const std::vector<std::uint32_t>& strided, LevelSize size);

::testing::AssertionResult SameImage(const cv::Mat& found, const cv::Mat& expected);

}  // namespace mono3d
